//! The channels: what is heard, and what is said.

use coloc_daemon::collect::messages::sighting;
use coloc_daemon::collect::sensors::Sensors;
use coloc_daemon::config::{ClockSource, Config};
use coloc_estimator::Sighting;
use coloc_rounds::{Going, Message, Post, Standing};
use coloc_sensors::{EndError, Hearing, Moment, Report};
use coloc_shm_types::{
    self as shm, Call, Clock, Correction, Estimate, Header, Limits, PortError, Publisher, Reject,
    RelativePose, Round, Sender, Sessions, Share, Shared, Space, Subscriber,
};

use crate::refusal::Refusal;
use crate::wire::{self, Team};
use coloc_rounds::seat::{Deed, Seat, Seen, Word};

/// Names of the figures in the driver's status, in their order.
pub const FIGURES: [&str; 8] = [
    "slot", "known", "since", "shared", "led", "followed", "joined", "refused",
];

/// One of the others.
#[derive(Debug)]
struct Other {
    number: u16,
    shares: Subscriber<Share>,
    rounds: Subscriber<Round>,
    calls: Subscriber<Call>,
}

/// Its ears and its mouths.
#[derive(Debug)]
pub struct Channels {
    sensors: Sensors,
    /// Of `[motion]` \[s\].
    reference_period_s: f64,
    shared: Subscriber<Shared>,
    sightings: Subscriber<RelativePose>,
    estimates: Subscriber<Estimate>,
    others: Vec<Other>,
    share: Publisher<Share>,
    round: Publisher<Round>,
    call: Publisher<Call>,
    correction: Publisher<Correction>,
    /// Of what is said to others, and of what is said to `colocd`.
    senders: [Sender; 4],
    team: Team,
    own: u16,
    clock: ClockSource,
    /// Of sightings, `colocd`, shares, rounds and calls.
    hearing: Hearing<Refusal>,
}

/// Kinds of messages, for [`Hearing`].
const SIGHTINGS: usize = 0;
const SHARED: usize = 1;
const SHARES: usize = 2;
const ROUNDS: usize = 3;
const CALLS: usize = 4;

impl Channels {
    /// Of the robot of a configuration.
    ///
    /// # Errors
    /// If a channel cannot be opened.
    pub fn open(space: &Space, config: &Config) -> Result<Self, EndError> {
        let name = &config.robot.name;
        // Stamps that go to other computers are of a clock that these have too.
        let clock = match config.clock.source {
            ClockSource::Boottime => Clock::Boottime,
            ClockSource::Realtime | ClockSource::Tai => Clock::Realtime,
        };
        let random = EndError::of("no random number");
        let sender = Sender::start(config.robot.id, clock).map_err(random)?;
        let random = EndError::of("no random number");
        let to_own = Sender::start(0, Clock::Boottime).map_err(random)?;
        let others: Result<Vec<Other>, PortError> = config
            .peers()
            .map(|peer| {
                Ok(Other {
                    number: peer.id,
                    shares: space.subscriber(&peer.name)?,
                    rounds: space.subscriber(&peer.name)?,
                    calls: space.subscriber(&peer.name)?,
                })
            })
            .collect();
        let (sensors, robots) = (Sessions::SENSORS, config.peers().count().max(1));
        let team = team(config);
        let speakers = [sensors, sensors, robots, robots, robots];
        let hearing = Hearing::new(config.robot.id, team.numbers().to_vec(), &speakers);
        Ok(Self {
            sensors: Sensors::of(config),
            reference_period_s: config.motion.reference_period_s,
            shared: space.subscriber(name)?,
            sightings: space.subscriber(name)?,
            estimates: space.subscriber(name)?,
            others: others?,
            share: space.publisher(name)?,
            round: space.publisher(name)?,
            call: space.publisher(name)?,
            correction: space.publisher(name)?,
            senders: [sender.beside(), sender.beside(), sender, to_own],
            team,
            own: config.robot.id,
            clock: config.clock.source,
            hearing,
        })
    }

    /// By how much the common clock is ahead of `CLOCK_BOOTTIME` \[ns\].
    fn ahead_ns(&self, now: Moment) -> i64 {
        match self.clock {
            ClockSource::Boottime => 0,
            ClockSource::Realtime | ClockSource::Tai => {
                now.realtime_ns.saturating_sub(now.boottime_ns)
            }
        }
    }

    /// Takes in all that has come; what is to be said, and how many bytes came.
    pub fn hear(&mut self, seat: &mut Seat, now: Moment) -> (Vec<Word>, u64) {
        let (mut words, mut bytes) = (Vec::new(), 0);
        while let Some(message) = next(&self.estimates, &mut bytes) {
            seat.go(self.going(&message));
        }
        while let Some(message) = next(&self.sightings, &mut bytes) {
            if !message.is_of_track() {
                self.hear_sighting(&message, seat, now);
            }
        }
        // What the others said at a slot is heard once this robot has begun it.
        while let Some(message) = next(&self.shared, &mut bytes) {
            words.extend(self.hear_shared(&message, seat, now));
        }
        for place in 0..self.others.len() {
            while let Some(message) = next(&self.others[place].calls, &mut bytes) {
                let of = (place, CALLS, &message.header);
                let made = self.hear_other(
                    of,
                    now,
                    |it| message.validate(it),
                    |team, me| wire::heard_call(team, me, &message),
                );
                words.extend(
                    made.into_iter()
                        .flat_map(|it| seat.hear(now.boottime_ns, &it)),
                );
            }
            while let Some(message) = next(&self.others[place].rounds, &mut bytes) {
                let of = (place, ROUNDS, &message.header);
                let made = self.hear_other(
                    of,
                    now,
                    |it| message.validate(it),
                    |team, _| wire::heard_round(team, &message),
                );
                words.extend(
                    made.into_iter()
                        .flat_map(|it| seat.hear(now.boottime_ns, &it)),
                );
            }
            while let Some(message) = next(&self.others[place].shares, &mut bytes) {
                let of = (place, SHARES, &message.header);
                let made = self.hear_other(
                    of,
                    now,
                    |it| message.validate(it),
                    |team, _| wire::heard_share(team, &message),
                );
                words.extend(
                    made.into_iter()
                        .flat_map(|it| seat.hear(now.boottime_ns, &it)),
                );
            }
        }
        words.extend(seat.tick(now.boottime_ns));
        (words, bytes)
    }

    /// The velocity's noise is of its mean over the reference period.
    fn going(&self, message: &Estimate) -> Going {
        let noise = wire::matrix(&message.velocity_covariance) * self.reference_period_s;
        let is_finite = message
            .velocity
            .iter()
            .chain(noise.iter())
            .all(|it| it.is_finite());
        if is_finite {
            Going {
                velocity: message.velocity,
                noise,
            }
        } else {
            Going::default()
        }
    }

    fn hear_sighting(&mut self, message: &RelativePose, seat: &mut Seat, now: Moment) {
        let mut seen: Option<Sighting> = None;
        let checked = self.hearing.check(now, |limits| {
            seen = Some(sighting(message, limits)?);
            Ok(())
        });
        let at_ns = checked.and_then(|()| self.hearing.accept(SIGHTINGS, &message.header, now));
        let (Some(at_ns), Some(seen)) = (at_ns, seen) else {
            return;
        };
        let seen = self.sensors.of_body(&seen);
        let Some(observed) = self.team.place(seen.observed.0) else {
            return;
        };
        seat.see(Seen {
            stamp_ns: at_ns.saturating_add(self.ahead_ns(now)),
            observed,
            pose: seen.relative,
            noise: seen.covariance.matrix(),
        });
    }

    fn hear_shared(&mut self, message: &Shared, seat: &mut Seat, now: Moment) -> Vec<Word> {
        let checked = self.hearing.check(now, |limits| message.validate(limits));
        let at_ns = checked.and_then(|()| self.hearing.accept(SHARED, &message.header, now));
        let Some(at_ns) = at_ns else {
            return Vec::new();
        };
        let begin_ns = at_ns.saturating_add(self.ahead_ns(now));
        let slot = (message.slot, begin_ns);
        seat.share(now.boottime_ns, slot, &wire::told(message))
    }

    fn hear_other(
        &mut self,
        (place, kind, header): (usize, usize, &Header),
        now: Moment,
        validate: impl FnOnce(&Limits<'_>) -> Result<(), Reject>,
        made: impl FnOnce(&Team, usize) -> Option<Message>,
    ) -> Option<Message> {
        if self.others[place].number != header.source {
            self.hearing.refuse(Refusal::Foreign);
            return None;
        }
        self.hearing.check(now, validate)?;
        self.hearing.accept(kind, header, now)?;
        made(&self.team, self.team.place(self.own)?)
    }

    /// Says what is to be said.
    pub fn say(&mut self, words: &[Word], now: Moment) {
        for word in words {
            let is_said = match word {
                Word::Post(post) => self.post(post, now),
                Word::Deed(deed) => self.correct(deed, now),
            };
            if is_said {
                self.hearing.note_said(now.boottime_ns);
            } else {
                self.hearing.refuse(Refusal::Channel);
            }
        }
    }

    fn post(&mut self, post: &Post, now: Moment) -> bool {
        let stamp_ns = now.boottime_ns.saturating_add(self.ahead_ns(now));
        let team = &self.team;
        let [shares, rounds, calls, _] = &mut self.senders;
        match &post.message {
            Message::Share {
                leader,
                known,
                share,
            } => {
                let header = shares.header(stamp_ns);
                let message = wire::share(team, *leader, *known, share);
                self.share.send(Share { header, ..message }).is_ok()
            }
            Message::Round(round) => {
                let header = rounds.header(stamp_ns);
                let message = wire::round(team, round);
                self.round.send(Round { header, ..message }).is_ok()
            }
            Message::Hello { slot, known, .. } => {
                let header = calls.header(stamp_ns);
                let message = wire::call(team, *slot, *known, None);
                self.call.send(Call { header, ..message }).is_ok()
            }
            Message::Ask { known, .. } => {
                let header = calls.header(stamp_ns);
                let message = wire::call(team, 0, *known, post.to);
                self.call.send(Call { header, ..message }).is_ok()
            }
        }
    }

    /// Tells `colocd` what to do.
    pub fn correct(&mut self, deed: &Deed, now: Moment) -> bool {
        let [.., to_own] = &mut self.senders;
        let header = to_own.header(now.boottime_ns);
        let message = wire::correction(deed);
        let sent = self.correction.send(shm::Correction { header, ..message });
        sent.is_ok()
    }

    /// For the driver's status.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // Counts.
    pub fn report(&self, seat: &Seat) -> Report {
        let counts = seat.counts();
        let since = match seat.standing() {
            Some(Standing::Since(slot)) => slot as f64,
            Some(Standing::Joining(_)) | None => f64::NAN,
        };
        self.hearing.report([
            seat.slot() as f64,
            seat.round().slot as f64,
            since,
            counts.shared as f64,
            counts.led as f64,
            counts.followed as f64,
            counts.joined as f64,
            counts.refused as f64,
        ])
    }
}

/// Of a configuration.
#[must_use]
pub fn team(config: &Config) -> Team {
    let others = config.peers().map(|it| it.id);
    Team::new(others.chain([config.robot.id]))
}

/// What cannot be read is as if it had not come.
fn next<M: shm::Message>(messages: &Subscriber<M>, bytes: &mut u64) -> Option<M> {
    let message = messages.receive().ok().flatten();
    *bytes += message.as_ref().map_or(0, |_| size_of::<M>() as u64);
    message
}
