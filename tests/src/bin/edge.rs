//! `edge`: plays episodes at the daemon's edge by the million, each against the truth; see `coloc_tests::edge`.
#![allow(clippy::unwrap_used)] // What fails here fails the run.

use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use clap::Parser;
use coloc_tests::edge::{Tally, play};
use coloc_tests::output::{end, print_line};

/// Frames and messages with true times, clocks that somebody sets, a process that is stopped: does every way come out whole?
#[derive(Parser)]
struct Args {
    /// How many episodes
    #[arg(long, default_value_t = 1_000_000)]
    episodes: u64,
    /// The number of the first; an episode is the same on every machine
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Ticks of an episode, beside those at its end in which all comes to rest
    #[arg(long, default_value_t = 500)]
    ticks: u32,
    /// End earlier, after so many seconds
    #[arg(long)]
    seconds: Option<u64>,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let (next, faults) = (AtomicU64::new(0), AtomicU64::new(0));
    let total = Mutex::new((0, Tally::default()));
    let deadline = args
        .seconds
        .map(|seconds| Instant::now() + Duration::from_secs(seconds));
    let work = || {
        while deadline.is_none_or(|deadline| Instant::now() < deadline) {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= args.episodes || faults.load(Ordering::Relaxed) >= MOST_FAULTS {
                break;
            }
            match play(args.first + number, args.ticks) {
                Ok(tally) => {
                    let mut total = total.lock().unwrap();
                    *total = (total.0 + 1, total.1.and(tally));
                }
                Err(fault) => {
                    faults.fetch_add(1, Ordering::Relaxed);
                    print_line(&format!("episode {}: {fault}", args.first + number));
                }
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        (0..threads).for_each(|_| drop(scope.spawn(work)));
    });
    let (episodes, tally) = *total.lock().unwrap();
    print_line(&format!("{episodes} episodes hold: {tally:?}"));
    let faults = faults.into_inner();
    print_line(&format!("{faults} do not"));
    let holds = faults == 0 && episodes > 0;
    end("edge", Ok(ExitCode::from(u8::from(!holds))))
}

/// After so many it is clear that something is wrong.
const MOST_FAULTS: u64 = 20;
