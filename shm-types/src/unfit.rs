//! Why a pose is not good enough to drive on.

use core::fmt;

use crate::BeliefState;

/// Why a pose is not fit to drive on: of several reasons the one that is missed by most.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Unfit {
    /// The robot does not know where it is: see its [`BeliefState`].
    Belief = 1,
    /// σ of the position, in its worst direction, is above the limit that is configured.
    Position = 2,
    /// σ of the heading is.
    Heading = 3,
}

impl Unfit {
    /// The byte of a payload, decoded; 0 is none. A byte of no known meaning is [`Self::Belief`].
    #[must_use]
    pub const fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            0 => None,
            2 => Some(Self::Position),
            3 => Some(Self::Heading),
            _ => Some(Self::Belief),
        }
    }

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Belief => "belief",
            Self::Position => "position",
            Self::Heading => "heading",
        }
    }
}

/// The reason, with what it was decided from.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum WhyUnfit {
    /// Not [`BeliefState::Ok`].
    Belief(BeliefState),
    /// σ in the worst direction, and what it may be at most \[m\].
    Position {
        /// Too much.
        sigma_m: f64,
        /// As configured.
        limit_m: f64,
    },
    /// σ, and what it may be at most \[rad\].
    Heading {
        /// Too much.
        sigma_rad: f64,
        /// As configured.
        limit_rad: f64,
    },
}

impl fmt::Display for WhyUnfit {
    /// `position 1.24 m > 0.50 m`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Belief(state) => write!(f, "belief {state}"),
            Self::Position { sigma_m, limit_m } => {
                let digits = digits(sigma_m, limit_m, 2);
                write!(f, "position {sigma_m:.digits$} m > {limit_m:.digits$} m")
            }
            Self::Heading {
                sigma_rad,
                limit_rad,
            } => {
                let [sigma, limit] = [sigma_rad, limit_rad].map(f64::to_degrees);
                let digits = digits(sigma, limit, 1);
                write!(f, "heading {sigma:.digits$}° > {limit:.digits$}°")
            }
        }
    }
}

/// After the point, so that both are told apart.
fn digits(one: f64, other: f64, at_least: usize) -> usize {
    let apart = (one - other).abs();
    (at_least..6)
        .find(|&digits| apart >= 10_f64.powi(-i32::try_from(digits).unwrap_or(0)))
        .unwrap_or(6)
}

/// σ of the position in its worst direction, and of the heading, of a 3×3 covariance \[m, rad\].
#[must_use]
pub fn worst_sigmas(covariance: &[f64; 9]) -> [f64; 2] {
    let [xx, xy, _, _, yy, _, _, _, heading] = *covariance;
    let worst = f64::midpoint(xx, yy) + f64::hypot((xx - yy) / 2.0, xy);
    [worst, heading].map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_of_no_meaning_is_nothing_to_drive_on() {
        assert_eq!(Unfit::from_byte(0), None);
        for unfit in [Unfit::Belief, Unfit::Position, Unfit::Heading] {
            assert_eq!(Unfit::from_byte(unfit as u8), Some(unfit));
        }
        assert_eq!(Unfit::from_byte(200), Some(Unfit::Belief));
    }

    #[test]
    fn it_reads_as_a_comparison() {
        let position = |sigma_m, limit_m| WhyUnfit::Position { sigma_m, limit_m }.to_string();
        assert_eq!(position(1.237, 0.5), "position 1.24 m > 0.50 m");
        assert_eq!(position(0.5004, 0.5), "position 0.5004 m > 0.5000 m");
        let heading = WhyUnfit::Heading {
            sigma_rad: 0.1,
            limit_rad: 0.05,
        };
        assert_eq!(heading.to_string(), "heading 5.7° > 2.9°");
        let belief = WhyUnfit::Belief(BeliefState::Contradicted);
        assert_eq!(belief.to_string(), "belief contradicted");
    }

    #[test]
    fn the_worst_direction_counts() {
        let [a, b] = [9.0, 4.0];
        let (sin, cos) = 0.6_f64.sin_cos();
        let (xx, yy) = (a * cos * cos + b * sin * sin, a * sin * sin + b * cos * cos);
        let xy = (a - b) * sin * cos;
        let covariance = [xx, xy, 0.1, xy, yy, 0.2, 0.1, 0.2, 0.25];
        let [position, heading] = worst_sigmas(&covariance);
        assert!((position - 3.0).abs() < 1e-12 && (heading - 0.5).abs() < 1e-12);
    }
}
