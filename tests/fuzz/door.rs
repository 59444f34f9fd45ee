//! One of the doors, which the environment names, for libFuzzer.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use coloc_tests::fuzz::Target;
use libfuzzer_sys::fuzz_target;

static DOOR: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("COLOC_DOOR").unwrap_or_default();
    Target::of(&name).expect("COLOC_DOOR names a target of coloc_tests::fuzz")
});

/// Before libFuzzer looks into its corpus.
fn plant_seeds() {
    let Some(corpus) = std::env::var_os("COLOC_CORPUS").map(PathBuf::from) else {
        return;
    };
    for (number, seed) in DOOR.seeds().iter().enumerate() {
        std::fs::write(corpus.join(format!("seed-{number}")), seed)
            .expect("a directory to write in");
    }
}

fuzz_target!(init: plant_seeds(), |bytes: &[u8]| (DOOR.run)(bytes));
