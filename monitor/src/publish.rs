//! The channels: what is heard, and what is said.

use coloc_bounds::AngleInterval;
use coloc_bounds::evidence::{Area, Seen};
use coloc_daemon::collect::sensors::Sensors;
use coloc_daemon::config::{ClockSource, Config};
use coloc_estimator::HeadingOf;
use coloc_sensors::{EndError, Hearing, Moment, Report};
use coloc_shm_types::{
    Clock, Estimate, Evidence, Header, Heading, Integrity, Message, Odometry, PortError, Position,
    Publisher, RelativePose, Sender, Sessions, Space, Subscriber,
};

use crate::refusal::Refusal;
use crate::section::Bounds;
use crate::watch::{Event, Moved, Said, Watch};
use crate::wheels::Wheels;

/// Names of the figures in the driver's status, in their order.
pub const FIGURES: [&str; 5] = ["slots", "skipped", "state", "distance_m", "area_m2"];

/// Its ears and its mouths.
#[derive(Debug)]
pub struct Channels {
    sensors: Sensors,
    bounds: Bounds,
    wheels: Wheels,
    odometry: Subscriber<Odometry>,
    sightings: Subscriber<RelativePose>,
    fixes: Subscriber<Position>,
    headings: Subscriber<Heading>,
    estimates: Subscriber<Estimate>,
    others: Vec<Subscriber<Evidence>>,
    evidence: Publisher<Evidence>,
    integrity: Publisher<Integrity>,
    sender: Sender,
    judge: Sender,
    clock: ClockSource,
    /// Of the four kinds of sensors, and of the team.
    hearing: Hearing<Refusal>,
}

/// Kinds of messages, for [`Hearing`].
const ODOMETRY: usize = 0;
const SIGHTINGS: usize = 1;
const FIXES: usize = 2;
const HEADINGS: usize = 3;
const TEAM: usize = 4;

impl Channels {
    /// Of the robot of a configuration.
    ///
    /// # Errors
    /// If a channel or a bus cannot be opened.
    pub fn open(space: &Space, config: &Config, bounds: &Bounds) -> Result<Self, EndError> {
        let name = &config.robot.name;
        // Stamps that go to other computers are of a clock that these have too.
        let clock = match config.clock.source {
            ClockSource::Boottime => Clock::Boottime,
            ClockSource::Realtime | ClockSource::Tai => Clock::Realtime,
        };
        let random = EndError::of("no random number");
        let sender = Sender::start(config.robot.id, clock).map_err(random)?;
        let peers: Vec<_> = config.peers().collect();
        let others: Result<_, PortError> =
            peers.iter().map(|it| space.subscriber(&it.name)).collect();
        let sources = peers.len().max(1);
        let sensors = Sessions::SENSORS;
        let speakers = [sensors, sensors, sensors, sensors, sources];
        let team = peers.iter().map(|it| it.id).chain([config.robot.id]);
        let hearing = Hearing::new(config.robot.id, team.collect(), &speakers);
        Ok(Self {
            sensors: Sensors::of(config),
            bounds: bounds.clone(),
            wheels: Wheels::open(config)?,
            odometry: space.subscriber(name)?,
            sightings: space.subscriber(name)?,
            fixes: space.subscriber(name)?,
            headings: space.subscriber(name)?,
            estimates: space.subscriber(name)?,
            others: others?,
            evidence: space.publisher(name)?,
            integrity: space.publisher(name)?,
            judge: sender.beside(),
            sender,
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

    /// Takes in all that has come.
    pub fn hear(&mut self, watch: &mut Watch, now: Moment) -> u64 {
        let mut bytes = 0;
        let ahead_ns = self.ahead_ns(now);
        self.wheels.drain(&mut |made| {
            watch.hear_moved(Moved {
                start_ns: made.start_ns.saturating_add(ahead_ns),
                end_ns: made.stamp_ns.saturating_add(ahead_ns),
                velocity: made.velocity,
            });
        });
        while let Some(message) = next(&self.odometry, &mut bytes) {
            self.hear_odometry(message, watch, now);
        }
        while let Some(message) = next(&self.headings, &mut bytes) {
            self.hear_heading(&message, watch, now);
        }
        while let Some(message) = next(&self.fixes, &mut bytes) {
            self.hear_fix(&message, watch, now);
        }
        while let Some(message) = next(&self.sightings, &mut bytes) {
            if !message.is_of_track() {
                self.hear_sighting(&message, watch, now);
            }
        }
        while let Some(message) = next(&self.estimates, &mut bytes) {
            self.hear_estimate(&message, watch, now);
        }
        for place in 0..self.others.len() {
            while let Some(message) = next(&self.others[place], &mut bytes) {
                let checked = self.hearing.check(now, |limits| message.validate(limits));
                if checked.is_some()
                    && self.hearing.accept(TEAM, &message.header, now).is_some()
                    && !watch.hear_evidence(&message)
                {
                    self.hearing.refuse(Refusal::Late);
                }
            }
        }
        bytes
    }

    fn hear_odometry(&mut self, mut message: Odometry, watch: &mut Watch, now: Moment) {
        let checked = self.hearing.check(now, |limits| message.validate(limits));
        let Some(at_ns) =
            checked.and_then(|()| self.hearing.accept(ODOMETRY, &message.header, now))
        else {
            return;
        };
        message.move_stamps(at_ns.saturating_sub(message.header.stamp_ns));
        message.header.stamp_ns = at_ns;
        let ahead_ns = self.ahead_ns(now);
        if let Some(made) = self.wheels.hear(&message) {
            watch.hear_moved(Moved {
                start_ns: made.start_ns.saturating_add(ahead_ns),
                end_ns: made.stamp_ns.saturating_add(ahead_ns),
                velocity: made.velocity,
            });
        }
    }

    fn hear_heading(&mut self, message: &Heading, watch: &mut Watch, now: Moment) {
        let checked = self.hearing.check(now, |limits| message.validate(limits));
        let Some(at_ns) =
            checked.and_then(|()| self.hearing.accept(HEADINGS, &message.header, now))
        else {
            return;
        };
        let (heading, HeadingOf::Body) = self.sensors.looking(message) else {
            return;
        };
        if self.bounds.compass_rad > 0.0 {
            self.tell(watch, at_ns, Event::Compass(heading), now);
        }
    }

    fn hear_fix(&mut self, message: &Position, watch: &mut Watch, now: Moment) {
        let checked = self.hearing.check(now, |limits| message.validate(limits));
        let Some(at_ns) = checked.and_then(|()| self.hearing.accept(FIXES, &message.header, now))
        else {
            return;
        };
        let slow = self.sensors.slow_of_fix(message).variance;
        let [xx, _, _, yy] = message.covariance;
        let half = [xx, yy].map(|it| self.bounds.half(self.bounds.fix_m, (it + slow).sqrt()));
        let area = Area {
            centre: message.position,
            half,
        };
        let lever = self.sensors.lever_of(message);
        let delay_ns = self.sensors.delay_of(message).as_nanos();
        let at_ns = at_ns.saturating_sub(delay_ns);
        self.tell(watch, at_ns, Event::Fix(area, lever), now);
    }

    fn hear_sighting(&mut self, message: &RelativePose, watch: &mut Watch, now: Moment) {
        let checked = self.hearing.check(now, |limits| message.validate(limits));
        let Some(at_ns) =
            checked.and_then(|()| self.hearing.accept(SIGHTINGS, &message.header, now))
        else {
            return;
        };
        let Some(observed) = watch.place(message.observed) else {
            return;
        };
        let [x, y, phi] = self.sensors.mount_of_relative(message.header.source);
        let [xx, .., pp] = message.covariance;
        let yy = message.covariance[4];
        let bounds = &self.bounds;
        let [dx, dy, turn] = message.pose;
        let seen = Area {
            centre: [dx, dy],
            half: [xx, yy].map(|it| bounds.half(bounds.sighting_m, it.sqrt())),
        };
        let Area { centre, half } = if phi == 0.0 {
            seen
        } else {
            seen.turned(AngleInterval::new(phi, 0.0))
        };
        let seen = Seen {
            observed,
            area: Area {
                centre: [centre[0] + x, centre[1] + y],
                half,
            },
            turn: AngleInterval::new(
                coloc_bounds::wrap(turn + phi),
                bounds.half(bounds.sighting_rad, pp.sqrt()),
            ),
        };
        self.tell(watch, at_ns, Event::Seen(seen), now);
    }

    /// It is no evidence, so it is not refused either: what is late is not judged.
    fn hear_estimate(&mut self, message: &Estimate, watch: &mut Watch, now: Moment) {
        // Whatever clock the robot speaks by, it says the same moment by this one.
        let header = Header {
            stamp_ns: message.boot_ns,
            clock: Clock::Boottime as u8,
            ..message.header
        };
        let own = Estimate { header, ..*message };
        if self
            .hearing
            .check(now, |limits| own.validate(limits))
            .is_some()
        {
            let [x, y, _] = own.pose;
            let at_ns = message.boot_ns.saturating_add(self.ahead_ns(now));
            watch.hear(at_ns, Event::Estimate([x, y]));
        }
    }

    /// An event by `CLOCK_BOOTTIME`.
    fn tell(&mut self, watch: &mut Watch, at_ns: i64, event: Event, now: Moment) {
        let at_ns = at_ns.saturating_add(self.ahead_ns(now));
        if !watch.hear(at_ns, event) {
            self.hearing.refuse(Refusal::Late);
        }
    }

    /// The time of the common clock, of which slots are cut \[ns\].
    #[must_use]
    pub fn common_ns(&self, now: Moment) -> i64 {
        now.boottime_ns.saturating_add(self.ahead_ns(now))
    }

    /// Says what is to be said.
    pub fn tell_all(&mut self, said: &[Said]) {
        for word in said {
            let (stamp_ns, sent) = match word {
                Said::Evidence(it) => {
                    let header = self.sender.header(it.header.stamp_ns);
                    let sent = self.evidence.send(Evidence { header, ..**it });
                    (it.header.stamp_ns, sent.is_ok())
                }
                Said::Integrity(it) => {
                    let header = self.judge.header(it.header.stamp_ns);
                    let sent = self.integrity.send(Integrity { header, ..**it });
                    (it.header.stamp_ns, sent.is_ok())
                }
            };
            if sent {
                self.hearing.note_said(stamp_ns);
            } else {
                self.hearing.refuse(Refusal::Channel);
            }
        }
    }

    /// For the driver's status.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // Counts.
    pub fn report(&self, watch: &Watch) -> Report {
        let (closed, skipped, last) = watch.closed();
        let mut report = self.hearing.report([
            closed as f64,
            skipped as f64,
            f64::from(last.state),
            last.distance_m,
            last.area_m2,
            f64::NAN,
            f64::NAN,
            f64::NAN,
        ]);
        report.refused[Refusal::Skipped as usize] = skipped;
        report
    }
}

/// What cannot be read is as if it had not come.
fn next<M: Message>(messages: &Subscriber<M>, bytes: &mut u64) -> Option<M> {
    let message = messages.receive().ok().flatten();
    *bytes += message.as_ref().map_or(0, |_| size_of::<M>() as u64);
    message
}
