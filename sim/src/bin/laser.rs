//! `laser`: robots in recorded rooms; see `coloc_sim::laser`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, recordings, run};
use coloc_sim::laser::{Form, find, picture};

/// Are robots found in laser scans, with their right names and honest errors?
#[derive(Parser)]
struct Args {
    /// What some seconds of one processor are enough for
    #[arg(long)]
    short: bool,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The folder with recordings; else `COLOC_DATA`, else `shared/data` beside the repository or above
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Write the table between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Draw one scan into this file, and do nothing else
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// So many robots are named in the scan that is drawn.
const NAMED: usize = 4;

/// What it consists of.
const PARTS: [Part<Form>; 1] = [("rooms", find)];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let data = recordings(args.data);
    if let Some(path) = args.picture {
        let data = data.ok_or("there are no recordings")?;
        std::fs::write(path, picture(&data, args.seed, NAMED)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let form = if args.short {
        Form::short(args.seed, data)
    } else {
        Form::long(args.seed, data)
    };
    let page = args.markdown.as_deref().map(|path| Page {
        path,
        mark: "laser",
    });
    run(&PARTS, &[], &form, page)
}
