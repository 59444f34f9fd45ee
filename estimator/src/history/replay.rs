//! Bringing the history's beliefs up to date.

use super::drive::{Drive, Leg};
use super::entry::{Checkpoint, Measurement};
use super::{History, Slot};
use crate::belief::Belief;
use crate::convert::{GlobalPose, to_global};
use crate::fix;
use crate::fusion::fuse;
use crate::input::{NeighbourPose, PositionFix, Sighting};
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::pace::Pace;
use crate::settings::{OdometrySettings, Settings};
use crate::stamp::{Span, Stamp};

/// The shortest time there is.
const INSTANT: Span = Span::from_nanos(1);

impl<S: AsRef<[Slot]> + AsMut<[Slot]>> History<S> {
    /// Applies, in their order, the entries up to `until` that are not up to date. What an entry has to tell the world
    /// goes to `outbox` the first time it is applied.
    pub(crate) fn replay(&mut self, until: Stamp, settings: &Settings, outbox: &mut Outbox) {
        while let Some(entry) = self
            .entries
            .get(self.evaluated)
            .filter(|entry| entry.stamp() <= until)
        {
            let predicted = self.predict(self.evaluated, entry.stamp(), &settings.odometry);
            let first_time = (!entry.announced).then_some(&mut *outbox);
            let after = predicted.apply(&entry.measurement, settings, first_time);
            if let Some(entry) = self.entries.get_mut(self.evaluated) {
                entry.after = after;
                entry.announced = true;
            }
            self.evaluated += 1;
        }
    }

    /// The belief at `stamp` as the up-to-date entries give it; the base's belief for a stamp before it.
    pub(crate) fn belief_at(&self, stamp: Stamp, settings: &OdometrySettings) -> Belief {
        let next = self.first_after(stamp).min(self.evaluated);
        self.predict(next, stamp, settings).settled()
    }

    /// What drives the robot at `stamp`, that is over the instant which ends there.
    pub(crate) fn drive_at(&self, stamp: Stamp, settings: &OdometrySettings) -> Drive {
        let before = stamp - INSTANT;
        self.leg(before, stamp, self.first_after(before), settings)
            .drive
    }

    /// The belief at `stamp` on the way from the entry before `index` to the one at `index`.
    fn predict(&self, index: usize, stamp: Stamp, settings: &OdometrySettings) -> Checkpoint {
        let last = self.checkpoint_before(index);
        if stamp <= last.stamp {
            return last;
        }
        Checkpoint {
            stamp,
            belief: self.propagate(last.settled(), last.stamp, stamp, index, settings),
            exchanged: false,
            ..last
        }
    }

    /// The pace of the neighbours' poses at `stamp` as the up-to-date entries give it.
    pub(crate) fn pace_at(&self, stamp: Stamp) -> Pace {
        let next = self.first_after(stamp).min(self.evaluated);
        self.checkpoint_before(next).pace
    }

    fn checkpoint_before(&self, index: usize) -> Checkpoint {
        let entry = index
            .checked_sub(1)
            .and_then(|index| self.entries.get(index));
        entry.map_or(self.base, |entry| entry.after)
    }

    /// Algorithm 1 over (`from`, `to`], leg by leg; the first entry after `from` is at `next`.
    fn propagate(
        &self,
        mut belief: Belief,
        mut from: Stamp,
        to: Stamp,
        next: usize,
        settings: &OdometrySettings,
    ) -> Belief {
        while from < to {
            let leg = self.leg(from, to, next, settings);
            belief = leg.propagate(&belief, from, settings);
            from = leg.until;
        }
        belief
    }

    fn leg(&self, from: Stamp, to: Stamp, next: usize, settings: &OdometrySettings) -> Leg {
        let last = self
            .last_sample_before(next)
            .filter(|sample| sample.stamp <= from);
        Leg::starting(from, to, last, self.samples_from(next), settings.hold)
    }
}

impl Checkpoint {
    /// The belief after `measurement`, given the one before it at the same stamp; tells `outbox`, if given.
    fn apply(
        self,
        measurement: &Measurement,
        settings: &Settings,
        outbox: Option<&mut Outbox>,
    ) -> Self {
        match measurement {
            Measurement::Odometry(_) => self, // It has driven the prediction.
            Measurement::Sighting(sighting) => self.tell(sighting, settings, outbox),
            Measurement::Neighbour(neighbour) => self.hear(neighbour, settings, outbox),
            Measurement::Fix(fix) => self.correct(fix, settings, outbox),
        }
    }

    /// Algorithm 2. The belief is still the predicted one: sightings come before all that changes it.
    fn tell(self, sighting: &Sighting, settings: &Settings, outbox: Option<&mut Outbox>) -> Self {
        if let Some(outbox) = outbox {
            outbox.send(
                sighting,
                &to_global(&self.belief, &sighting.relative, &sighting.covariance),
            );
        }
        Self {
            exchanged: self.exchanged || settings.fusion.reset_on_transmit,
            ..self
        }
    }

    /// Algorithm 3.
    fn hear(
        self,
        neighbour: &NeighbourPose,
        settings: &Settings,
        outbox: Option<&mut Outbox>,
    ) -> Self {
        let received = GlobalPose {
            pose: neighbour.pose,
            total: neighbour.total,
            independent: neighbour.independent,
        };
        let pace = self.pace.heard(self.stamp);
        let fusion = fuse(&self.belief, &received, &pace.damped(&settings.fusion));
        if let Some(outbox) = outbox {
            let source = Source::Neighbour(neighbour.sender);
            outbox.report(source, self.stamp, verdict(fusion.accepted, fusion.d2));
        }
        Self {
            belief: fusion.belief,
            exchanged: true,
            pace,
            ..self
        }
    }

    /// The position fix, after the exchange is over.
    fn correct(self, fix: &PositionFix, settings: &Settings, outbox: Option<&mut Outbox>) -> Self {
        let update = fix::update(
            &self.settled(),
            fix.position,
            &fix.covariance,
            settings.position_gate,
        );
        if let Some(outbox) = outbox {
            outbox.report(Source::Fix, self.stamp, verdict(update.accepted, update.d2));
        }
        Self {
            belief: update.belief,
            exchanged: false,
            ..self
        }
    }
}

fn verdict(accepted: bool, d2: f64) -> Verdict {
    if accepted {
        Verdict::Accepted { d2 }
    } else {
        Verdict::Gated { d2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance3;
    use crate::input::RobotId;
    use crate::pose::Pose;

    fn predicted() -> Checkpoint {
        let covariance = Covariance3::diagonal([0.01, 0.02, 0.03]).unwrap();
        Checkpoint {
            belief: Belief::independent(Pose::default(), covariance),
            ..Checkpoint::default()
        }
    }

    fn seen() -> Measurement {
        Measurement::Sighting(Sighting {
            stamp: Stamp::default(),
            sequence: 0,
            observed: RobotId(2),
            relative: Pose::new(1.0, 0.0, 0.0),
            covariance: Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap(),
        })
    }

    /// So improbable that the gate refuses it.
    fn heard() -> Measurement {
        Measurement::Neighbour(NeighbourPose {
            stamp: Stamp::default(),
            sequence: 0,
            sender: RobotId(2),
            pose: Pose::new(100.0, 0.0, 0.0),
            total: Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap(),
            independent: Covariance3::ZERO,
        })
    }

    #[test]
    fn telling_moves_the_independent_part_only_where_the_settings_say_so() {
        let told = predicted().apply(&seen(), &Settings::default(), None);
        assert_eq!(
            told.belief,
            predicted().belief,
            "neighbours' poses of this event still see it"
        );
        assert_eq!(told.settled().independent, Covariance3::ZERO);
        assert_eq!(told.settled().total, predicted().belief.total);
        assert_eq!(
            predicted()
                .apply(&seen(), &Settings::paper(), None)
                .settled(),
            predicted().belief
        );
    }

    #[test]
    fn hearing_moves_the_independent_part_even_if_the_gate_refuses() {
        for settings in [Settings::default(), Settings::paper()] {
            let heard = predicted().apply(&heard(), &settings, None);
            assert_eq!(heard.belief, predicted().belief);
            assert_eq!(heard.settled().independent, Covariance3::ZERO);
        }
    }
}
