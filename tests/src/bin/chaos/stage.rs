//! What all scenes are given.

use std::path::PathBuf;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::args::Args;

/// How much is to be done, and where chance comes from.
pub(crate) struct Stage {
    pub(crate) seed: u64,
    pub(crate) kills: u32,
    pub(crate) every_call: bool,
    pub(crate) round: Option<u32>,
    pub(crate) colocd: Option<PathBuf>,
    /// After so many a scene is left.
    pub(crate) failures: usize,
    /// In mount namespace of its own, so that file systems can be filled.
    pub(crate) is_alone: bool,
}

impl Stage {
    pub(crate) fn new(args: &Args, seed: u64) -> Self {
        Self {
            seed,
            kills: args.kills,
            every_call: args.every_call,
            round: args.round,
            colocd: args.colocd.clone(),
            failures: args.failures,
            is_alone: args.alone,
        }
    }

    /// The chance of one round: the same, whatever was played before.
    pub(crate) fn chance(&self, scene: &str, round: u32) -> ChaCha8Rng {
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&self.seed.to_le_bytes());
        seed[8..12].copy_from_slice(&round.to_le_bytes());
        let name = scene.as_bytes();
        let length = name.len().min(20);
        seed[12..12 + length].copy_from_slice(&name[..length]);
        ChaCha8Rng::from_seed(seed)
    }

    /// The rounds of a scene that has `count` of them.
    pub(crate) fn rounds(&self, count: u32) -> Vec<u32> {
        self.round
            .map_or_else(|| (0..count).collect(), |round| vec![round])
    }

    /// One round for so many kills at random, and at least `least`.
    pub(crate) fn one_in(&self, kills: u32, least: u32) -> Vec<u32> {
        self.rounds((self.kills / kills).max(least))
    }
}

/// Of the machine: processes that want to run, over 1, 5 and 15 minutes.
pub(crate) fn load() -> String {
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    load.split(' ').take(3).collect::<Vec<_>>().join(" ")
}
