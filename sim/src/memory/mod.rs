//! Whether a receiver whose error drifts for minutes leaves the belief honest.
//!
//! | part | what | bar |
//! | --- | --- | --- |
//! | [`parked`] | robots that stand for an hour, their receiver's error a Gauss–Markov process | at most 7 % outside of the ellipse that claims 95 % |
//! | [`park`] | a recorded car, fixes withheld in blocks of 30 to 60 s | 90 % of the blocks inside of the one-sided 95 % bound |
//!
//! Beside each stands what comes of it if all of the receiver's error is taken to be new in every fix. Both drive the
//! product's own `step` and its defaults.

pub mod park;
pub mod parked;
mod recording;

use std::path::PathBuf;

/// χ² with two degrees of freedom, 95 %.
const CHI2_2_95: f64 = 5.991_464_547_107_979;

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Robots of a cell, in [`parked`].
    pub robots: u16,
    /// Fixes in a second, in [`parked`].
    pub fixes_per_s: u32,
    /// Whether the noise of the recorded car is chosen again, in [`park`].
    pub chooses: bool,
    /// The folder with recordings; `None`: without them.
    pub data: Option<PathBuf>,
}

impl Form {
    /// The whole campaign.
    #[must_use]
    pub fn long(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            seed,
            robots: 500,
            fixes_per_s: 5,
            chooses: true,
            data,
        }
    }

    /// What some seconds of one processor are enough for.
    #[must_use]
    pub fn short(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            robots: 100,
            fixes_per_s: 1,
            chooses: false,
            ..Self::long(seed, data)
        }
    }
}
