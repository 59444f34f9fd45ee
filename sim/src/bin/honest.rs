//! `honest`: thousands of simulated robots against what the estimator claims not to know; see `coloc_sim::honest`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, run};
use coloc_sim::honest::{Form, drive, parked, signs, trio, weak};

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
const PARTS: [Part<Form>; 5] = [
    ("drive", drive::find),
    ("weak", weak::find),
    ("signs", signs::find),
    ("trio", trio::find),
    ("parked", parked::find),
];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let form = if args.short {
        Form::short(args.seed)
    } else {
        Form::long(args.seed)
    };
    let page = args.markdown.as_deref().map(|path| Page {
        path,
        mark: "honest",
    });
    run(&PARTS, &args.only, &form, page)
}
