//! What a child makes of the poses of one event.
//!
//! They are fused one by one, in the order of the leaders' numbers, whatever the order in which they came.
//!
//! * [`Rule::Kalman`] is the thesis: each pose is news. It is not: what one leader says at two events has that leader's error in
//!   common, and children come to be overconfident.
//! * [`Rule::Split`] takes the leader's error as dependent: split covariance intersection holds whatever it is correlated with.
//!
//! * [`Rule::Cross`] tracks the correlation instead ([`super::cross`]), where a history has room for that; else it is as `Split`.

use super::kalman;
use crate::belief::Belief;
use crate::convert::GlobalPose;
use crate::fusion::{Fusion, fuse_and_leave};
use crate::gate::CHI2_3_999;
use crate::kind::RobotId;
use crate::settings::FusionSettings;
use crate::symmetric::Square3;

/// How poses are fused.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Rule {
    /// A plain Kalman update with all of R*.
    Kalman {
        /// Accept if d² is at most this (χ² with three degrees of freedom).
        gate: f64,
    },
    /// Algorithm 3 with `R_d = R* − R_ind`.
    Split {
        /// Of Algorithm 3; damping is a factor of its own here, whatever the pace.
        settings: FusionSettings,
        /// After an event with any pose, accepted or not, all is dependent. Needed where children also tell what they believe.
        reset: bool,
    },
    /// As [`super::bond`] has it.
    Cross {
        /// The gate, and how a pose is fused of which no history is kept.
        otherwise: FusionSettings,
    },
}

/// `split`, without damping, and a gate of 99.9 %.
impl Default for Rule {
    fn default() -> Self {
        Self::Split {
            settings: FusionSettings {
                gate: CHI2_3_999,
                ..FusionSettings::paper()
            },
            reset: true,
        }
    }
}

impl Rule {
    /// The thesis.
    #[must_use]
    pub fn paper() -> Self {
        Self::Kalman { gate: CHI2_3_999 }
    }

    /// Whether the correlation with leaders is tracked.
    #[must_use]
    pub fn is_tracked(&self) -> bool {
        matches!(self, Self::Cross { .. })
    }

    /// Accept if d² is at most this.
    pub(crate) fn gate(&self) -> f64 {
        match self {
            Self::Kalman { gate } => *gate,
            Self::Split { settings, .. } => settings.gate,
            Self::Cross { otherwise } => otherwise.gate,
        }
    }

    /// After an event with a pose nothing is independent.
    pub(crate) fn resets(&self) -> bool {
        matches!(self, Self::Split { reset: true, .. } | Self::Cross { .. })
    }

    /// `own` after one pose.
    #[must_use]
    pub fn fuse_one(&self, own: &Belief, said: &GlobalPose) -> Fusion {
        self.fuse_and_leave(own, said, &mut None)
    }

    /// The same; `left` becomes what is left of the error before, where the pose shares errors with the belief.
    pub(crate) fn fuse_and_leave(
        &self,
        own: &Belief,
        said: &GlobalPose,
        left: &mut Option<Square3>,
    ) -> Fusion {
        match self {
            Self::Kalman { gate } => {
                let update = kalman::update(own, &said.pose, &said.total(), *gate);
                Fusion {
                    belief: update.belief,
                    accepted: update.accepted,
                    alpha: 0.0,
                    d2: update.d2,
                }
            }
            Self::Split { settings, .. }
            | Self::Cross {
                otherwise: settings,
            } => {
                let left = left.insert(Square3::IDENTITY);
                fuse_and_leave(own, said, settings, left)
            }
        }
    }

    /// `own` after all poses of one event, at most one of a leader; `account` hears of each in the order of the fusions.
    #[must_use]
    pub fn fuse_all(
        &self,
        own: &Belief,
        poses: &[(RobotId, GlobalPose)],
        mut account: impl FnMut(RobotId, &Fusion),
    ) -> Belief {
        let mut belief = *own;
        let mut last = None;
        while let Some((leader, said)) = next_after(poses, last) {
            let fusion = self.fuse_one(&belief, said);
            account(*leader, &fusion);
            belief = fusion.belief;
            last = Some(*leader);
        }
        if self.resets() && !poses.is_empty() {
            belief.make_dependent();
        }
        belief
    }
}

/// The pose of the smallest leader beyond `last`.
fn next_after(
    poses: &[(RobotId, GlobalPose)],
    last: Option<RobotId>,
) -> Option<&(RobotId, GlobalPose)> {
    let later = poses
        .iter()
        .filter(|(leader, _)| last.is_none_or(|last| *leader > last));
    later.min_by_key(|(leader, _)| *leader)
}
