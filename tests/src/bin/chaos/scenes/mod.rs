//! The scenes, and how they are played.

mod calls;
mod calls_alone;
mod dead;
mod directories;
mod disk;
mod limits;
mod memory;
mod outputs;
mod random;
mod start;
mod stops;

use std::process::ExitCode;
use std::time::{Duration, Instant};

use crate::args::Args;
use crate::stage::{Stage, load};
use crate::tally::Tally;
use coloc_tests::output::print_line;

type Play = fn(&Stage, &mut Tally);

const SCENES: &[(&str, Play)] = &[
    ("random", random::play),
    ("start", start::play),
    ("calls-of-daemon", calls::daemon_start),
    ("calls-of-reader", calls::reader_start),
    ("calls-of-feeder", calls::feeder_start),
    ("calls-of-end", calls::daemon_end),
    ("calls-with-term", calls::term_in_start),
    ("calls-alone", calls_alone::start),
    ("calls-of-last", calls_alone::end),
    ("stops", stops::play),
    ("dead", dead::all),
    ("half-dead", dead::some),
    ("memory", memory::play),
    ("disk", disk::play),
    ("directories", directories::play),
    ("outputs", outputs::play),
    ("limits", limits::play),
];

pub(crate) fn run(args: &Args) -> ExitCode {
    let begun = Instant::now();
    let (mut seed, mut failures) = (args.seed, 0);
    loop {
        failures += play_all(args, seed);
        seed += 1;
        if begun.elapsed() >= Duration::from_secs(60 * args.minutes) {
            break;
        }
    }
    if failures > 0 {
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

/// How many rounds failed.
fn play_all(args: &Args, seed: u64) -> usize {
    let stage = Stage::new(args, seed);
    print_line(&format!("seed {seed}, load {}", load()));
    let asked = |name| args.only.is_empty() || args.only.iter().any(|only| only == name);
    let tallies: Vec<(Tally, Duration)> = SCENES
        .iter()
        .filter(|(name, _)| asked(name))
        .map(|(name, scene)| play(name, *scene, &stage))
        .collect();
    print_line(&format!(
        "{:<16} {:>7} {:>7} {:>7}",
        "scene", "rounds", "failed", "s"
    ));
    for (tally, took) in &tallies {
        print_line(&format!(
            "{:<16} {:>7} {:>7} {:>7.1}  {}",
            tally.scene,
            tally.rounds,
            tally.failures.len(),
            took.as_secs_f64(),
            tally.line()
        ));
    }
    tallies.iter().map(|(tally, _)| tally.failures.len()).sum()
}

fn play(name: &'static str, scene: Play, stage: &Stage) -> (Tally, Duration) {
    print_line(&format!("{name} ..."));
    let begun = Instant::now();
    let mut tally = Tally::new(name);
    scene(stage, &mut tally);
    (tally, begun.elapsed())
}
