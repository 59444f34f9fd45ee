//! `rounds`: teams with a joint filter in rounds; see `coloc_sim::rounds`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, recordings, run};
use coloc_sim::rounds::{Form, accuracy, flights, trouble};

/// How accurate and honest is a joint filter in rounds, and is it one, whatever goes wrong?
#[derive(Parser)]
struct Args {
    /// What a minute or two of one processor is enough for
    #[arg(long)]
    short: bool,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many runs, instead of 20, or 2 with --short
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    runs: Option<u16>,
    /// The folder with recordings; else `COLOC_DATA`, else `shared/data` beside the repository or above
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// These parts alone: trouble, accuracy, one, flown, flown-one, flights
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// What it consists of.
const PARTS: [Part<Form>; 6] = [
    ("trouble", trouble::find),
    ("accuracy", accuracy::find),
    ("one", accuracy::one),
    ("flown", accuracy::flown),
    ("flown-one", accuracy::flown_one),
    ("flights", flights::find),
];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let data = recordings(args.data);
    let mut form = if args.short {
        Form::short(args.seed, data)
    } else {
        Form::long(args.seed, data)
    };
    form.runs = args.runs.unwrap_or(form.runs);
    let page = args.markdown.as_deref().map(|path| Page {
        path,
        mark: "rounds",
    });
    run(&PARTS, &args.only, &form, page)
}
