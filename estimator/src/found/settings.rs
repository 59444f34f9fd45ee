//! How a robot that does not know where it is, or no longer, is to be found.

use super::{WIDE, WIDE_AMONG_OTHERS};

/// How a lone source against the wheels is decided.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum TrustJump {
    /// A constant offset from some moment on means that the robot was carried: the source is followed.
    #[default]
    Robot,
    /// It means that the receiver is wrong: the belief stays, contradicted, and the covariance holds both.
    Receiver,
}

/// How a robot that does not know where it is, or no longer, is found.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct FoundSettings {
    /// False: the belief is never doubted, as in the paper; a start without one stays so.
    pub enabled: bool,
    /// How a lone source against the wheels is decided.
    pub trust_jump: TrustJump,
    /// A heading less certain than this is not updated by a fix, which says nothing of it by itself: the belief becomes a hypothesis (σ² \[rad²\]).
    pub wide: f64,
}

impl FoundSettings {
    /// The belief is never doubted.
    pub const OFF: Self = Self {
        enabled: false,
        trust_jump: TrustJump::Robot,
        wide: WIDE,
    };

    /// Of a robot that sees others in part.
    #[must_use]
    pub fn among_others(self) -> Self {
        Self {
            wide: WIDE_AMONG_OTHERS,
            ..self
        }
    }
}

impl Default for FoundSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            trust_jump: TrustJump::default(),
            wide: WIDE,
        }
    }
}
