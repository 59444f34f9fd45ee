//! `integrity`: the monitor of hard bounds, on recorded drives; see `coloc_sim::integrity`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, recordings, run};
use coloc_sim::integrity::{
    Form, alone, contain, drift, faults, lies, means, paper, picture, usual,
};

/// Is the truth inside of the region of the hard bounds, how large is that, and how soon is who lies found?
#[derive(Parser)]
struct Args {
    /// What some seconds of one processor are enough for
    #[arg(long)]
    short: bool,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many runs of each recording with honest robots, instead of 4, or 1 with --short
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    runs: Option<u16>,
    /// The folder with recordings; else `COLOC_DATA`, else `shared/data` beside the repository or above
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// These parts alone: contain, promised, means, lies, faults, drift, alone, usual, paper
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Draw the pictures of the paper's experiments into this folder, and do nothing else
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// What it consists of.
const PARTS: [Part<Form>; 9] = [
    ("contain", contain::find),
    ("promised", contain::promised),
    ("means", means::find),
    ("lies", lies::find),
    ("faults", faults::find),
    ("drift", drift::find),
    ("alone", alone::find),
    ("usual", usual::find),
    ("paper", paper::find),
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
    if let Some(folder) = args.pictures {
        picture::draw(&form, &folder)?;
        return Ok(ExitCode::SUCCESS);
    }
    let page = args.markdown.as_deref().map(|path| Page {
        path,
        mark: "integrity",
    });
    run(&PARTS, &args.only, &form, page)
}
