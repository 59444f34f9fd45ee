//! `fuzz`: gives every door by which bytes come in from outside as many nearly good ones as one likes; see `coloc_tests::fuzz`.
#![allow(clippy::unwrap_used)] // What fails here fails the run.

use std::panic::catch_unwind;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use coloc_tests::fuzz::{TARGETS, Target};
use coloc_tests::output::{end, print_line};

/// Bytes that are nearly good: does any of them do harm?
#[derive(Parser)]
struct Args {
    /// One door alone; a wrong name says which there are
    #[arg(long, value_parser = target)]
    target: Option<Target>,
    /// Inputs for each door
    #[arg(long, default_value_t = 1_000_000)]
    executions: u64,
    /// The same inputs for the same seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// This input alone
    #[arg(long, requires = "target")]
    input: Option<PathBuf>,
}

fn target(name: &str) -> Result<Target, String> {
    let names = TARGETS.map(|target| target.name).join(", ");
    Target::of(name).ok_or_else(|| format!("there are {names}"))
}

fn main() -> ExitCode {
    let args = Args::parse();
    let result = args.input.as_ref().map_or_else(
        || Ok(play_all(&args)),
        |path| play_one(args.target.unwrap(), path),
    );
    end("fuzz", result.map_err(Into::into))
}

fn play_one(target: Target, path: &std::path::Path) -> Result<ExitCode, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    (target.run)(&bytes);
    Ok(ExitCode::SUCCESS)
}

fn play_all(args: &Args) -> ExitCode {
    let targets = TARGETS
        .into_iter()
        .filter(|target| args.target.is_none_or(|wanted| wanted.name == target.name));
    let harmed = targets.filter(|target| !holds(target, args)).count();
    ExitCode::from(u8::from(harmed > 0))
}

/// Stops at the first input that does harm, and keeps it.
fn holds(target: &Target, args: &Args) -> bool {
    let start = Instant::now();
    for (number, input) in target.inputs(args.seed, args.executions).enumerate() {
        if catch_unwind(|| (target.run)(&input)).is_err() {
            let path = PathBuf::from(format!("fuzz-{}-{number}", target.name));
            std::fs::write(&path, &input).unwrap();
            let path = path.display();
            print_line(&format!(
                "{}: input {number} of seed {} does harm; again: fuzz --target {} --input {path}",
                target.name, args.seed, target.name
            ));
            return false;
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    print_line(&format!(
        "{}: {} inputs did no harm, in {seconds:.0} s",
        target.name, args.executions
    ));
    true
}
