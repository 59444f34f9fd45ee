//! `calibrate`: hundreds of drives of robots whose truth is known; see `coloc_sim::calibrate`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::calibrate::{Form, coverage, refusals};
use coloc_sim::campaign::{Page, Part, run};

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

/// What it consists of.
const PARTS: [Part<Form>; 2] = [("coverage", coverage), ("refusals", refusals)];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let form = Form {
        seed: args.seed,
        drives: args.drives.unwrap_or(if args.short { 12 } else { 200 }),
    };
    let page = args.markdown.as_deref().map(|path| Page {
        path,
        mark: "calibrate",
    });
    run(&PARTS, &[], &form, page)
}
