//! `leaders`: leaders carry children that they do not see; see `coloc_sim::leaders`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, recordings, run};
use coloc_sim::leaders::{Form, single, team, tracked};

/// How far off are children that no leader sees, and do they know? The thesis's simulations with one leader, cases 1 to 4, and with two
/// among the robots of MR.CLAM 1, cases 5 to 8, with four ways to fuse.
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
    /// These parts alone: single, team, tracked
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// What it consists of.
const PARTS: [Part<Form>; 3] = [
    ("single", single::find),
    ("team", team::find),
    ("tracked", tracked::find),
];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let data = recordings(args.data);
    let form = if args.short {
        Form::short(args.seed, data)
    } else {
        Form::long(args.seed, data)
    };
    let page = args.markdown.as_deref().map(|path| Page {
        path,
        mark: "leaders",
    });
    run(&PARTS, &args.only, &form, page)
}
