//! A moment of every fuzz target; `cargo run --release -p coloc-tests --bin fuzz` does more of it.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use coloc_tests::fuzz::{TARGETS, Target};

const INPUTS: u64 = 3000;

fn play(name: &str) {
    let target = Target::of(name).unwrap();
    target.seeds().iter().for_each(|seed| (target.run)(seed));
    let inputs = target.inputs(1, INPUTS);
    inputs.for_each(|input| (target.run)(&input));
}

macro_rules! doors {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            play(stringify!($name));
        })*

        #[test]
        fn every_door_has_its_test() {
            assert_eq!(TARGETS.map(|target| target.name), [$(stringify!($name)),*]);
        }
    };
}

doors!(candump dbc configuration encoder payloads recording belief receiver scans assists readings);
