//! The filter behind the history: all that is specific to split covariance intersection, in five operations.
//!
//! The history knows when things happened and in which order they act; what they do to the belief is said here alone.
//! Another filter takes this one's place by offering the same: *predict* over time, *tell* a robot where it is seen,
//! *hear* what it says, *correct* by a fix, and *settle* what an exchange leaves behind.

use crate::belief::Belief;
use crate::convert::{GlobalPose, to_global};
use crate::covariance::{Covariance2, Covariance3};
use crate::fix;
use crate::fusion::fuse;
use crate::motion::{Motion, propagate};
use crate::output::Verdict;
use crate::pace::Pace;
use crate::pose::Pose;
use crate::settings::Settings;
use crate::stamp::Stamp;

/// What is carried from one measurement to the next.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Filter {
    /// As Algorithm 3 left it: its `P_i` still stands for the neighbours' poses yet to come in this event.
    belief: Belief,
    /// Poses were exchanged in this event: `P_i := 0` once no neighbour's pose can follow (Algorithm 4, line 19).
    exchanged: bool,
    /// Of the neighbours' poses up to here.
    pace: Pace,
}

/// What the gate said to a measurement.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Gate {
    accepted: bool,
    d2: f64,
}

impl Filter {
    /// Believes `belief`, and has heard nobody up to `stamp`.
    pub(crate) fn beginning(stamp: Stamp, belief: Belief) -> Self {
        Self {
            belief,
            exchanged: false,
            pace: Pace::beginning(stamp),
        }
    }

    /// `dt_s` seconds of `motion` pass.
    #[inline]
    pub(crate) fn predict(&mut self, motion: &Motion, dt_s: f64) {
        self.close();
        self.belief = propagate(&self.belief, motion, dt_s);
    }

    /// Algorithm 2: where the robot that was seen is.
    pub(crate) fn tell(&self, relative: &Pose, covariance: &Covariance3) -> GlobalPose {
        let mut told = to_global(&self.belief, relative, covariance);
        let mut belief = Belief {
            pose: told.pose,
            total: told.total,
            independent: told.independent,
        };
        belief.keep_parts();
        told.total = belief.total;
        told
    }

    /// It was told.
    #[inline]
    pub(crate) fn told(&mut self, settings: &Settings) {
        self.exchanged |= settings.fusion.reset_on_transmit;
    }

    /// Algorithm 3, and what the gate said.
    pub(crate) fn hear(
        &mut self,
        stamp: Stamp,
        received: &GlobalPose,
        settings: &Settings,
    ) -> Gate {
        self.pace = self.pace.heard(stamp);
        let fusion = fuse(&self.belief, received, &self.pace.damped(&settings.fusion));
        self.belief = fusion.belief;
        self.exchanged = true;
        Gate {
            accepted: fusion.accepted,
            d2: fusion.d2,
        }
    }

    /// A position fix, and what the gate said.
    pub(crate) fn correct(
        &mut self,
        position: [f64; 2],
        covariance: &Covariance2,
        settings: &Settings,
    ) -> Gate {
        self.close();
        let update = fix::update(&self.belief, position, covariance, settings.position_gate);
        self.belief = update.belief;
        Gate {
            accepted: update.accepted,
            d2: update.d2,
        }
    }

    /// No neighbour's pose can follow at this stamp.
    #[inline]
    fn close(&mut self) {
        if self.exchanged {
            self.belief.make_dependent();
            self.exchanged = false;
        }
    }

    /// The belief once no neighbour's pose can follow at this stamp.
    #[inline]
    pub(crate) fn settle(mut self) -> Belief {
        self.close();
        self.belief
    }
}

impl Gate {
    pub(crate) fn verdict(self) -> Verdict {
        let Self { accepted, d2 } = self;
        if accepted {
            Verdict::Accepted { d2 }
        } else {
            Verdict::Gated { d2 }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn predicted() -> Filter {
        let covariance = Covariance3::diagonal([0.01, 0.02, 0.03]).unwrap();
        Filter::beginning(
            Stamp::default(),
            Belief::independent(Pose::default(), covariance),
        )
    }

    #[test]
    fn telling_moves_the_independent_part_only_where_the_settings_say_so() {
        let after = |settings: &Settings| {
            let mut filter = predicted();
            filter.told(settings);
            filter
        };
        let told = after(&Settings::default());
        assert_eq!(
            told.belief,
            predicted().belief,
            "neighbours' poses of this event still see it"
        );
        assert_eq!(told.settle().independent, Covariance3::ZERO);
        assert_eq!(told.settle().total, predicted().belief.total);
        assert_eq!(after(&Settings::paper()).settle(), predicted().belief);
    }

    #[test]
    fn hearing_moves_the_independent_part_even_if_the_gate_refuses() {
        let improbable = GlobalPose {
            pose: Pose::new(100.0, 0.0, 0.0),
            total: Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap(),
            independent: Covariance3::ZERO,
        };
        for settings in [Settings::default(), Settings::paper()] {
            let mut heard = predicted();
            let gate = heard.hear(Stamp::default(), &improbable, &settings);
            assert!(matches!(gate.verdict(), Verdict::Gated { d2 } if d2 > 1e4));
            assert_eq!(heard.belief, predicted().belief);
            assert_eq!(heard.settle().independent, Covariance3::ZERO);
        }
    }
}
