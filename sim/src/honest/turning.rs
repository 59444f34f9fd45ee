//! How robots turn.

use crate::random::{Noise, Purpose};

/// For so long a turning rate is held \[s\].
pub(super) const STRETCH_S: u32 = 5;

/// The fastest turn \[rad/s\].
pub(super) const FASTEST: f64 = 0.5;

/// What is commanded; all robots of a cell do the same.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Turning {
    /// At this rate all the time \[rad/s\].
    Steady(f64),
    /// At another rate every five seconds, up to 0.5 rad/s.
    Random,
}

impl Turning {
    /// Those that every noise meets.
    pub const ALL: [Self; 5] = [
        Self::Steady(0.0),
        Self::Steady(0.02),
        Self::Steady(0.1),
        Self::Steady(0.5),
        Self::Random,
    ];

    /// For people.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Steady(0.0) => "straight".into(),
            Self::Steady(rate) => format!("{rate} rad/s"),
            Self::Random => "at random".into(),
        }
    }

    /// In that stretch, of that robot \[rad/s\].
    #[must_use]
    pub fn rate(self, noise: &Noise, stretch: usize, robot: usize) -> f64 {
        match self {
            Self::Steady(rate) => rate,
            Self::Random => noise
                .draws(Purpose::Turns, stretch, robot, 0)
                .uniform(-FASTEST, FASTEST),
        }
    }
}
