//! Whether what the estimator claims not to know is what it does not know, by thousands of robots whose truth is known.
//!
//! | part | robots that | bar |
//! | --- | --- | --- |
//! | [`drive`] | drive for half an hour without a fix | honest in every cell |
//! | [`weak`] | get fixes that say next to nothing | mean NEES ≤ 2.4 after 30 s, a heading known to 0.3 rad |
//! | [`signs`] | meet everything, at random | no part of a covariance has a negative eigenvalue, no word is refused |
//! | [`trio`] | help one another, one of three gets rare fixes | mean NEES ≤ 2, no farther off than with the paper's transform |
//! | [`parked`] | exchange poses for an hour, one of them parked | no word is refused |
//!
//! "Honest" is [`Score::is_honest`]: the mean normalised squared error (NEES) of the position, over robots, is 2 ± 0.25, and at
//! most 9 % of the robots are outside of the ellipse that claims to hold 95 % of them. Robots drive at 1 m/s; the noise of their
//! way has exactly the covariance that the filter is told (`increment`).

mod filter;
pub(crate) mod increment;
mod score;
mod sort;
pub(crate) mod table;
mod turning;

pub mod drive;
mod lives;
pub mod parked;
pub mod signs;
pub mod splice;
pub mod trio;
pub mod weak;

use crate::campaign::Finding;
pub use filter::Filter;
pub use score::Score;
pub use sort::Sort;
pub use turning::Turning;

/// How much of it is done.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Robots of a cell.
    pub robots: usize,
    /// Odometry samples in a second.
    pub rate_hz: u32,
    /// Random operations, in [`signs`].
    pub operations: u64,
    /// Runs of the team, in [`trio`].
    pub runs: u16,
    /// How long the robots of [`weak`] drive \[s\].
    pub weak_seconds: u32,
    /// How long the two of [`parked`] stand \[s\].
    pub parked_seconds: u32,
}

impl Form {
    /// The whole campaign.
    #[must_use]
    pub fn long(seed: u64) -> Self {
        Self {
            seed,
            robots: 4000,
            rate_hz: 50,
            operations: 10_000_000,
            runs: 500,
            weak_seconds: 100,
            parked_seconds: 3600,
        }
    }

    /// What a minute of one processor is enough for: the same robots at 10 Hz, fewer of what is at random.
    #[must_use]
    pub fn short(seed: u64) -> Self {
        Self {
            rate_hz: 10,
            operations: 1_000_000,
            runs: 50,
            weak_seconds: 30,
            ..Self::long(seed)
        }
    }

    /// Length of a step \[s\].
    #[must_use]
    pub fn dt_s(&self) -> f64 {
        1.0 / f64::from(self.rate_hz)
    }
}
