//! `honest`: thousands of simulated robots against what the estimator claims not to know; see `coloc_sim::honest`.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{Write as _, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use coloc_sim::honest::splice::{self, spliced};
use coloc_sim::honest::{Finding, Form, drive, parked, signs, trio, weak};

/// Is the position as uncertain as the estimator says? Half an hour without fixes, fixes that say little, teams; and does no
/// covariance lose its sign?
#[derive(Parser)]
struct Args {
    /// What a minute of one processor is enough for
    #[arg(long)]
    short: bool,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// These parts alone: drive, weak, signs, trio, parked
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// What it consists of.
type Part = (&'static str, fn(&Form) -> Finding);

const PARTS: [Part; 5] = [
    ("drive", drive::find),
    ("weak", weak::find),
    ("signs", signs::find),
    ("trio", trio::find),
    ("parked", parked::find),
];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let parts = chosen(&args.only)?;
    let form = if args.short {
        Form::short(args.seed)
    } else {
        Form::long(args.seed)
    };
    if let Some(path) = &args.markdown {
        spliced(path, "honest", "")?;
    }
    let mut text = String::new();
    let mut missed = 0;
    for part in parts {
        let (words, misses) = told(part, &form);
        stdout().write_all(words.as_bytes())?;
        text.push_str(&words);
        missed += misses;
    }
    if let Some(path) = &args.markdown {
        splice::write(path, "honest", &text)?;
    }
    writeln!(stdout(), "{missed} bars missed")?;
    Ok(ExitCode::from(u8::from(missed > 0)))
}

fn chosen(only: &[String]) -> Result<Vec<Part>, String> {
    let unknown = only
        .iter()
        .find(|name| PARTS.iter().all(|(part, _)| part != name));
    if let Some(name) = unknown {
        return Err(format!("there is no part {name}"));
    }
    let is_chosen = |name: &str| only.is_empty() || only.iter().any(|it| it == name);
    Ok(PARTS
        .into_iter()
        .filter(|(name, _)| is_chosen(name))
        .collect())
}

/// Runs a part: what is to be said of it, and how many bars it missed.
fn told((_, find): Part, form: &Form) -> (String, usize) {
    let begun = Instant::now();
    let Finding {
        title,
        text,
        missed,
    } = find(form);
    let took = begun.elapsed().as_secs();
    let mut verdict = String::new();
    for it in &missed {
        // A string takes all.
        let _ = writeln!(verdict, "* MISSED: {it}");
    }
    if missed.is_empty() {
        verdict.push_str("All bars held.\n");
    }
    (
        format!("### {title}\n\n{text}\n{verdict}\nIt took {took} s.\n\n"),
        missed.len(),
    )
}
