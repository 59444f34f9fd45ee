//! `wakeups`: is a wake-up ever lost? Publishes by the million, in bursts and from two threads, to readers that sleep in every way
//! there is, and come, go, stop and die. Every fourth reads the page of a group, as another user would, where the first thread alone
//! writes.
//!
//! After every burst nothing more is said until each reader that lives has seen the last message of both threads. One that was not
//! woken would sleep on, and nobody else would wake it.
#![allow(clippy::unwrap_used)] // What fails here fails the run.

mod publishing;
mod reader;
mod readers;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use coloc_shm_types::{Odometry, RobotName, Space};
use coloc_tests::output::{end, print_line};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use publishing::{Publishing, THREADS};
use readers::Readers;

/// In the space of the campaign.
const PREFIX: &str = "wakeups";
const ROBOT: &str = "r1";

/// What should take microseconds takes no longer, however busy the machine is.
const PATIENCE: Duration = Duration::from_secs(20);

/// Publishes to readers that come, go, stop and die, and looks whether each of them wakes up every time.
#[derive(Parser)]
struct Args {
    /// How many messages
    #[arg(long, default_value_t = 10_000_000)]
    publications: u64,
    /// What is done when is drawn from this
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Readers at once
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=8))]
    readers: u16,
    /// Play a reader with this number, in the space at this root
    #[arg(long, hide = true, num_args = 2, value_names = ["NUMBER", "ROOT"])]
    read: Option<Vec<String>>,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let result = match args.read.as_deref() {
        Some([number, root]) => number
            .parse()
            .map_err(Into::into)
            .and_then(|number| reader::run(number, &PathBuf::from(root)))
            .map(|()| true),
        _ => campaign(&args),
    };
    end(
        "wakeups",
        result.map(|held| ExitCode::from(u8::from(!held))),
    )
}

/// What was done.
#[derive(Debug, Default)]
struct Tally {
    bursts: u64,
    /// Readers that have seen the last message of a burst.
    awake: u64,
    came: u64,
    left: u64,
    killed: u64,
    stopped: u64,
}

fn campaign(args: &Args) -> Result<bool, Box<dyn std::error::Error>> {
    let directory = tempfile::tempdir()?;
    let root = directory.path().join("shm");
    let space = Space::open(&root, PREFIX, "campaign")?;
    let acknowledged = space.subscriber::<Odometry>(&RobotName::new(ROBOT)?)?;
    let mut random = ChaCha8Rng::seed_from_u64(args.seed);
    let mut publishing = Publishing::start(&space, args.seed);
    let mut readers = Readers::start(args.readers, root, acknowledged)?;
    let (start, mut tally) = (Instant::now(), Tally::default());
    let mut said = [0; THREADS];
    let mut lost = None;
    while lost.is_none() && said.iter().sum::<u64>() < args.publications {
        act(&mut random, &mut readers, &mut tally)?;
        said = publishing.burst();
        tally.bursts += 1;
        match readers.wait_until_they_know(said, &mut tally) {
            Ok(()) => {}
            Err(who) => lost = Some(who),
        }
    }
    let seconds = start.elapsed().as_secs();
    let publications: u64 = said.iter().sum();
    print_line(&format!(
        "{publications} publications in {seconds} s: {tally:?}"
    ));
    let prefix = space.full_prefix().to_owned();
    drop(readers);
    publishing.end();
    drop(space);
    let left = what_is_left(&prefix);
    if let Some(who) = &lost {
        print_line(&format!("lost: {who}"));
    }
    if !left.is_empty() {
        print_line(&format!("left behind: {left:?}"));
    }
    let held = lost.is_none() && left.is_empty();
    print_line(&format!("lost wake-ups: {}", u8::from(lost.is_some())));
    Ok(held)
}

/// Now and then something happens to a reader.
fn act(
    random: &mut ChaCha8Rng,
    readers: &mut Readers,
    tally: &mut Tally,
) -> Result<(), Box<dyn std::error::Error>> {
    let which = random.random_range(0..readers.count());
    match random.random_range(0..1000) {
        0 => {
            readers.kill(which)?;
            tally.killed += 1;
        }
        1..4 => tally.stopped += u64::from(readers.stop(which)?),
        4..20 => readers.go_on(which)?,
        _ => {}
    }
    Ok(())
}

fn what_is_left(prefix: &str) -> Vec<String> {
    let entries = std::fs::read_dir("/dev/shm")
        .into_iter()
        .flatten()
        .flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| name.starts_with(prefix)).collect()
}
