//! Every door by which bytes come in from outside, each as a function of arbitrary bytes that panics if they do harm.
//!
//! They are played in three ways: `tests/tests/fuzz.rs` for a moment, the program `fuzz` as long as one likes, both on any
//! toolchain and from one seed; and the targets of `tests/fuzz` with the compiler's help, on a nightly.

mod assists;
mod belief;
mod bytes;
mod candump;
mod configuration;
mod dbc;
mod encoder;
mod mutate;
mod payloads;
mod readings;
mod receiver;
mod recording;
mod scans;
mod scratch;

use std::path::{Path, PathBuf};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use mutate::mutate;

/// A door.
#[derive(Copy, Clone, Debug)]
pub struct Target {
    /// As which it is asked for.
    pub name: &'static str,
    /// Panics if the bytes do harm.
    pub run: fn(&[u8]),
    /// Good bytes, from which others are made.
    samples: fn() -> Vec<Vec<u8>>,
}

/// All of them.
pub const TARGETS: [Target; 11] = [
    candump::TARGET,
    dbc::TARGET,
    configuration::TARGET,
    encoder::TARGET,
    payloads::TARGET,
    recording::TARGET,
    belief::TARGET,
    receiver::TARGET,
    scans::TARGET,
    assists::TARGET,
    readings::TARGET,
];

impl Target {
    /// The one of that name.
    #[must_use]
    pub fn of(name: &str) -> Option<Self> {
        TARGETS.into_iter().find(|target| target.name == name)
    }

    /// Good bytes, and those that once did harm.
    #[must_use]
    pub fn seeds(&self) -> Vec<Vec<u8>> {
        let kept = std::fs::read_dir(self.kept_at()).into_iter().flatten();
        let mut paths: Vec<_> = kept.map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        let kept = paths.into_iter().map(|path| std::fs::read(path).unwrap());
        (self.samples)().into_iter().chain(kept).collect()
    }

    /// Where bytes are kept that once did harm.
    #[must_use]
    pub fn kept_at(&self) -> PathBuf {
        let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
        seeds.join(self.name)
    }

    /// So many inputs, made of its seeds; the same ones for the same `seed`.
    pub fn inputs(&self, seed: u64, count: u64) -> impl Iterator<Item = Vec<u8>> {
        let seeds = self.seeds();
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(move |_| mutate(&seeds, &mut chance))
    }
}
