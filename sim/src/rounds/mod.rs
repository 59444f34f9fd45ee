//! A joint filter in rounds, over a network that loses: how accurate, how honest, and whether it is the joint filter that it says it is.
//!
//! | part | what | bar |
//! | --- | --- | --- |
//! | [`accuracy`] | MR.CLAM 1 and 6, receivers on two robots | the specification's figures, and better than split covariance intersection |
//! | [`one`](accuracy::one) | the same with one receiver | the specification's figures |
//! | [`flown`](accuracy::flown), [`flown_one`](accuracy::flown_one) | both of what flies: the estimator, and what `coloc-rounds` does | the same |
//! | [`flights`] | of what flies, what goes wrong | honest |
//! | [`trouble`] | absent robots, lost messages, leaders killed, a team cut in two, a robot that has forgotten | the joint filter with the same robots left out, to 10⁻⁹ |
//!
//! The rounds themselves are [`coloc_rounds`]; here are the network ([`Trouble`]), a team on it ([`Crew`], and as it flies [`Flight`]) and the joint filter in one
//! matrix ([`reference`](mod@reference)).

pub mod accuracy;
mod crew;
mod flight;
pub mod flights;
mod network;
pub mod reference;
pub mod trouble;

pub use crew::{Counts, Crew, Plan};
pub use flight::{Flight, Tally};
pub use network::Trouble;

use std::path::PathBuf;
use std::sync::Arc;

use crate::mrclam::{GridWorld, Recording};

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Runs with other noise, in [`accuracy`].
    pub runs: u16,
    /// The same of what flies, at most: it takes longer.
    pub flown: u16,
    /// So much of the recording, in [`trouble`] \[s\].
    pub seconds: f64,
    /// The folder with recordings; `None`: without them.
    pub data: Option<PathBuf>,
}

impl Form {
    /// The whole campaign.
    #[must_use]
    pub fn long(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            seed,
            runs: 20,
            flown: 20,
            seconds: 1500.0,
            data,
        }
    }

    /// What a minute or two of one processor is enough for.
    #[must_use]
    pub fn short(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            runs: 10,
            flown: 0,
            seconds: 200.0,
            ..Self::long(seed, data)
        }
    }

    /// MR.CLAM's recordings 1 and 6, those that are there.
    fn worlds(&self) -> Vec<(usize, Arc<GridWorld>)> {
        let folder = |number: &usize| {
            let path = self.data.as_ref()?.join(format!("mrclam{number}"));
            let recording = Recording::load(&path).ok()?;
            Some((*number, Arc::new(recording.resample())))
        };
        [1, 6].iter().filter_map(folder).collect()
    }
}
