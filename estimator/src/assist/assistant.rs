//! A robot's part in its team, beside its estimator: a leader says where it sees children, a child takes the first of what is said of
//! it and hands it on.
//!
//! [`step`] does all of a tick, as [`crate::step`] does it for a robot without a part. What a child takes goes into the history, where it
//! is a measurement as any other: the belief is a function of the set of what was taken, in whatever order it came. *That* it was taken
//! depends on what came first; so it is decided once, when it comes, and never again in a replay.
//!
//! ```text
//! measurements into the history; sightings of children to the search    acknowledgements    data    replay
//! leader: what it sees of children, from the belief after all of that stamp    child: time-outs, then what can be handed on
//! ```

use super::datum::Reading;
use super::delays::Bounds;
use super::events::{Data, Events, Now, OPEN_EVENTS, Terms, Word};
use super::full::Full;
use super::news::News;
use super::path::{LONGEST_PATH, Path};
use super::readings::{HeardReadings, Readings};
use super::refusal::Refusal;
use super::search::{Answer, Patience};
use super::sent::Sent;
use super::slot::{Slot, Slots};
use super::team::{MOST_LEADERS, NotATeam, Place, Robots, Team};
use super::ties::Said;
use super::wait::Wait;
use super::way::{said_of, way_of};
use crate::convert::GlobalPose;
use crate::estimator::Estimator;
use crate::history::Storage;
use crate::input::TickInputs;
use crate::kind::{Kind, LeaderPose, Measured, Measurement, Origin, RobotId, Sighting};
use crate::list::FixedList;
use crate::output::{Source, TickOutputs, Verdict};
use crate::settings::Settings;
use crate::stamp::{Span, Stamp};

/// So many data can one tick send, and as many acknowledgements.
const MOST_TOLD: usize = 64;

/// So many poses can wait to be fused; more are fused at once.
const MOST_HELD: usize = 64;

/// A leader that was not heard for so many events is not waited for.
const HEARD_OF_LATE: i64 = 10;

/// A child that hears nobody for so long after its start says so.
const UNHEARD: Span = Span::from_millis(10_000);

/// So many sightings can wait for their tick.
const MOST_SEEN: usize = 64;

/// What a team agrees on.
#[derive(Copy, Clone, Debug)]
pub struct Agreement {
    /// Who leads and who does not.
    pub team: Team,
    /// One event a period.
    pub period: Span,
    /// When the first one begins, by the team's clock.
    pub phase: Span,
    /// How long a search goes on \[ms\].
    pub patience: Patience,
    /// An answer is waited for as long as answers were seen to take, within these bounds \[ms\]. `None`: as `patience` says.
    pub ack_bounds: Option<Bounds>,
    /// What a child takes is fused once a pose of each leader is there that it has heard of late, or so long after the event \[ms\].
    /// `None`: at once.
    pub delay: Option<u32>,
    /// All robots tell leaders what they see; a leader works out whom it reaches so long after the event. `None`: what is taken is
    /// handed on from child to child.
    pub readings_deadline: Option<Span>,
}

/// A datum as it is on its way, by the numbers of the robots.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Message {
    /// Of which event.
    pub slot: Slot,
    /// When it holds.
    pub stamp: Stamp,
    /// Its leader, every child that it went through, and whom it is for; no more than `robots` of them.
    pub path: [RobotId; LONGEST_PATH],
    /// How many they are.
    pub robots: u8,
    /// It is not to be handed on.
    pub is_final: bool,
    /// What its leader knew of the event, where leaders know all readings; else 0.
    pub digest: u32,
    /// y*, and R* in its parts.
    pub said: GlobalPose,
    /// Of the leader.
    pub word: Word,
}

/// A datum that comes; nothing of it is believed yet.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Heard {
    /// Who sends it, and its count.
    pub origin: Origin,
    /// What it says.
    pub message: Message,
}

/// A datum that goes.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Told {
    /// To whom.
    pub to: RobotId,
    /// What it says.
    pub message: Message,
}

/// What became of a datum, for who sent it.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Ack {
    /// Who sent the datum, or who answers.
    pub robot: RobotId,
    /// Of which event.
    pub slot: Slot,
    /// When the datum holds.
    pub stamp: Stamp,
    /// Whose datum.
    pub leader: RobotId,
    /// It is used.
    pub taken: bool,
}

/// What other robots say, each in the order of senders and of their counts.
#[derive(Copy, Clone, Debug, Default)]
pub struct Words<'a> {
    /// So much is the team's clock ahead of the stamps.
    pub ahead: Span,
    /// What is said of this robot.
    pub data: &'a [Heard],
    /// What became of what it handed on.
    pub acks: &'a [Ack],
    /// What they saw of children, for a leader.
    pub readings: &'a [HeardReadings],
}

/// What is to be told.
#[derive(Copy, Clone, Debug, Default)]
pub struct Carried<'a> {
    /// Poses of children.
    pub data: &'a [Told],
    /// To children whose data came.
    pub acks: &'a [Ack],
    /// To all leaders: what this robot saw of children.
    pub readings: &'a [Readings],
}

/// What became of data, since the start.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Taken, to be fused.
    pub accepted: u64,
    /// Not taken: a datum of that leader was there already, or the event was over.
    pub declined: u64,
    /// Told to children.
    pub forwarded: u64,
    /// Sightings that count as used because no answer came.
    pub timed_out: u64,
    /// Of these, freed by a late "no".
    pub freed_late: u64,
    /// Events that were closed before their time.
    pub closed_early: u64,
    /// Data of a leader that knew something else of the event than one whose datum was taken.
    pub disagreed: u64,
    /// How many children are seen and do not answer now.
    pub mutes: u16,
    /// The first of them.
    pub mute: RobotId,
}

/// A child that is seen.
#[derive(Copy, Clone, Debug)]
struct Seen {
    child: Place,
    stamp: Stamp,
    reading: Reading,
}

/// Whom a leader has told at an event.
#[derive(Copy, Clone, Debug)]
struct Served(Slot, Robots);

/// What was taken and is not fused yet.
#[derive(Copy, Clone, Debug)]
struct Held {
    pose: LeaderPose,
    said: Said,
}

/// All that a robot remembers of its part.
#[derive(Clone, Debug)]
pub struct Assistant {
    agreement: Agreement,
    own: Place,
    ahead: Option<Span>,
    events: Events,
    served: [Served; OPEN_EVENTS],
    /// Sightings whose tick has come, and those that are ahead of it.
    due: FixedList<Seen, MOST_SEEN>,
    waiting: FixedList<Seen, MOST_SEEN>,
    data: FixedList<Told, MOST_TOLD>,
    acks: FixedList<Ack, MOST_TOLD>,
    counts: Counts,
    /// Of a leader.
    sent: Sent,
    /// How often events began to be counted anew.
    counted: u32,
    held: FixedList<Held, MOST_HELD>,
    /// When each leader was heard last.
    heard: [Option<Slot>; MOST_LEADERS],
    /// Where leaders know all readings.
    full: Option<Full>,
    /// Its first tick.
    since: Option<Stamp>,
    /// It was said that nobody was heard.
    has_missed: bool,
}

/// One tick of a robot that has a part in a team; as pure as [`crate::step`].
pub fn step<'a, S: Storage>(
    estimator: &'a mut Estimator<S>,
    assistant: &'a mut Assistant,
    inputs: &TickInputs<'_>,
    words: &Words<'_>,
) -> (TickOutputs<'a>, Carried<'a>) {
    estimator.begin(inputs.stamp);
    assistant.begin(inputs.stamp, words.ahead);
    estimator.take_in(inputs, |measurement| assistant.keeps_back(measurement));
    assistant.take_in(estimator, inputs);
    assistant.hear_all(estimator, inputs.stamp, words);
    estimator.bring_up_to_date();
    assistant.tell(estimator, inputs.stamp);
    (estimator.outputs(), assistant.carried())
}

impl Assistant {
    /// The part of the robot `own`, from `begins` on; `None` where it has none.
    ///
    /// # Errors
    /// The agreement's period is not positive.
    #[must_use]
    pub fn new(agreement: Agreement, own: RobotId) -> Option<Self> {
        Slots::new(agreement.period, agreement.phase)?;
        let own = agreement.team.place(own)?;
        Some(Self {
            agreement,
            own,
            ahead: None,
            events: Events::new(own, Slot::default()),
            served: [Served(Slot(i64::MIN), Robots::NONE); OPEN_EVENTS],
            due: FixedList::new(Seen::nobody()),
            waiting: FixedList::new(Seen::nobody()),
            data: FixedList::new(Told::default()),
            acks: FixedList::new(Ack::default()),
            counts: Counts::default(),
            sent: Sent::default(),
            counted: 0,
            held: FixedList::new(Held::nothing()),
            heard: [None; MOST_LEADERS],
            since: None,
            has_missed: false,
            full: agreement.readings_deadline.map(Full::new),
        })
    }

    /// Whether it leads.
    #[must_use]
    pub fn leads(&self) -> bool {
        self.agreement.team.leaders().contains(self.own)
    }

    /// What became of data, since the start.
    #[must_use]
    pub fn counts(&self) -> Counts {
        let (mutes, mute) = self.events.mutes(&self.agreement.team);
        Counts {
            mutes,
            mute,
            freed_late: self.events.freed_late(),
            closed_early: self.events.closed_early(),
            disagreed: self.events.disagreed(),
            ..self.counts
        }
    }

    /// What there is to say of the last tick.
    #[must_use]
    pub fn news(&self) -> &[News] {
        self.events.news()
    }

    fn carried(&self) -> Carried<'_> {
        Carried {
            data: self.data.as_slice(),
            acks: self.acks.as_slice(),
            readings: self.full.as_ref().map_or(&[], Full::said),
        }
    }

    /// A tick begins. Events before the start, or before the team's clock was set, are over.
    fn begin(&mut self, now: Stamp, ahead: Span) {
        self.data.clear();
        self.acks.clear();
        self.due.clear();
        self.events.begin();
        self.miss(now);
        if let Some(full) = &mut self.full {
            full.begin();
        }
        if self.ahead.replace(ahead) != Some(ahead)
            && let Some(slots) = self.slots()
        {
            self.events.forget(Slot(slots.of(now).0.saturating_add(1)));
            self.sent.forget();
            self.counted = self.counted.wrapping_add(1);
            self.heard = [None; MOST_LEADERS];
            if let Some(full) = &mut self.full {
                full.forget();
            }
        }
        self.wake(now);
    }

    /// A child that is not told where it is for a while after its start says so, once.
    fn miss(&mut self, now: Stamp) {
        let since = *self.since.get_or_insert(now);
        let is_unheard = !self.leads() && self.counts.accepted == 0;
        if is_unheard && !self.has_missed && now - since > UNHEARD {
            self.has_missed = true;
            self.events.say(News::Unheard);
        }
    }

    /// Sightings whose tick has come.
    fn wake(&mut self, now: Stamp) {
        if self.waiting.as_slice().is_empty() {
            return;
        }
        let waiting = self.waiting;
        self.waiting.clear();
        for seen in waiting.as_slice() {
            let _ = self.keep(*seen, now); // There is room for all that had some.
        }
    }

    fn keep(&mut self, seen: Seen, now: Stamp) -> bool {
        if seen.stamp > now {
            self.waiting.push(seen)
        } else {
            self.due.push(seen)
        }
    }

    /// By the stamps of this robot.
    fn slots(&self) -> Option<Slots> {
        let Agreement { period, phase, .. } = self.agreement;
        let ahead = self.ahead.unwrap_or(Span::ZERO);
        let phase = Span::from_nanos(phase.as_nanos().saturating_sub(ahead.as_nanos()));
        Slots::new(period, phase)
    }

    /// Now, and how it searches.
    fn terms(&self, now: Stamp, settings: &Settings) -> Option<(Terms, Now)> {
        let slots = self.slots()?;
        let patience = self.agreement.patience;
        let bounds = self.agreement.ack_bounds;
        let ack_timeout = bounds.map(|it| self.events.ack_timeout(it));
        let terms = Terms {
            team: self.agreement.team,
            slots,
            patience: Patience {
                ack_timeout: ack_timeout.unwrap_or(patience.ack_timeout),
                ..patience
            },
            is_full: self.full.is_some(),
            propagation: settings.propagation,
        };
        let now = Now {
            tick: millis(now),
            slot: slots.of(now),
        };
        Some((terms, now))
    }

    /// Whether it is not for the history: sightings of children serve the search, and no neighbour's pose goes out for them. What a
    /// child sees of leaders serves nobody; what it says to them has their own error in it.
    fn keeps_back(&self, measurement: &Measurement) -> bool {
        match measurement {
            Measurement::Sighting(it) => {
                self.is_child(it.observed) || !self.leads() && self.is_leader(it.observed)
            }
            Measurement::Neighbour(it) => self.leads() && self.is_child(it.sender()),
            Measurement::Seen(it) => self.leads() && self.is_child(it.sighting.robot),
            Measurement::Answer(it) => self.leads() && self.is_child(it.sighting.robot),
            _ => false,
        }
    }

    fn is_child(&self, robot: RobotId) -> bool {
        let team = &self.agreement.team;
        team.place(robot)
            .is_some_and(|it| team.children().contains(it))
    }

    fn is_leader(&self, robot: RobotId) -> bool {
        let team = &self.agreement.team;
        team.place(robot)
            .is_some_and(|it| team.leaders().contains(it))
    }

    /// What was kept back of the measurements.
    fn take_in<S: Storage>(&mut self, estimator: &mut Estimator<S>, inputs: &TickInputs<'_>) {
        for measurement in inputs.measurements {
            if !self.keeps_back(measurement) {
                continue;
            }
            let seen = match measurement {
                Measurement::Sighting(sighting) => self.see(estimator, sighting, inputs.stamp),
                _ => Err(Verdict::Refused(Refusal::NotForRole)),
            };
            let verdict = seen.map_or_else(|refused| refused, |()| Verdict::Heard);
            let (source, stamp) = (measurement.source(), measurement.stamp());
            estimator.outbox().report(source, stamp, verdict);
        }
    }

    fn see<S: Storage>(
        &mut self,
        estimator: &Estimator<S>,
        sighting: &Sighting,
        now: Stamp,
    ) -> Result<(), Verdict> {
        let seen = estimator.checked(sighting)?;
        let Some(child) = self.agreement.team.place(seen.observed) else {
            return Ok(());
        };
        if !self.agreement.team.children().contains(child) || child == self.own {
            return Ok(());
        }
        let reading = Reading {
            relative: seen.relative,
            covariance: seen.covariance,
        };
        let stamp = seen.stamp;
        let kept = self.keep(
            Seen {
                child,
                stamp,
                reading,
            },
            now,
        );
        kept.then_some(()).ok_or(Verdict::NoRoom)
    }

    /// What makes the edges, then acknowledgements, then data.
    fn hear_all<S: Storage>(
        &mut self,
        estimator: &mut Estimator<S>,
        now: Stamp,
        words: &Words<'_>,
    ) {
        let Some((terms, at)) = self.terms(now, estimator.settings()) else {
            return;
        };
        self.look(&terms, at);
        for heard in words.readings {
            if let Err(verdict) = self.gather(estimator, &terms, now, heard) {
                let sender = RobotId(heard.origin.source);
                report(estimator, sender, heard.readings.stamp, verdict);
            }
        }
        for ack in words.acks {
            if let Err(refusal) = self.settle(&terms, at, ack) {
                report(estimator, ack.robot, ack.stamp, Verdict::Refused(refusal));
            }
        }
        for heard in words.data {
            self.hear(estimator, &terms, at, heard);
        }
        self.fuse_what_is_due(estimator, at);
    }

    /// What makes the edges.
    fn look(&mut self, terms: &Terms, at: Now) {
        let leads = self.leads();
        for seen in self.due.as_slice() {
            let (stamp, it) = (seen.stamp, (seen.child, seen.stamp, seen.reading));
            // Of an event that is over, or one child too many, nothing comes.
            let _ = match &mut self.full {
                Some(full) => full.see(terms, it),
                None => !leads && self.events.see(terms, at, it, millis(stamp)),
            };
        }
    }

    /// What another robot saw, at a leader.
    fn gather<S: Storage>(
        &mut self,
        estimator: &Estimator<S>,
        terms: &Terms,
        now: Stamp,
        heard: &HeardReadings,
    ) -> Result<(), Verdict> {
        let refused = Verdict::Refused;
        let leads = self.leads();
        let full = self.full.as_mut().filter(|_| leads);
        let full = full.ok_or(refused(Refusal::NotForRole))?;
        let speaker = terms.team.place(RobotId(heard.origin.source));
        let speaker = speaker.ok_or(refused(Refusal::UnknownRobot))?;
        estimator.check_time(heard.readings.stamp)?;
        let is_taken = full.hear(terms, speaker, &heard.readings, now);
        self.counts.declined += u64::from(!is_taken.map_err(refused)?);
        Ok(())
    }

    /// Into the history, or to where it waits.
    fn take<S: Storage>(&mut self, estimator: &mut Estimator<S>, taken: &Held) {
        if let Some(last) = self.heard.get_mut(taken.said.place) {
            *last = (*last).max(Some(taken.said.slot));
        }
        if self.agreement.delay.is_none() || !self.held.push(*taken) {
            estimator.add_tied(&taken.pose, &taken.said);
        }
    }

    /// Of each event all poses at once.
    fn fuse_what_is_due<S: Storage>(&mut self, estimator: &mut Estimator<S>, at: Now) {
        let Some(delay) = self.agreement.delay else {
            return;
        };
        if self.held.as_slice().is_empty() {
            return;
        }
        let oldest = Slot(at.slot.0.saturating_sub(HEARD_OF_LATE));
        let most = self.heard.iter().flatten().filter(|it| **it > oldest);
        let most = most.count();
        let held = self.held;
        self.held.clear();
        for it in held.as_slice() {
            let of_event = held.as_slice().iter();
            let of_event = of_event.filter(|other| other.said.slot == it.said.slot);
            let age = at.tick.wrapping_sub(millis(it.pose.stamp));
            if Wait::of(most, delay).is_due(age, of_event.count()) {
                estimator.add_tied(&it.pose, &it.said);
            } else {
                let _ = self.held.push(*it); // There was room for it before.
            }
        }
    }

    fn settle(&mut self, terms: &Terms, at: Now, ack: &Ack) -> Result<(), Refusal> {
        let place = |robot| terms.team.place(robot);
        let child = place(ack.robot).ok_or(Refusal::UnknownRobot)?;
        let leader = place(ack.leader).ok_or(Refusal::NotALeader)?;
        if self.leads() {
            return Err(Refusal::NotForRole);
        }
        let answer = (child, leader, ack.taken);
        self.events
            .answered(terms, at, answer, ack.slot)
            .map(|_| ())
    }

    fn hear<S: Storage>(
        &mut self,
        estimator: &mut Estimator<S>,
        terms: &Terms,
        at: Now,
        heard: &Heard,
    ) {
        let sender = RobotId(heard.origin.source);
        let judged = self.judge(estimator, terms, at, heard);
        match judged {
            Ok(Answer::Accepted) => {
                self.counts.accepted += 1;
                let pose = heard.message.as_measurement();
                match self.said(terms, &heard.message) {
                    Some(said) => self.take(estimator, &Held { pose, said }),
                    None => estimator.add(&pose.into()),
                }
            }
            Ok(Answer::Repeated) => {}
            Ok(Answer::Declined | Answer::Closed) => self.counts.declined += 1,
            Err(verdict) => report(estimator, sender, heard.message.stamp, verdict),
        }
        let taken = match judged {
            Ok(answer) => answer.acknowledges(),
            // It may use its sighting for another leader.
            Err(Verdict::Refused(Refusal::Looped) | Verdict::TooOld) => false,
            Err(_) => return,
        };
        if self.is_child(sender) && !self.acks.push(heard.message.answer(sender, taken)) {
            estimator.outbox().count_overflow();
        }
    }

    /// What it says besides, for who keeps it.
    fn said(&self, terms: &Terms, message: &Message) -> Option<Said> {
        let leader = terms.team.rank(terms.team.place(message.leader())?)?;
        let leaders = terms.team.leaders().count();
        Some(Said {
            place: leader.index(),
            leaders: u8::try_from(leaders).unwrap_or(u8::MAX),
            count: self.counted,
            slot: message.slot,
            word: message.word,
        })
    }

    fn judge<S: Storage>(
        &mut self,
        estimator: &Estimator<S>,
        terms: &Terms,
        at: Now,
        heard: &Heard,
    ) -> Result<Answer, Verdict> {
        let (refused, message) = (Verdict::Refused, &heard.message);
        if self.leads() {
            return Err(refused(Refusal::NotForRole));
        }
        let sender = terms.team.place(RobotId(heard.origin.source));
        let sender = sender.ok_or(refused(Refusal::UnknownRobot))?;
        let path = Path::new(&terms.team, message.robots()).map_err(refused)?;
        estimator.check_time(message.stamp)?;
        message.as_measurement().check()?;
        let data = Data {
            slot: message.slot,
            stamp: message.stamp,
            path,
            is_final: message.is_final,
            digest: message.digest,
            said: message.said,
            word: message.word,
        };
        let began = millis(message.stamp);
        let answer = self.events.hear(terms, at, sender, &data, began);
        answer.map_err(refused)
    }

    /// What goes out.
    fn tell<S: Storage>(&mut self, estimator: &mut Estimator<S>, now: Stamp) {
        let Some((terms, at)) = self.terms(now, estimator.settings()) else {
            return;
        };
        let before = self.data.as_slice().len();
        let overflowed = if self.full.is_some() {
            self.say_all(estimator, &terms, now)
        } else if self.leads() {
            self.say_first(estimator, &terms)
        } else {
            self.hand_on(estimator, &terms, at)
        };
        let sent = self.data.as_slice().len() - before;
        self.counts.forwarded += sent as u64;
        (0..overflowed).for_each(|_| estimator.outbox().count_overflow());
    }

    /// What was seen, to leaders; a leader's data of all that it reaches. How many found no room.
    fn say_all<S: Storage>(
        &mut self,
        estimator: &Estimator<S>,
        terms: &Terms,
        now: Stamp,
    ) -> usize {
        let Some(full) = &mut self.full else {
            return 0;
        };
        full.say(terms, estimator, (self.own, &mut self.sent), now);
        let (mut overflowed, data) = (0, &mut self.data);
        full.reach(terms, estimator, self.own, now, |it| {
            overflowed += usize::from(!data.push(Told::of(&terms.team, it)));
        });
        overflowed
    }

    /// A leader's first hops; how many found no room.
    fn say_first<S: Storage>(&mut self, estimator: &Estimator<S>, terms: &Terms) -> usize {
        let mut overflowed = 0;
        let due = self.due;
        for seen in due.as_slice() {
            let slot = terms.slots.of(seen.stamp);
            let Some(sent) = self.sent.at(estimator, slot, seen.stamp) else {
                continue;
            };
            let way = if seen.stamp == sent.stamp {
                None
            } else if let Some(way) = way_of(estimator, sent.stamp, seen.stamp) {
                Some(way)
            } else {
                continue;
            };
            if !self.is_first(slot, seen.child) {
                continue;
            }
            let data = Data {
                slot,
                stamp: seen.stamp,
                path: Path::first(self.own, seen.child),
                is_final: false,
                digest: 0,
                said: said_of(&sent.belief, way.as_ref(), &seen.reading, terms.propagation),
                word: sent.word,
            };
            let told = Told::of(&terms.team, &data);
            overflowed += usize::from(!self.data.push(told));
        }
        overflowed
    }

    /// Whether the child was not seen before at this event.
    fn is_first(&mut self, slot: Slot, child: Place) -> bool {
        let place = slot.0.rem_euclid(i64::try_from(OPEN_EVENTS).unwrap_or(1));
        let place = usize::try_from(place).unwrap_or(0);
        let Some(served) = self.served.get_mut(place) else {
            return false;
        };
        if served.0 < slot {
            *served = Served(slot, Robots::NONE);
        }
        let is_first = served.0 == slot && !served.1.contains(child);
        served.1 = served.1.with(child);
        is_first
    }

    /// Time-outs, then what a child can hand on; how much found no room.
    fn hand_on<S: Storage>(&mut self, estimator: &Estimator<S>, terms: &Terms, at: Now) -> usize {
        let most = Span::from_nanos(self.agreement.period.as_nanos() / 2);
        let way = |from: Stamp, to: Stamp| {
            let is_near = to - from <= most && from - to <= most;
            is_near.then(|| way_of(estimator, from, to)).flatten()
        };
        let (mut overflowed, data) = (0, &mut self.data);
        let late = self.events.work(terms, at, way, |it| {
            overflowed += usize::from(!data.push(Told::of(&terms.team, it)));
        });
        self.counts.timed_out += late as u64;
        overflowed
    }
}

impl Message {
    /// Whom it went through.
    #[must_use]
    pub fn robots(&self) -> &[RobotId] {
        self.path
            .get(..usize::from(self.robots))
            .unwrap_or(&self.path)
    }

    /// Whose it is.
    #[must_use]
    pub fn leader(&self) -> RobotId {
        let [leader, ..] = self.path;
        leader
    }

    fn as_measurement(&self) -> LeaderPose {
        LeaderPose {
            stamp: self.stamp,
            leader: self.leader(),
            slot: self.slot,
            said: self.said,
        }
    }

    fn answer(&self, sender: RobotId, taken: bool) -> Ack {
        Ack {
            robot: sender,
            slot: self.slot,
            stamp: self.stamp,
            leader: self.leader(),
            taken,
        }
    }
}

impl Default for Message {
    fn default() -> Self {
        Self {
            slot: Slot::default(),
            stamp: Stamp::default(),
            path: [RobotId(0); LONGEST_PATH],
            robots: 0,
            is_final: false,
            digest: 0,
            said: GlobalPose::default(),
            word: Word::default(),
        }
    }
}

impl Default for Told {
    fn default() -> Self {
        Self {
            to: RobotId(0),
            message: Message::default(),
        }
    }
}

impl Told {
    fn of(team: &Team, data: &Data) -> Self {
        let mut path = [RobotId(0); LONGEST_PATH];
        for (id, place) in path.iter_mut().zip(data.path.places()) {
            *id = team.id(*place);
        }
        Self {
            to: team.id(data.path.end()),
            message: Message {
                slot: data.slot,
                stamp: data.stamp,
                path,
                robots: u8::try_from(data.path.places().len()).unwrap_or(0),
                is_final: data.is_final,
                digest: data.digest,
                said: data.said,
                word: data.word,
            },
        }
    }
}

impl Held {
    fn nothing() -> Self {
        Self {
            pose: LeaderPose {
                stamp: Stamp::default(),
                leader: RobotId(0),
                slot: Slot::default(),
                said: GlobalPose::default(),
            },
            said: Said::default(),
        }
    }
}

impl Seen {
    fn nobody() -> Self {
        Self {
            child: Place::default(),
            stamp: Stamp::default(),
            reading: Reading::default(),
        }
    }
}

impl Agreement {
    /// Of these robots, with an event each `period`.
    ///
    /// # Errors
    /// Why they are no team.
    pub fn new(
        leaders: &[RobotId],
        children: &[RobotId],
        period: Span,
        patience: Patience,
    ) -> Result<Self, NotATeam> {
        Ok(Self {
            team: Team::new(leaders, children)?,
            period,
            phase: Span::ZERO,
            patience,
            ack_bounds: None,
            delay: None,
            readings_deadline: None,
        })
    }
}

/// Ticks of a search are milliseconds, counted round.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn millis(stamp: Stamp) -> u32 {
    stamp.as_nanos().div_euclid(1_000_000) as u32
}

fn report<S: Storage>(
    estimator: &mut Estimator<S>,
    sender: RobotId,
    stamp: Stamp,
    verdict: Verdict,
) {
    let source = Source::new(Kind::Assist, sender.0);
    estimator.outbox().report(source, stamp, verdict);
}
