//! `calibrate`: hundreds of drives of robots whose truth is known; see `coloc_sim::calibrate`.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{Write as _, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use coloc_sim::calibrate::{Form, coverage, refusals};
use coloc_sim::honest::{Finding, splice};

/// Does a calibration find what is true, say how well, and refuse what a drive cannot show?
#[derive(Parser)]
struct Args {
    /// What a minute of one processor is enough for
    #[arg(long)]
    short: bool,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Drives of each course [default: 200, of the short form 12]
    #[arg(long, value_name = "N")]
    drives: Option<u16>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let form = Form {
        seed: args.seed,
        drives: args.drives.unwrap_or(if args.short { 12 } else { 200 }),
    };
    let (mut text, mut missed) = (String::new(), 0);
    for find in [coverage, refusals] {
        let begun = Instant::now();
        let found = find(&form);
        let words = told(&found, begun.elapsed().as_secs());
        stdout().write_all(words.as_bytes())?;
        text.push_str(&words);
        missed += found.missed.len();
    }
    if let Some(path) = &args.markdown {
        splice::write(path, "calibrate", &text)?;
    }
    writeln!(stdout(), "{missed} bars missed")?;
    Ok(ExitCode::from(u8::from(missed > 0)))
}

fn told(found: &Finding, took: u64) -> String {
    let mut verdict = String::new();
    for it in &found.missed {
        // A string takes all.
        let _ = writeln!(verdict, "* MISSED: {it}");
    }
    if found.missed.is_empty() {
        verdict.push_str("All bars held.\n");
    }
    format!(
        "### {}\n\n{}\n{verdict}\nIt took {took} s.\n\n",
        found.title, found.text
    )
}
