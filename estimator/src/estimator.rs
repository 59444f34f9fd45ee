//! The pure step: `step(&mut Estimator, &TickInputs) -> TickOutputs`.

use nalgebra::Matrix3;

use crate::assist::change::left;
use crate::assist::datum::Reading;
use crate::assist::ties::{Said, Ties};
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::filter::Filter;
use crate::found::{Finding, Found, Start};
use crate::history::{Court, Drive, History, Storage};
use crate::input::TickInputs;
use crate::kind::{Answer, Deed, Key, LeaderPose, Measured, Measurement, RoundWord, SeenPart};
use crate::outbox::Outbox;
use crate::output::{Estimate, OdometryState, TickOutputs, Verdict};
use crate::rounds::{
    AtSlot, Correction, Given, Giving, Late, MOST_LATE, Of, Refusal, Shared, Sharing, Standing,
    gate,
};
use crate::settings::{Floors, Settings};
use crate::stamp::Stamp;
use crate::terms::Terms;

/// One robot's estimator. `S` is the history's storage: an array, a `Vec` or a borrowed slice of [`Slot`](crate::Slot)s, with a gyro
/// a [`WithGyro`](crate::WithGyro); it is filled once at start and never grows. It should hold what is measured within [`Settings::history`]: a second at
/// 50 Hz of odometry, 10 Hz of fixes and 10 Hz of exchange with four robots is 140; 512 leave room for bursts.
/// A slot takes about 700 bytes.
#[derive(Clone, Debug)]
pub struct Estimator<S: Storage> {
    settings: Settings,
    history: History<S::Slots, S::Samples>,
    found: Found,
    ties: Ties<S::Ties, S::Changes>,
    /// The latest tick's stamp.
    now: Stamp,
    /// To the team's rounds.
    giving: Giving,
    /// The slot that begins in this tick, and when.
    slot: Option<(u64, Stamp)>,
    shared: Option<AtSlot>,
    outbox: Outbox,
}

impl<S: Storage> Estimator<S> {
    /// An estimator that believes `initial` at `stamp`. Measurements must be later than `stamp`.
    #[must_use]
    pub fn new(settings: Settings, stamp: Stamp, initial: Belief, storage: S) -> Self {
        Self::starting(settings, stamp, &Start::Known(initial), storage)
    }

    /// An estimator that knows no more than `start` says at `stamp`. Where `settings` have a gyro and `storage` has no room for its
    /// samples, each of them is answered with [`Verdict::NoRoom`].
    #[must_use]
    pub fn starting(settings: Settings, stamp: Stamp, start: &Start, storage: S) -> Self {
        let filter = Filter::starting(stamp, start)
            .with_gyro(settings.gyro())
            .with_bond(settings.rounds().is_some());
        let places = storage.split();
        // A belief of before may have learnt from leaders.
        let is_own = start.belief().parts.dependent == Covariance3::ZERO;
        Self {
            settings,
            history: History::new(stamp, &filter, (places.slots, places.samples)),
            found: Found::new(stamp, start),
            ties: Ties::new(places.ties, places.changes, is_own),
            now: stamp,
            giving: Giving::new(),
            slot: None,
            shared: None,
            outbox: Outbox::new(),
        }
    }

    /// How the estimator behaves.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The belief at any stamp from the history's beginning to the latest tick; `None` outside.
    #[must_use]
    pub fn belief_at(&self, stamp: Stamp) -> Option<Belief> {
        let known = self.history.begins() <= stamp && stamp <= self.now;
        known.then(|| self.history.belief_at(stamp, &self.settings))
    }

    /// Where the robot is believed to be at `stamp`, by what the last [`step`] knew.
    #[must_use]
    pub fn extrapolated(&self, stamp: Stamp) -> Estimate {
        let drive = self.history.drive_at(stamp, &self.settings.odometry);
        let filter = self.history.filter_at(stamp, &self.settings);
        let (velocity, velocity_covariance) = self.velocity(stamp, &drive, &filter);
        Estimate {
            stamp,
            driven: filter.driven(),
            belief: self.covered(&filter.settle(self.settings.propagation), stamp),
            velocity,
            velocity_covariance,
            odometry: drive.state(),
            gyro: filter.gyro(),
        }
    }

    /// Of the wheels, its turn fused with the gyro's.
    fn velocity(&self, stamp: Stamp, drive: &Drive, filter: &Filter) -> ([f64; 3], Covariance3) {
        let settings = &self.settings.odometry;
        let of_wheels = (drive.velocity(), drive.covariance(stamp, settings));
        let Some(bias) = &filter.bias else {
            return of_wheels;
        };
        let Some(latest) = self.history.turning(stamp, &self.settings) else {
            return of_wheels;
        };
        let period_s = settings.reference_period.as_seconds();
        let is_known = drive.state() != OdometryState::Stale;
        bias.turning(&of_wheels, latest, period_s, is_known)
    }

    /// The belief, or what holds it and all that stands against it.
    fn covered(&self, belief: &Belief, stamp: Stamp) -> Belief {
        if self.found.is_ok() {
            return *belief;
        }
        let way = self.history.way_to(stamp, &self.settings);
        self.found.cover(belief, &way, &self.settings)
    }

    /// Whether it is known where the robot is, by what the last [`step`] knew.
    #[must_use]
    pub fn finding(&self) -> &Finding {
        self.found.finding()
    }

    /// A tick begins.
    pub(crate) fn begin(&mut self, stamp: Stamp) {
        self.outbox.clear();
        self.found.begin_tick();
        (self.slot, self.shared) = (None, None);
        self.now = stamp;
    }

    /// Puts every measurement in its place but those that somebody `keeps_back`.
    pub(crate) fn take_in(
        &mut self,
        inputs: &TickInputs<'_>,
        keeps_back: impl Fn(&Measurement) -> bool,
    ) {
        let has_floors = self.settings.floors != Floors::default();
        // What drives first: should the storage run full, what is folded early has been driven by it. Answers last: what they answer
        // has to be there.
        let mut answers = 0;
        for drives in [true, false] {
            for measurement in inputs.measurements {
                if measurement.drives() != drives || keeps_back(measurement) {
                    continue;
                }
                if matches!(measurement, Measurement::Answer(_)) {
                    answers += 1;
                } else {
                    self.admit(measurement, has_floors);
                }
            }
        }
        if answers > 0 {
            let answers = inputs.measurements.iter();
            answers
                .filter(|it| matches!(it, Measurement::Answer(_)) && !keeps_back(it))
                .for_each(|it| self.admit(it, has_floors));
        }
    }

    fn admit(&mut self, measurement: &Measurement, has_floors: bool) {
        if let Err(verdict) = self.try_admit(measurement, has_floors) {
            self.outbox
                .report(measurement.source(), measurement.stamp(), verdict);
        }
    }

    /// Takes in what somebody has made of what came.
    pub(crate) fn add(&mut self, measurement: &Measurement) {
        self.admit(measurement, self.settings.floors != Floors::default());
    }

    /// The same of what a leader says, with what it says besides. What finds no place there is fused as of a leader of which nothing is
    /// known.
    pub(crate) fn add_tied(&mut self, pose: &LeaderPose, said: &Said) {
        let key = pose.key();
        let is_kept = self.ties.is_on() && self.ties.tied().keep(key, said);
        self.add(&Measurement::Assist(*pose));
        if is_kept && self.history.measurement(&key).is_none() {
            self.ties.tied().drop(&key);
        }
    }

    /// A measurement that was kept back, as it would be taken in.
    pub(crate) fn checked<M: Measured>(&self, measurement: &M) -> Result<M, Verdict> {
        self.check_time(measurement.key().stamp)?;
        measurement.check()?;
        Ok(measurement.with_floor(&self.settings.floors))
    }

    pub(crate) fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    /// The belief after all of `stamp`, which is in the history; `None` where it is not known where the robot is.
    pub(crate) fn known_at(&self, stamp: Stamp) -> Option<Belief> {
        self.belief_at(stamp).filter(|_| self.found.is_ok())
    }

    /// The robot's own way between two stamps of the history, by its odometry.
    pub(crate) fn way(&self, from: Stamp, to: Stamp) -> Option<Reading> {
        let known = self.history.begins() <= from && to <= self.now && from <= to;
        known.then(|| self.history.way_between(from, to, &self.settings))
    }

    /// What the robot's error at `from`, with which it had the covariance `sent`, has become at `to`; both are in the history.
    pub(crate) fn error_since(&self, from: Stamp, sent: &Covariance3, to: Stamp) -> Since {
        if !self.ties.is_on() || self.ties.broken() > from {
            return Since::Broken;
        }
        if from < self.history.begins() {
            let window = [self.history.begins(), to];
            return if self.history.is_unbroken(window, &self.ties) {
                Since::Forgotten
            } else {
                Since::Broken
            };
        }
        let now = self.history.belief_at(from, &self.settings).total();
        let by = self
            .history
            .transition([from, to], &self.settings, &self.ties);
        let Some(by) = by else {
            return Since::Broken;
        };
        if now == *sent {
            return Since::Known(by);
        }
        // What came later and is no news of others has made the error smaller: of the one that was sent so much is left in it.
        let earlier = [self.history.begins(), from];
        if !sent.contains(&now) || !self.history.is_unbroken(earlier, &self.ties) {
            return Since::Broken;
        }
        Since::Known(by * left(sent, &now))
    }

    /// How often the belief was replaced by another one.
    pub(crate) fn rulings(&self) -> u32 {
        self.ties.rulings()
    }

    fn try_admit(&mut self, measurement: &Measurement, has_floors: bool) -> Result<(), Verdict> {
        let key = measurement.key();
        self.check_time(key.stamp)?;
        measurement.check()?;
        if let Measurement::Gyro(sample) = measurement {
            return self.history.turn(sample, &self.settings);
        }
        if has_floors {
            self.take_with(key, &measurement.with_floor(&self.settings.floors))
        } else {
            self.take_with(key, measurement)
        }
    }

    /// With what belongs to it.
    fn take_with(&mut self, key: Key, measurement: &Measurement) -> Result<(), Verdict> {
        match measurement {
            Measurement::Seen(seen) => self.take_seen(key, seen),
            Measurement::Answer(answer) => self.take_answer(key, answer),
            Measurement::Round(word) => self.take_round(key, word),
            _ => self.take(key, measurement),
        }
    }

    /// Where it was told to be, and the question where it believes to be.
    #[inline(never)]
    fn take_seen(&mut self, key: Key, seen: &SeenPart) -> Result<(), Verdict> {
        self.take(key, &Measurement::Seen(*seen))?;
        if let Some(ask) = seen.asks() {
            let ask = Measurement::Ask(ask);
            if self.take(ask.key(), &ask).is_err() {
                self.outbox.count_overflow();
            }
        }
        Ok(())
    }

    /// An answer takes what it answers from the history.
    #[inline(never)]
    fn take_answer(&mut self, key: Key, answer: &Answer) -> Result<(), Verdict> {
        let asked = self.history.measurement(&answer.asked());
        let Some(Measurement::Partial(sighting)) = asked else {
            return Err(Verdict::NotAsked);
        };
        let answer = Answer {
            reading: Some(sighting.reading),
            ..*answer
        };
        self.take(key, &Measurement::Answer(answer))
    }

    /// What the robot's own process says that makes rounds.
    #[inline(never)]
    fn take_round(&mut self, key: Key, word: &RoundWord) -> Result<(), Verdict> {
        if self.settings.rounds().is_none() {
            return Err(Verdict::NotFollowed(Refusal::TookNoPart));
        }
        match word.deed {
            Deed::Correct { slot, .. } => self.take_correction(slot, word)?,
            Deed::Undo(last) => self.undo(last)?,
            Deed::Share(slot) => {
                self.slot = Some((slot, word.stamp));
                return Ok(());
            }
            Deed::Join | Deed::Leave => self.take(key, &Measurement::Round(*word))?,
        }
        self.outbox
            .report(word.source(), word.stamp, Verdict::Heard);
        Ok(())
    }

    /// Decided once: of what was shared at that slot, and by what is shared now.
    fn take_correction(&mut self, slot: u64, word: &RoundWord) -> Result<(), Verdict> {
        let foreign = Verdict::NotFollowed(Refusal::TookNoPart);
        let (given, told) = (self.giving.at(slot), word.deed.correction());
        let (Some(given), Some(told), Some(rounds)) =
            (given.copied(), told, self.settings.rounds())
        else {
            return Err(foreign);
        };
        let now = self.history.filter_at(self.now, &self.settings);
        if now.bond.is_none_or(|bond| bond.knot() != given.knot) {
            return Err(foreign);
        }
        gate::check(&given.shared, &told, rounds.robots, rounds.gate)
            .map_err(Verdict::NotFollowed)?;
        let late = self.late(&given, &told, &now)?;
        let word = RoundWord {
            stamp: late.map_or(given.stamp, |_| self.now),
            of: Some(Of::new(given.knot, late.is_some())),
            ..*word
        };
        if let Some(late) = late {
            self.giving.keep(slot, late);
        }
        self.take(word.key(), &Measurement::Round(word))
    }

    /// How it acts on the belief `now`, where its slot has left the history.
    fn late(
        &self,
        given: &Given,
        told: &Correction,
        now: &Filter,
    ) -> Result<Option<Late>, Verdict> {
        match self.check_time(given.stamp) {
            Err(Verdict::TooOld) if given.stamp >= self.now - MOST_LATE => {}
            checked => return checked.map(|()| None),
        }
        let late = Late::new(&given.shared, told).ok_or(Verdict::TooOld)?;
        let corrected = now.corrected_late(&late);
        let no_belief = Verdict::NotFollowed(Refusal::NotABelief);
        corrected.map(|_| Some(late)).ok_or(no_belief)
    }

    /// The team went on without them; nothing has changed where that cannot be.
    fn undo(&mut self, last: Option<u64>) -> Result<(), Verdict> {
        let standing_before =
            |word: &RoundWord| Some(self.giving.at(word.corrects()?)?.shared.standing);
        let first = self.history.correction_after(last);
        let place = first.and_then(|(place, word)| {
            let is_on_the_way = match (standing_before(&word)?, last) {
                (Standing::Since(slot), Some(last)) => slot <= last,
                (Standing::Since(_), None) => false,
                (Standing::Joining(from), last) => last.is_none_or(|last| last < from),
            };
            is_on_the_way.then_some(place)
        });
        let place = place.ok_or(Verdict::NotFollowed(Refusal::TookNoPart))?;
        self.history.undo_from(place, last);
        Ok(())
    }

    #[inline(never)]
    fn begin_slot(&mut self, slot: u64, stamp: Stamp) {
        let is_tied = |bond: crate::rounds::Bond| !bond.is_apart();
        let now = self.history.filter_at(self.now, &self.settings);
        let sharing = match self.share(slot, stamp) {
            Some(shared) => Sharing::Belief(shared),
            None if now.bond.is_some_and(is_tied) => Sharing::Nowhere,
            None => Sharing::Apart,
        };
        self.shared = Some(AtSlot {
            slot,
            stamp,
            sharing,
        });
    }

    /// What is shared of the belief at `stamp`, which is in the history and where the slot begins; `None` where the robot takes no part in
    /// rounds, does not know where it is, or has shared at a later slot.
    pub fn share(&mut self, slot: u64, stamp: Stamp) -> Option<Shared> {
        let is_known = self.history.begins() <= stamp && stamp <= self.now && self.found.is_ok();
        if !is_known {
            return None;
        }
        let filter = self.history.filter_at(stamp, &self.settings);
        let bond = filter.bond?;
        let belief = filter.settle(self.settings.propagation);
        self.giving.share(slot, stamp, &bond, &belief)
    }

    fn take(&mut self, key: Key, measurement: &Measurement) -> Result<(), Verdict> {
        let mut place = self.history.place_of(&key).ok_or(Verdict::Duplicate)?;
        if self.history.is_full() {
            self.make_room(key.stamp)?;
            place = self.history.place_of(&key).ok_or(Verdict::Duplicate)?;
        }
        let inserted = self.history.insert(place, key, measurement);
        inserted.then_some(()).ok_or(Verdict::NoRoom)
    }

    pub(crate) fn check_time(&self, stamp: Stamp) -> Result<(), Verdict> {
        if stamp > self.now + self.settings.future_tolerance {
            return Err(Verdict::FromFuture);
        }
        if stamp < self.now - self.settings.history || stamp <= self.history.begins() {
            return Err(Verdict::TooOld);
        }
        Ok(())
    }

    fn make_room(&mut self, newcomer: Stamp) -> Result<(), Verdict> {
        let mut court = Court {
            found: &mut self.found,
            settings: &self.settings,
            outbox: &mut self.outbox,
            ties: self.ties.tied(),
            lates: self.giving.lates(),
        };
        let made = self.history.make_room(newcomer, self.now, &mut court);
        made.then_some(()).ok_or(Verdict::NoRoom)
    }

    pub(crate) fn bring_up_to_date(&mut self) {
        let horizon = self.now - self.settings.history;
        let mut court = Court {
            found: &mut self.found,
            settings: &self.settings,
            outbox: &mut self.outbox,
            ties: self.ties.tied(),
            lates: self.giving.lates(),
        };
        self.history.fold_before(horizon, &mut court);
        self.found.conclude(horizon, self.history.base_belief());
        let (suspended, tells) = (self.found.suspended(), self.found.is_ok());
        let terms = Terms::new(&self.settings, suspended, tells, self.giving.lates());
        self.history
            .replay(self.now, &terms, &mut self.outbox, &mut self.ties.tied());
        if !self.found.is_ok() {
            self.history.keep_ways(self.now, &self.settings);
        }
        if let Some((slot, stamp)) = self.slot {
            self.begin_slot(slot, stamp);
        }
    }

    /// What comes of the tick.
    pub(crate) fn outputs(&self) -> TickOutputs<'_> {
        TickOutputs {
            estimate: self.extrapolated(self.now),
            finding: self.found.finding(),
            outgoing: self.outbox.outgoing(),
            seen: self.outbox.seen(),
            answers: self.outbox.answers(),
            shared: self.shared,
            reports: self.outbox.reports(),
            overflowed: self.outbox.overflowed(),
            folded_early: self.outbox.folded_early(),
        }
    }
}

/// What became of an error.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) enum Since {
    /// Φ
    Known(Matrix3<f64>),
    /// It is older than the history.
    Forgotten,
    /// Nobody can say.
    Broken,
}

/// One tick: put every measurement in its place, re-apply what comes after it, say where the robot is at `inputs.stamp`.
///
/// Pure: the outputs and the new state depend on the old state and the inputs alone. Measurements stamped after the
/// tick, within the tolerance, wait for theirs. A tick may repeat the last one's stamp, to add measurements to it.
///
/// A tick whose stamp goes back answers with the belief then, or, before the history's beginning, with the belief at
/// the beginning; time never runs backwards. One far ahead extrapolates in a few legs however far it is; that
/// extrapolation is not kept, so that a single wrong stamp does no lasting harm.
pub fn step<'a, S: Storage>(
    estimator: &'a mut Estimator<S>,
    inputs: &TickInputs<'_>,
) -> TickOutputs<'a> {
    estimator.begin(inputs.stamp);
    estimator.take_in(inputs, |_| false);
    estimator.bring_up_to_date();
    estimator.outputs()
}
