//! `uwb`: robots with ranging radios; see `coloc_sim::uwb`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, recordings, run};
use coloc_sim::uwb::{Form, plaza, radio};

/// What do ranging radios say too much, and how well do robots know where they are by them?
#[derive(Parser)]
struct Args {
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The folder with recordings; else `COLOC_DATA`, else `shared/data` beside the repository or above
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// These parts alone: plaza, radio
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// What it consists of.
const PARTS: [Part<Form>; 2] = [("plaza", plaza::find), ("radio", radio::find)];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let data = recordings(args.data);
    let form = Form::new(args.seed, data);
    let page = args
        .markdown
        .as_deref()
        .map(|path| Page { path, mark: "uwb" });
    run(&PARTS, &args.only, &form, page)
}
