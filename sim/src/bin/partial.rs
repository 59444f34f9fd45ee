//! `partial`: robots that see one another in part; see `coloc_sim::partial`.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{Write as _, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use coloc_sim::honest::{Finding, splice};
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
    /// These parts alone: exchange, tracks, thesis
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// What it consists of.
type Part = (&'static str, fn(&Form) -> Finding);

const PARTS: [Part; 3] = [
    ("exchange", exchange::find),
    ("tracks", tracks::find),
    ("thesis", thesis::find),
];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    if let Some(name) = unknown(&args.only) {
        return Err(format!("there is no part {name}").into());
    }
    let data = args.data.or_else(recordings);
    let form = if args.short {
        Form::short(args.seed, data)
    } else {
        Form::long(args.seed, data)
    };
    let (mut text, mut missed) = (String::new(), 0);
    let is_chosen = |name: &str| args.only.is_empty() || args.only.iter().any(|it| it == name);
    for (_, find) in PARTS.into_iter().filter(|it| is_chosen(it.0)) {
        let begun = Instant::now();
        let finding = find(&form);
        missed += finding.missed.len();
        let words = told(&finding);
        writeln!(
            stdout(),
            "{words}It took {} s.\n",
            begun.elapsed().as_secs()
        )?;
        text.push_str(&words);
    }
    if let Some(path) = &args.markdown {
        splice::write(path, "partial", &text)?;
    }
    writeln!(stdout(), "{missed} bars missed")?;
    Ok(ExitCode::from(u8::from(missed > 0)))
}

fn unknown(only: &[String]) -> Option<&String> {
    only.iter()
        .find(|name| PARTS.iter().all(|(part, _)| part != name))
}

fn recordings() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("COLOC_DATA") {
        return Some(given.into());
    }
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let mut candidates = above.map(|parent| parent.join("shared/data"));
    candidates.find(|it| it.is_dir())
}

fn told(finding: &Finding) -> String {
    let Finding {
        title,
        text,
        missed,
    } = finding;
    let mut told = format!("### {title}\n\n{text}\n");
    for it in missed {
        let _ = writeln!(told, "* MISSED: {it}"); // A string takes all.
    }
    if missed.is_empty() {
        told.push_str("All bars held.\n");
    }
    told.push('\n');
    told
}
