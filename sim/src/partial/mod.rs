//! Robots that see one another in part, and what both learn of it.
//!
//! | part | what | bar |
//! | --- | --- | --- |
//! | [`exchange`] | the robots of MR.CLAM 1 and 6 with what their own cameras saw of one another | position and honesty of those without a receiver |
//! | [`tracks`] | a filter for each of the 20 pairs, on the same sightings | what is published is honest |
//! | [`thesis`] | the thesis' simulation of its tracker, §5.3, in the plane | a linear start is five times as fast as the rivals |
//!
//! The exchange goes through the product's `step`, as in a daemon: what is told is there at the next tick, what is answered at the one
//! after. The tracks are [`coloc_track`]'s. Sightings come 0.04 s before their recorded stamp: the camera's latency.

pub mod exchange;
mod recorded;
mod survey;
pub mod thesis;
pub mod tracks;

use std::path::PathBuf;

use crate::campaign::Finding;
pub use recorded::{Recorded, Unusable};

/// χ² with two and three degrees of freedom, 95 %.
const CHI2_2_95: f64 = 5.991_464_547_107_979;
const CHI2_3_95: f64 = 7.814_727_903_251_179;

/// The odometry noise of MR.CLAM's robots: variances of v over v² and of ω, of samples of [`REFERENCE_S`].
const FORWARD: f64 = 5.075;
const TURNING: f64 = 0.345;
const REFERENCE_S: f64 = 0.02;

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Draws of starts and fixes, in [`exchange`].
    pub draws: u16,
    /// Runs, in [`thesis`]: 200 at most.
    pub runs: u16,
    /// The folder with recordings; `None`: without them.
    pub data: Option<PathBuf>,
}

impl Form {
    /// The whole campaign.
    #[must_use]
    pub fn long(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            seed,
            draws: 10,
            runs: 1000,
            data,
        }
    }

    /// What some seconds of one processor are enough for.
    #[must_use]
    pub fn short(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            draws: 4,
            runs: 50,
            ..Self::long(seed, data)
        }
    }

    /// Both recordings; or what to say of their absence.
    fn recordings(&self, title: &str) -> Result<[Recorded; 2], Finding> {
        let said = |text: String, missed| Finding {
            title: title.into(),
            text,
            missed,
        };
        let Some(data) = &self.data else {
            let skipped = "SKIPPED: no recordings; set COLOC_DATA to the folder that holds mrclam1 and mrclam6\n";
            return Err(said(skipped.into(), Vec::new()));
        };
        let read =
            |number| Recorded::read(data, number).map_err(|error| said(String::new(), vec![error]));
        Ok([read(1)?, read(6)?])
    }
}
