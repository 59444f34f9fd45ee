//! `coloc eval`: how accurate every method is on the same data, and whether its uncertainty is honest.

mod plots;
mod table;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use coloc_sim::SyntheticConfig;
use coloc_sim::evaluate::{EvalConfig, EvalError, EvalReport, EvalWorld, evaluate};
use coloc_sim::mrclam::{ReadError, Recording};
use indicatif::{ProgressBar, ProgressStyle};

use crate::args::EvalArgs;
use crate::output::print_line;
use crate::pictures::PictureError;

/// Why there is no evaluation.
#[derive(Debug, thiserror::Error)]
enum Error {
    #[error(transparent)]
    Recording(#[from] ReadError),
    #[error(transparent)]
    Evaluation(#[from] EvalError),
    #[error("cannot write {path}: {reason}", path = path.display())]
    Write { path: PathBuf, reason: String },
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// The whole command.
pub(crate) fn command(args: &EvalArgs) -> ExitCode {
    match run(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("coloc: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &EvalArgs) -> Result<(), Error> {
    let report = evaluate_with_progress(&config(args)?)?;
    print_line(&table::lines(&report).join("\n"));
    if let Some(path) = &args.json {
        write_json(path, &report)?;
    }
    if let Some(folder) = &args.plots {
        std::fs::create_dir_all(folder).map_err(|error| cannot_write(folder, &error))?;
        let count = plots::draw(folder, &report)?;
        print_line(&format!("{count} pictures are in {}", folder.display()));
    }
    Ok(())
}

fn config(args: &EvalArgs) -> Result<EvalConfig, Error> {
    let world = match &args.data {
        Some(folder) => EvalWorld::Recorded(Arc::new(Recording::load(folder)?.resample())),
        None => EvalWorld::Synthetic(SyntheticConfig {
            seconds: args.seconds.unwrap_or(1500.0),
            ..SyntheticConfig::default()
        }),
    };
    Ok(EvalConfig {
        scenario: args.scenario.clone(),
        methods: args.methods.clone(),
        runs: args.runs,
        seed: args.seed,
        seconds: args.seconds,
        ..EvalConfig::new(world)
    })
}

/// The bar goes to standard error, and only to a terminal.
fn evaluate_with_progress(config: &EvalConfig) -> Result<EvalReport, Error> {
    let bar = ProgressBar::new(0);
    if let Ok(style) =
        ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} gone, {eta} to go")
    {
        bar.set_style(style);
    }
    let report = evaluate(config, &|progress| {
        bar.set_length(progress.total);
        bar.set_position(progress.done);
    });
    bar.finish_and_clear();
    Ok(report?)
}

fn write_json(path: &Path, report: &EvalReport) -> Result<(), Error> {
    let text = serde_json::to_string(report).map_err(|error| cannot_write(path, &error))?;
    std::fs::write(path, text).map_err(|error| cannot_write(path, &error))
}

fn cannot_write(path: &Path, reason: &impl std::fmt::Display) -> Error {
    Error::Write {
        path: path.to_owned(),
        reason: reason.to_string(),
    }
}
