//! What wheels there are.

use coloc_estimator::{Covariance2, Covariance3, Motion};

/// How good a robot's odometry is.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Sort {
    /// Table 2 of the paper: 32 % of a metre, 4.8° in a second.
    Paper,
    /// 2 % of a metre, 3° in a minute.
    Sane,
    /// 0.3 % of a metre, 0.3° in a minute.
    VeryGood,
    /// As [`Self::Sane`], and 1 % of a metre to the side.
    Sideways,
}

impl Sort {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Paper, Self::Sane, Self::VeryGood, Self::Sideways];

    /// For people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Sane => "sane",
            Self::VeryGood => "very good",
            Self::Sideways => "with sideways",
        }
    }

    /// Variances that a second at 1 m/s adds to the way ahead, to the side, and to the heading \[m², m², rad²\].
    #[must_use]
    pub fn per_second(self) -> [f64; 3] {
        let turning = |degrees: f64| degrees.to_radians().powi(2) / 60.0;
        match self {
            Self::Paper => [0.02 * 5.075, 0.0, 0.02 * 0.345],
            Self::Sane => [0.02 * 0.02, 0.0, turning(3.0)],
            Self::VeryGood => [0.003 * 0.003, 0.0, turning(0.3)],
            Self::Sideways => [0.02 * 0.02, 0.01 * 0.01, turning(3.0)],
        }
    }

    /// Driving at 1 m/s and turning at `omega` \[rad/s\], with the noise of steps of `dt_s`.
    #[must_use]
    pub fn motion(self, omega: f64, dt_s: f64) -> Motion {
        let [forward, sideways, turning] = self.per_second().map(|it| it / dt_s);
        if sideways == 0.0 {
            return Motion::Nonholonomic {
                velocity: [1.0, omega],
                noise: Covariance2::diagonal([forward, turning]).unwrap_or_default(),
            };
        }
        Motion::Holonomic {
            velocity: [1.0, 0.0, omega],
            noise: Covariance3::diagonal([forward, sideways, turning]).unwrap_or_default(),
        }
    }
}
