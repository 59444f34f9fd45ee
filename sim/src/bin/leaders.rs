//! `leaders`: a leader carries children that it does not see; see `coloc_sim::leaders`.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use coloc_sim::campaign::{Page, Part, run};
use coloc_sim::leaders::{Form, find};

/// How far off are children that a leader does not see, and do they know? The thesis's simulation with one leader, cases 1 to 4, with
/// three ways to fuse.
#[derive(Parser)]
struct Args {
    /// What some seconds of one processor are enough for
    #[arg(long)]
    short: bool,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// What it consists of.
const PARTS: [Part<Form>; 1] = [("single", find)];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let form = if args.short {
        Form::short(args.seed)
    } else {
        Form::long(args.seed)
    };
    let page = args.markdown.as_deref().map(|path| Page {
        path,
        mark: "leaders",
    });
    run(&PARTS, &[], &form, page)
}
