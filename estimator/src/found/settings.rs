//! How a robot that does not know where it is, or no longer, is to be found.

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
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct FoundSettings {
    /// False: the belief is never doubted, as in the paper; a start without one stays so.
    pub enabled: bool,
    /// How a lone source against the wheels is decided.
    pub trust_jump: TrustJump,
}

impl FoundSettings {
    /// The belief is never doubted.
    pub const OFF: Self = Self {
        enabled: false,
        trust_jump: TrustJump::Robot,
    };
}

impl Default for FoundSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            trust_jump: TrustJump::default(),
        }
    }
}
