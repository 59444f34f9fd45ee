//! The filter behind the history: all that is specific to split covariance intersection, in five operations.
//!
//! The history knows when things happened and in which order they act; what they do to the belief is said here alone.
//! Another filter takes this one's place by offering the same: *predict* over time, *tell* a robot where it is seen,
//! *hear* what it says, *correct* by a fix, and *settle* what an exchange leaves behind.

use crate::belief::Belief;
use crate::convert::{GlobalPose, tell};
use crate::covariance::{Covariance2, Covariance3};
use crate::fix;
use crate::fusion::fuse;
use crate::motion::{Motion, drive, propagate};
use crate::output::Verdict;
use crate::pace::Pace;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::settings::{Propagation, Settings};
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
    /// Where the wheels alone have taken the robot since its start: no measurement moves it.
    driven: Pose,
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
            driven: Pose::default(),
            pace: if belief.parts.dependent == Covariance3::ZERO {
                Pace::beginning(stamp)
            } else {
                Pace::beginning(stamp).met()
            },
        }
    }

    /// `dt_s` seconds of `motion` pass.
    #[inline]
    pub(crate) fn predict(&mut self, motion: &Motion, dt_s: f64, propagation: Propagation) {
        self.close();
        self.belief = propagate(&self.belief, motion, dt_s, propagation);
        self.driven = drive(self.driven, motion, dt_s);
    }

    /// Where the wheels alone have taken the robot since its start.
    #[inline]
    pub(crate) fn driven(&self) -> Pose {
        self.driven
    }

    /// Algorithm 2: where the robot that was seen is.
    pub(crate) fn tell(
        &self,
        relative: &Pose,
        covariance: &Covariance3,
        settings: &Settings,
    ) -> GlobalPose {
        let told = tell(&self.belief, relative, covariance, settings);
        GlobalPose {
            parts: kept(&told.parts, settings.propagation),
            ..told
        }
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
            self.pace = self.pace.met();
        }
    }

    /// The belief once no neighbour's pose can follow at this stamp.
    #[inline]
    pub(crate) fn settle(mut self, propagation: Propagation) -> Belief {
        self.close();
        self.belief.parts = kept(&self.belief.parts, propagation);
        self.belief
    }
}

/// Only the paper's difference can lose its sign.
#[inline]
fn kept(parts: &Parts, propagation: Propagation) -> Parts {
    match propagation {
        Propagation::Honest => *parts,
        Propagation::Paper => parts.with_its_sign(),
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
        let settle = |filter: Filter| filter.settle(Propagation::Honest);
        let told = after(&Settings::default());
        assert_eq!(
            told.belief,
            predicted().belief,
            "neighbours' poses of this event still see it"
        );
        let total = predicted().belief.total();
        assert_eq!(settle(told).parts, Parts::dependent(total));
        assert_eq!(settle(after(&Settings::paper())), predicted().belief);
    }

    #[test]
    fn hearing_moves_the_independent_part_even_if_the_gate_refuses() {
        let improbable = GlobalPose {
            pose: Pose::new(100.0, 0.0, 0.0),
            parts: Parts::dependent(Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap()),
        };
        for settings in [Settings::default(), Settings::paper()] {
            let mut heard = predicted();
            let gate = heard.hear(Stamp::default(), &improbable, &settings);
            assert!(matches!(gate.verdict(), Verdict::Gated { d2 } if d2 > 1e4));
            assert_eq!(heard.belief, predicted().belief);
            let settled = heard.settle(settings.propagation);
            assert_eq!(settled.parts.independent, Covariance3::ZERO);
        }
    }

    /// Parked for a while with a poor heading and never met: what is dependent is curvature alone.
    #[test]
    fn who_has_met_nobody_gives_up_nothing_by_the_first_word() {
        let motion = Motion::Nonholonomic {
            velocity: [1.0, 0.0],
            noise: Covariance2::diagonal([0.01, 0.01]).unwrap(),
        };
        let wanders = |mut filter: Filter| {
            filter.predict(&motion, 1.0, Propagation::Honest);
            filter
        };
        let word = GlobalPose {
            pose: Pose::new(1.0, 0.0, 0.0),
            parts: Parts::dependent(Covariance3::diagonal([0.001; 3]).unwrap()),
        };
        let settings = Settings::default();
        let (mut alone, mut other) = (wanders(predicted()), predicted());
        assert_ne!(alone.belief.parts.dependent, Covariance3::ZERO);
        other.told(&settings);
        other = wanders(other);
        let half = Stamp::default() + crate::stamp::Span::from_millis(500);
        let heading = |filter: &mut Filter, stamp| {
            let gate = filter.hear(stamp, &word, &settings);
            assert!(matches!(gate.verdict(), Verdict::Accepted { .. }));
            filter.belief.total().variances()[2]
        };
        let first = heading(&mut alone, half);
        assert!(first < 0.0015, "{first}");
        assert!(
            heading(&mut other, half) > 1.2 * first,
            "who has met weighs it"
        );
        assert!(alone.pace.heard(half).damped(&settings.fusion).damping < 1.0);
    }
}
