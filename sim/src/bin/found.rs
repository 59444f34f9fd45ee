//! `found`: thousands of simulated robots that do not know where they are, are carried, or are lied to; see `coloc_sim::found`.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{Write as _, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use coloc_sim::found::{Form, Found, Honesty, PARTS, Part};
use coloc_sim::honest::splice::{self, spliced};

/// Is a robot found that does not know where it is? Does it notice that it was carried, and does a liar never win?
#[derive(Parser)]
struct Args {
    /// What a minute of one processor is enough for
    #[arg(long)]
    short: bool,
    /// Where all chance comes from
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// These parts alone: start, carried, outage, liar, alone, honest, exact
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Rows alone whose names contain this
    #[arg(long, value_name = "WORDS")]
    row: Option<String>,
    /// No more robots of a row than this
    #[arg(long, value_name = "NUMBER")]
    robots: Option<usize>,
    /// This robot alone: tell what is decided
    #[arg(long, value_name = "NUMBER")]
    robot: Option<usize>,
    /// Write the tables between the marks of this document
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let parts = chosen(&args.only)?;
    let form = form(&args);
    if let Some(path) = &args.markdown {
        spliced(path, "found", "")?;
    }
    let (mut text, mut missed, mut honesty) = (String::new(), 0, Honesty::default());
    for part in parts {
        let begun = Instant::now();
        let found = part.run(&form);
        let words = told(&found, begun.elapsed().as_secs());
        stdout().write_all(words.as_bytes())?;
        text.push_str(&words);
        missed += found.missed.len();
        honesty = honesty.and(&found.honesty);
    }
    let all = format!("NEES of all parts together: {}.\n", honesty.text());
    stdout().write_all(all.as_bytes())?;
    text.push_str(&all);
    if let Some(path) = &args.markdown {
        splice::write(path, "found", &text)?;
    }
    writeln!(stdout(), "{missed} bars missed")?;
    Ok(ExitCode::from(u8::from(missed > 0)))
}

fn form(args: &Args) -> Form {
    let form = if args.short {
        Form::short(args.seed)
    } else {
        Form::long(args.seed)
    };
    Form {
        row: args.row.clone(),
        robot: args.robot,
        at_most: args.robots.unwrap_or(form.at_most),
        ..form
    }
}

fn chosen(only: &[String]) -> Result<Vec<Part>, String> {
    let unknown = only
        .iter()
        .find(|name| PARTS.iter().all(|part| part.name != *name));
    if let Some(name) = unknown {
        return Err(format!("there is no part {name}"));
    }
    let is_chosen = |part: &Part| only.is_empty() || only.iter().any(|it| it == part.name);
    Ok(PARTS.into_iter().filter(is_chosen).collect())
}

fn told(found: &Found, took_s: u64) -> String {
    let Found {
        title,
        text,
        missed,
        known,
        ..
    } = found;
    let mut verdict = String::new();
    for it in missed {
        // A string takes all.
        let _ = writeln!(verdict, "* MISSED: {it}");
    }
    for it in known {
        let _ = writeln!(verdict, "* MISSED, as is known: {it}");
    }
    if missed.is_empty() && known.is_empty() {
        verdict.push_str("All bars held.\n");
    }
    format!("### {title}\n\n{text}\n{verdict}\nIt took {took_s} s.\n\n")
}
