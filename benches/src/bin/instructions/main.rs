//! Counts the instructions of the hot functions under `valgrind --tool=callgrind`: the same figures whatever else
//! the machine is doing.
//!
//! ```text
//! instructions            print the figures beside the committed ones
//! instructions --check    the same, and fail if a function grew by more than 5 % or takes more than it may
//! instructions --write    commit to the figures: write benches/instructions.tsv
//! ```
//!
//! A function is run a few times and many times, each in a process of its own; the difference divided by the
//! difference of the counts is what one call costs, start-up and warm-up left out. `daemon-…` are whole ticks of the real
//! daemon, from the wake-up to the books; what its surroundings do is left out. `cold-lines-…` are no instructions, but the lines of
//! memory that such a tick fetches when nothing of it is in the caches, as after others had the processor.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod case;
mod figures;

use std::env;
use std::error::Error;
use std::process::{Command, ExitCode};

use case::Case;
use coloc_benches::hot::CACHE;
use coloc_tests::output::{end, print_line};
use figures::Figures;

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match words.as_slice() {
        ["--run", name, iterations] => run(name, iterations).map(|()| true),
        [] => compare().map(|_| true),
        ["--check"] => compare(),
        ["--write"] => write().map(|()| true),
        _ => Err("usage: instructions [--check | --write]".into()),
    };
    let status = result.map(|held| ExitCode::from(u8::from(!held)));
    end("instructions", status)
}

/// The measured process: `iterations` calls of one function.
fn run(name: &str, iterations: &str) -> Result<(), Box<dyn Error>> {
    let case = Case::named(name).ok_or_else(|| format!("no case is called {name}"))?;
    case.run(iterations.parse()?)
}

fn measure() -> Result<Figures, Box<dyn Error>> {
    let mut figures = Figures::default();
    for case in Case::ALL {
        let [few, many] = case.counts();
        let grown = collected(case, many)?.saturating_sub(collected(case, few)?);
        figures.push(case.name(), grown / (many - few));
    }
    Ok(figures)
}

fn collected(case: Case, iterations: u64) -> Result<u64, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .args(case.within().into_iter().flat_map(only))
        .args(case.is_cold().then(caches).into_iter().flatten())
        .arg(env::current_exe()?)
        .args(["--run", case.name(), &iterations.to_string()])
        .output()
        .map_err(|error| {
            format!("valgrind does not start ({error}): install the package valgrind")
        })?;
    let report = String::from_utf8_lossy(&output.stderr);
    let events = report
        .lines()
        .find_map(|line| Some(line.split_once("Collected :")?.1));
    let events: Option<Vec<u64>> = events.and_then(|events| {
        let words = events.split_whitespace();
        words.map(|word| word.parse().ok()).collect()
    });
    let count = match events.as_deref() {
        // Instructions, and with the caches: what of instructions, of data read and of data written was in none of them.
        Some([instructions]) => Some(*instructions),
        Some([_, .., fetched, read, written]) => Some(fetched + read + written),
        _ => None,
    };
    Ok(count.ok_or_else(|| format!("valgrind said no count: {report}"))?)
}

/// Counts what is in no cache as well: the first ones are usual, the last has everything that a tick needs.
fn caches() -> [String; 4] {
    [
        "--cache-sim=yes".into(),
        "--I1=32768,8,64".into(),
        "--D1=32768,8,64".into(),
        format!("--LL={CACHE},16,64"),
    ]
}

/// Counts what happens within a function alone.
fn only(function: &str) -> [String; 2] {
    [
        "--collect-atstart=no".into(),
        format!("--toggle-collect={function}"),
    ]
}

fn compare() -> Result<bool, Box<dyn Error>> {
    let committed = Figures::read()?;
    let measured = measure()?;
    print_line(&format!(
        "{:<52} {:>12} {:>12} {:>8}",
        "function", "committed", "now", "change"
    ));
    let mut within = true;
    for (name, now) in measured.iter() {
        let change = committed.get(name).map(|before| relative(before, now));
        let case = Case::named(name);
        let too_much = case.is_some_and(|case| exceeds(case, now, &measured));
        let tolerance = case.map_or(0.0, Case::tolerance);
        let grown = change.is_none_or(|change| change > tolerance) || too_much;
        within &= !grown;
        print_line(&format!(
            "{name:<52} {:>12} {now:>12} {:>8}{}",
            committed
                .get(name)
                .map_or("none".into(), |count| count.to_string()),
            change.map_or(String::new(), |change| format!("{:+.1} %", 100.0 * change)),
            if too_much {
                "  <- too much"
            } else if grown {
                "  <- grew"
            } else {
                ""
            },
        ));
    }
    if !within {
        print_line(
            "A function takes more instructions than committed. On purpose? Then: instructions --write, and say why in the commit.",
        );
    }
    Ok(within)
}

/// Whether it takes more than it may, whatever is committed.
#[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
fn exceeds(case: Case, now: u64, measured: &Figures) -> bool {
    let times = case.times().and_then(|(times, other)| {
        let other = measured.get(other.name())?;
        Some(now as f64 > times * other as f64)
    });
    case.bound().is_some_and(|bound| now > bound) || times.unwrap_or(false)
}

#[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
fn relative(before: u64, now: u64) -> f64 {
    (now as f64 - before as f64) / before as f64
}

fn write() -> Result<(), Box<dyn Error>> {
    let figures = measure()?;
    figures.write()?;
    figures
        .iter()
        .for_each(|(name, count)| print_line(&format!("{name}\t{count}")));
    Ok(())
}
