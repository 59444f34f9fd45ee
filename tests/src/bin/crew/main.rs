//! Five daemons and five `coloc-rounds` as processes over shared memory, any of which is killed at any moment of a slot, again and again.
//!
//! ```text
//! crew [KILLS] [SEED]
//! ```
//!
//! It fails unless
//!
//! * every recording, played again in one process, gives the bits of every tick;
//! * every correction that a daemon took is, bit for bit, what a round said that was heard on the channels: a belief changes by a whole
//!   round or not at all;
//! * at the end all are with their team again, and no estimate is off by more than its gate allows.
//!
//! The robots drive to and fro, or turn, no farther than a daemon is uncertain that was killed and begins at its first pose again.

mod feed;
mod judge;
mod stage;

use std::process::ExitCode;

use feed::Feed;
use judge::Overheard;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stage::{Stage, until};

fn main() -> ExitCode {
    let mut arguments = std::env::args_os();
    let _ = arguments.next();
    match arguments.next() {
        Some(it) if it == "colocd" => {
            coloc_daemon::main_from_args(std::iter::once(it).chain(arguments))
        }
        Some(it) if it == "coloc-rounds" => {
            coloc_party::program::main_from_args(std::iter::once(it).chain(arguments))
        }
        kills => {
            let number = |it: Option<std::ffi::OsString>, otherwise: u64| {
                let said = it.and_then(|it| it.to_str()?.parse().ok());
                said.unwrap_or(otherwise)
            };
            let kills = number(kills, 300);
            let seed = number(arguments.next(), 1);
            match campaign(kills, seed) {
                Ok(report) => {
                    println!("{report}");
                    ExitCode::SUCCESS
                }
                Err(problem) => {
                    eprintln!("FAILED: {problem}");
                    ExitCode::FAILURE
                }
            }
        }
    }
}

fn campaign(kills: u64, seed: u64) -> Result<String, Box<dyn std::error::Error>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut stage = Stage::new()?;
    let mut overheard = Overheard::new(&stage)?;
    let feed = Feed::start(&stage, seed);
    stage.start_all()?;
    until("all are with their team", || {
        overheard.listen();
        overheard.all_are_with_their_team()
    })?;
    for _ in 0..kills {
        // Anywhere in two slots.
        let wait_ms = random.random_range(0..2 * stage::SLOT_MS);
        overheard.listen_for(wait_ms);
        stage.kill(random.random_range(0..stage::PROGRAMS))?;
    }
    overheard.forget();
    until("all are with their team again", || {
        overheard.listen();
        overheard.all_are_with_their_team()
    })?;
    let beliefs = overheard.beliefs();
    stage.end_all()?;
    drop(feed);
    let judged = judge::recordings(&stage, &overheard)?;
    judge::errors(&beliefs)?;
    Ok(format!("{kills} kills; {judged}"))
}
