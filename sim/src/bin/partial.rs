//! `partial`: robots that see one another in part; see `coloc_sim::partial`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, recordings, run};
use coloc_sim::partial::{Form, exchange, thesis, tracks};

/// What do robots learn that see one another in part? The robots of MR.CLAM with their own cameras, a filter for each pair of them,
/// and the thesis' simulation of such a filter.
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
    /// These parts alone: exchange, fed, ideas, tracks, thesis
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// What it consists of.
const PARTS: [Part<Form>; 5] = [
    ("exchange", exchange::find),
    ("fed", exchange::find_fed),
    ("ideas", exchange::ideas::find),
    ("tracks", tracks::find),
    ("thesis", thesis::find),
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
        mark: "partial",
    });
    run(&PARTS, &args.only, &form, page)
}
