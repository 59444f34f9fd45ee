//! `gyro`: hundreds of simulated robots with a gyro; see `coloc_sim::gyro`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, run};
use coloc_sim::gyro::{Form, find};

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

/// What it consists of.
const PARTS: [Part<Form>; 1] = [("rows", find)];

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
    let page = args
        .markdown
        .as_deref()
        .map(|path| Page { path, mark: "gyro" });
    run(&PARTS, &[], &form, page)
}
