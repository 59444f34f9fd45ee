//! Bringing the history's beliefs up to date.

use super::drive::{Drive, Leg};
use super::entry::{Checkpoint, Entry};
use super::storage::{Samples, Slots};
use super::{History, INSTANT};
use crate::assist::bond::Bonds;
use crate::assist::datum::Reading;
use crate::assist::ties::Tied;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::gyro::{Bias, Passage};
use crate::kind::{Measured, OdometrySample};
use crate::motion::{Motion, propagate};
use crate::outbox::Outbox;
use crate::pose::Pose;
use crate::settings::{OdometrySettings, Settings};
use crate::stamp::Stamp;
use crate::terms::Terms;

impl<S: Slots, G: Samples> History<S, G> {
    /// Applies, in their order, the entries up to `until` that are not up to date. What an entry has to tell the world
    /// goes to `outbox` the first time it is applied.
    pub(crate) fn replay(
        &mut self,
        until: Stamp,
        terms: &Terms<'_>,
        outbox: &mut Outbox,
        ties: &mut Tied<'_>,
    ) {
        let is_due = |entry: &Entry| entry.stamp() <= until;
        if !self.entries.get(self.evaluated).is_some_and(is_due) {
            return;
        }
        let mut at = self.checkpoint_before(self.evaluated);
        if ties.is_on() {
            let mut bonds = self.bonds_before(self.evaluated, ties);
            while self.entries.get(self.evaluated).is_some_and(is_due) {
                self.apply_next_tied((&mut at, &mut bonds), terms, outbox, ties);
            }
            return;
        }
        while self.entries.get(self.evaluated).is_some_and(is_due) {
            self.apply_next(&mut at, terms, outbox);
        }
    }

    /// Applies the first entry that is not up to date to the checkpoint before it, which becomes that after it.
    #[inline]
    fn apply_next(&mut self, at: &mut Checkpoint, terms: &Terms<'_>, outbox: &mut Outbox) {
        let Some(entry) = self.entries.get(self.evaluated) else {
            return;
        };
        self.predict(at, entry.stamp(), terms.settings);
        let world = (!entry.announced).then_some(&mut *outbox);
        let gauge = entry.measurement.apply(&mut at.filter, terms, world);
        self.settle_next(at, gauge);
    }

    fn apply_next_tied(
        &mut self,
        (at, bonds): (&mut Checkpoint, &mut Bonds),
        terms: &Terms<'_>,
        outbox: &mut Outbox,
        ties: &mut Tied<'_>,
    ) {
        let Some(entry) = self.entries.get(self.evaluated) else {
            return;
        };
        let world = (!entry.announced).then_some(&mut *outbox);
        let gauge = self.apply_tied(entry, (at, bonds), (terms, world), ties);
        self.settle_next(at, gauge);
    }

    #[inline]
    fn settle_next(&mut self, at: &mut Checkpoint, gauge: Gauge) {
        if let Some(entry) = self.entries.get_mut(self.evaluated) {
            at.samples += usize::from(entry.measurement.as_odometry().is_some());
            entry.settle(at, gauge);
        }
        self.evaluated += 1;
    }

    /// The same to the base, where not even the oldest entry is up to date.
    pub(super) fn apply_oldest(
        &mut self,
        terms: &Terms<'_>,
        outbox: &mut Outbox,
        ties: &mut Tied<'_>,
    ) {
        let mut at = self.base;
        if ties.is_on() {
            let mut bonds = self.bonds_before(0, ties);
            self.apply_next_tied((&mut at, &mut bonds), terms, outbox, ties);
        } else {
            self.apply_next(&mut at, terms, outbox);
        }
    }

    /// The belief at `stamp` as the up-to-date entries give it; the base's belief for a stamp before it.
    pub(crate) fn belief_at(&self, stamp: Stamp, settings: &Settings) -> Belief {
        self.filter_at(stamp, settings).settle(settings.propagation)
    }

    /// What drives the robot at `stamp`, that is over the instant which ends there.
    pub(crate) fn drive_at(&self, stamp: Stamp, settings: &OdometrySettings) -> Drive {
        let before = stamp - INSTANT;
        let next = self.entries.first_sample_after(before);
        self.leg(before, stamp, next, settings).drive
    }

    /// The filter at `stamp` as the up-to-date entries give it.
    pub(crate) fn filter_at(&self, stamp: Stamp, settings: &Settings) -> Filter {
        let next = self.entries.first_after(stamp).min(self.evaluated);
        let mut checkpoint = self.checkpoint_before(next);
        self.predict(&mut checkpoint, stamp, settings);
        checkpoint.filter
    }

    /// Brings a checkpoint forward to `to`.
    #[inline]
    pub(super) fn predict(&self, checkpoint: &mut Checkpoint, to: Stamp, settings: &Settings) {
        while checkpoint.stamp < to {
            let from = checkpoint.stamp;
            let mut leg = self.leg(from, to, checkpoint.samples, &settings.odometry);
            if let Some(gyro) = self.gyro(settings) {
                let passage =
                    self.turn_over(from, &mut leg, checkpoint.filter.bias.as_ref(), settings);
                checkpoint.filter.predict_turning(&passage, gyro);
            } else {
                leg.predict(&mut checkpoint.filter, from, settings);
            }
            checkpoint.stamp = leg.until;
        }
    }

    /// What drove the robot between two stamps, leg by leg, each with its length \[s\].
    pub(super) fn each_leg(
        &self,
        mut from: Stamp,
        to: Stamp,
        settings: &Settings,
        mut pass: impl FnMut(&Motion, f64),
    ) {
        let mut next = self.entries.first_sample_after(from);
        let mut bias = self.base.filter.bias;
        while from < to {
            let mut leg = self.leg(from, to, next, &settings.odometry);
            if let Some(gyro) = self.gyro(settings) {
                let passage = self.turn_over(from, &mut leg, bias.as_ref(), settings);
                if let Some(bias) = &mut bias {
                    pass(&bias.drive(&passage, gyro), passage.dt_s);
                }
            } else {
                let motion = leg.motion(from, &settings.odometry);
                pass(&motion, (leg.until - from).as_seconds());
            }
            from = leg.until;
            let has_ended = |sample: &&OdometrySample| sample.stamp <= from;
            next += self.samples_from(next).take_while(has_ended).count();
        }
    }

    /// Where the robot went from `from` to `to`, seen from where it was at `from`, with the noise of the wheels.
    pub(crate) fn way_between(&self, from: Stamp, to: Stamp, settings: &Settings) -> Reading {
        let mut moved = Belief::independent(Pose::default(), Covariance3::ZERO);
        self.each_leg(from, to, settings, |motion, dt_s| {
            moved = propagate(&moved, motion, dt_s, settings.propagation);
        });
        Reading {
            relative: moved.pose,
            covariance: moved.total(),
        }
    }

    #[inline]
    pub(super) fn checkpoint_before(&self, index: usize) -> Checkpoint {
        let entry = index
            .checked_sub(1)
            .and_then(|index| self.entries.get(index));
        let Some(entry) = entry else {
            return self.base;
        };
        let mut checkpoint = entry.after();
        if self.has_gyro() {
            checkpoint.filter.bias = Some(entry.bias());
        }
        if self.may_be_tied() {
            checkpoint.filter.bond = Some(entry.bond());
        }
        checkpoint
    }

    /// The leg of Algorithm 1 that begins at `from`; the first sample that can end after it has the number `next`.
    pub(super) fn leg(
        &self,
        from: Stamp,
        to: Stamp,
        next: usize,
        settings: &OdometrySettings,
    ) -> Leg {
        let last = self
            .last_sample_before(next)
            .filter(|sample| sample.stamp <= from);
        Leg::starting(from, to, last, self.samples_from(next), settings.hold)
    }

    /// The leg beside the gyro, which covers all of it or nothing: it is cut where that changes and, where nothing is known of the wheels,
    /// after one of the gyro's samples.
    pub(super) fn turn_over(
        &self,
        from: Stamp,
        leg: &mut Leg,
        bias: Option<&Bias>,
        settings: &Settings,
    ) -> Passage {
        let odometry = &settings.odometry;
        let Some(gyro) = settings.gyro() else {
            return leg.passage(from, None, odometry);
        };
        let apart = matches!(leg.drive, Drive::Unknown);
        let (until, mut turned) = self.turns.over(from, leg.until, apart, gyro);
        leg.until = until;
        if turned.is_some() && self.turns.is_suspect(from, gyro) {
            let expected = leg.expected(from, bias, odometry);
            turned = self.turns.over_tamed([from, until], &expected, gyro);
        }
        leg.passage(from, turned, odometry)
    }
}
