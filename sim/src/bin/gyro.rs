//! `gyro`: hundreds of simulated robots with a gyro; see `coloc_sim::gyro`.

use std::error::Error;
use std::io::{Write as _, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use coloc_sim::gyro::{Form, find};
use coloc_sim::honest::splice;

/// Is the heading better by a gyro, and honest? Is its bias found, and slip seen?
#[derive(Parser)]
struct Args {
    /// What some seconds of one processor are enough for
    #[arg(long)]
    short: bool,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// So many robots of each row
    #[arg(long, value_name = "NUMBER")]
    robots: Option<u16>,
    /// Write the table between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let form = if args.short {
        Form::short(args.seed)
    } else {
        Form::long(args.seed)
    };
    let form = Form {
        robots: args.robots.unwrap_or(form.robots),
        ..form
    };
    let begun = Instant::now();
    let found = find(&form);
    let text = format!("{} robots of each row.\n\n{}", form.robots, found.text);
    if let Some(path) = &args.markdown {
        splice::write(path, "gyro", &text)?;
    }
    let mut out = stdout();
    writeln!(out, "{text}")?;
    for it in &found.missed {
        writeln!(out, "* MISSED: {it}")?;
    }
    let took_s = begun.elapsed().as_secs();
    writeln!(
        out,
        "{} bars missed. It took {took_s} s.",
        found.missed.len()
    )?;
    Ok(ExitCode::from(u8::from(!found.missed.is_empty())))
}
