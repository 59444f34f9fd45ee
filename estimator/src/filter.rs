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
use crate::stamp::{Span, Stamp};

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

    /// After `dt_s` seconds of `motion`.
    #[inline]
    pub(crate) fn predict(self, motion: &Motion, dt_s: f64) -> Self {
        Self {
            belief: propagate(&self.settle(), motion, dt_s),
            exchanged: false,
            ..self
        }
    }

    /// Algorithm 2: where the robot that was seen is.
    pub(crate) fn tell(&self, relative: &Pose, covariance: &Covariance3) -> GlobalPose {
        let told = to_global(&self.belief, relative, covariance);
        let kept = Belief {
            pose: told.pose,
            total: told.total,
            independent: told.independent,
        }
        .with_parts_kept();
        GlobalPose {
            total: kept.total,
            ..told
        }
    }

    /// After it was told.
    pub(crate) fn told(self, settings: &Settings) -> Self {
        Self {
            exchanged: self.exchanged || settings.fusion.reset_on_transmit,
            ..self
        }
    }

    /// Algorithm 3, and what the gate said.
    pub(crate) fn hear(
        self,
        stamp: Stamp,
        received: &GlobalPose,
        settings: &Settings,
    ) -> (Self, Gate) {
        let pace = self.pace.heard(stamp);
        let fusion = fuse(&self.belief, received, &pace.damped(&settings.fusion));
        let after = Self {
            belief: fusion.belief,
            exchanged: true,
            pace,
        };
        let gate = Gate {
            accepted: fusion.accepted,
            d2: fusion.d2,
        };
        (after, gate)
    }

    /// A position fix, and what the gate said.
    pub(crate) fn correct(
        self,
        position: [f64; 2],
        covariance: &Covariance2,
        settings: &Settings,
    ) -> (Self, Gate) {
        let update = fix::update(&self.settle(), position, covariance, settings.position_gate);
        let after = Self {
            belief: update.belief,
            exchanged: false,
            ..self
        };
        let gate = Gate {
            accepted: update.accepted,
            d2: update.d2,
        };
        (after, gate)
    }

    /// The belief once no neighbour's pose can follow at this stamp.
    #[inline]
    pub(crate) fn settle(&self) -> Belief {
        let mut belief = self.belief;
        if self.exchanged {
            belief.make_dependent();
        }
        belief
    }

    /// The same on a clock that is `shift` ahead, with nothing of an event left open.
    pub(crate) fn shifted(&self, shift: Span) -> Self {
        Self {
            belief: self.settle(),
            exchanged: false,
            pace: self.pace.shifted(shift),
        }
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
        let told = predicted().told(&Settings::default());
        assert_eq!(
            told.belief,
            predicted().belief,
            "neighbours' poses of this event still see it"
        );
        assert_eq!(told.settle().independent, Covariance3::ZERO);
        assert_eq!(told.settle().total, predicted().belief.total);
        assert_eq!(
            predicted().told(&Settings::paper()).settle(),
            predicted().belief
        );
    }

    #[test]
    fn hearing_moves_the_independent_part_even_if_the_gate_refuses() {
        let improbable = GlobalPose {
            pose: Pose::new(100.0, 0.0, 0.0),
            total: Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap(),
            independent: Covariance3::ZERO,
        };
        for settings in [Settings::default(), Settings::paper()] {
            let (heard, gate) = predicted().hear(Stamp::default(), &improbable, &settings);
            assert!(matches!(gate.verdict(), Verdict::Gated { d2 } if d2 > 1e4));
            assert_eq!(heard.belief, predicted().belief);
            assert_eq!(heard.settle().independent, Covariance3::ZERO);
        }
    }
}
