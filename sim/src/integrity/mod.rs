//! The monitor of [`coloc_bounds`] on recorded drives: is the truth inside, how large is the region, who is found to lie, and how soon?
//!
//! | part | what | bar |
//! | --- | --- | --- |
//! | [`contain`] | honest robots, errors within their bounds | the truth inside in every slot, areas of the specification, no alarm that is not proven |
//! | [`promised`](contain::promised) | the same, and means are promised | none: how often that promise is not kept |
//! | [`means`] | which promise of means honest robots keep, and how soon each finds a fix that goes away slowly | one is kept in every slot, and halves the specification's time |
//! | [`lies`] | an estimate that is off by a constant | 1 m in two slots |
//! | [`faults`] | one source lies at a time: a fix, a robot's sightings | a fix that is off by 3 m in two slots, named alone in nine of ten |
//! | [`drift`] | a fix that goes away slowly | at 0.05 m/s the specification's time is halved where means are promised |
//! | [`alone`] | an estimate that believes its wheels alone, and one that counts all twice | none |
//! | [`paper`] | twelve robots that see bearings alone, in a frame of their own | greedy searches beat uniform ones, the truth inside |
//! | [`usual`] | errors that are Gaussian, bounds at 5σ, no compass | none: published beside |
//!
//! Sightings and fixes are made from the truth of MR.CLAM as everywhere here; what the wheels say is recorded. A slot is half a second.

pub mod alone;
mod bar;
pub mod contain;
pub mod drift;
pub mod faults;
pub mod lies;
pub mod means;
pub mod paper;
pub mod picture;
mod setting;
mod slots;
pub mod usual;

use std::path::PathBuf;

use crate::mrclam::{GridWorld, Recording};

/// What is driven: the recordings of MR.CLAM by their numbers.
const RECORDINGS: [u32; 2] = [1, 6];

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Runs of each recording, each with other noise.
    pub runs: u16,
    /// So many slots of each run; all if there are fewer.
    pub slots: usize,
    /// So many faults of a kind begin in each recording, at least.
    pub onsets: usize,
    /// The folder with recordings; `None`: without them.
    pub data: Option<PathBuf>,
}

impl Form {
    /// The whole campaign.
    #[must_use]
    pub fn long(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            seed,
            runs: 4,
            slots: usize::MAX,
            onsets: 230,
            data,
        }
    }

    /// What some seconds of one processor are enough for.
    #[must_use]
    pub fn short(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            seed,
            runs: 1,
            slots: 400,
            onsets: 40,
            data,
        }
    }
}

impl Form {
    /// From one beginning of a fault to the next in so many slots \[slots\].
    fn every(&self, slots: usize) -> usize {
        (slots / self.onsets).max(2)
    }
}

/// The recordings, with their numbers; says loudly which are not there.
///
/// # Errors
/// If one cannot be read.
fn worlds(form: &Form) -> Result<Vec<(u32, GridWorld)>, String> {
    let Some(data) = &form.data else {
        return Err("no recordings: set COLOC_DATA to the folder that has them".into());
    };
    let world = |&number: &u32| {
        let folder = data.join(format!("mrclam{number}"));
        if !folder.is_dir() {
            return Err(format!("no recording {}", folder.display()));
        }
        let recording = Recording::load(&folder).map_err(|it| it.to_string())?;
        Ok((number, recording.resample()))
    };
    RECORDINGS.iter().map(world).collect()
}
