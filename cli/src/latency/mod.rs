//! `coloc latency`: how long after an encoder frame is the new estimate in another program's hands, and where does it go?
//!
//! ```text
//! sender ──► encoder frames, fixes, sightings, neighbours ──► colocd ──► estimates ──► reader (another process)
//!   └── when each frame was due ──────────────► matched ◄── when each estimate arrived ──┘
//! ```
//!
//! * **Open loop.** The sender keeps to absolute deadlines whatever the daemon does, and every frame is charged from the
//!   moment it was due to the first estimate that contains it. A stall counts once for each frame that it delayed.
//! * **Floors in the same run**: the wake-up and read of a frame with nothing behind it, and the bare transport of the same
//!   message between two processes, on the same processors at the same rate.

mod args;
mod facts;
mod floors;
mod load;
mod matching;
mod pass;
mod percentiles;
mod placement;
mod reader;
mod report;
mod robot_file;
mod sender;
mod show;

use std::fmt::Display;
use std::path::Path;
use std::process::ExitCode;

use crate::demo::bus::Buses;
use crate::pictures::{PercentileCurve, PictureError, draw_percentiles};
use args::{CanArg, WaitArg};
pub(crate) use args::{LatencyArgs, ReaderArgs};
use facts::Facts;
use load::Load;
use pass::{Pass, Setting};
use report::Report;

/// Begins the name of every file of this command in shared memory.
const PREFIX: &str = "coloclat";

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LatencyError {
    #[error("{0}")]
    Files(String),
    #[error("shared memory: {0}")]
    Shm(String),
    #[error("CAN: {0}")]
    Bus(String),
    #[error("cannot start {0}")]
    Spawn(String),
    #[error("the daemon did not come up: {0}")]
    NotUp(String),
    #[error("the {0} broke down")]
    Thread(&'static str),
    #[error("the reader's answer makes no sense: {0}")]
    Reader(String),
    #[error(transparent)]
    Picture(#[from] PictureError),
}

impl LatencyError {
    fn files(path: &Path, reason: &dyn Display) -> Self {
        Self::Files(format!("cannot write {}: {reason}", path.display()))
    }

    #[allow(clippy::needless_pass_by_value)] // For `map_err`.
    fn shm(reason: impl Display) -> Self {
        Self::Shm(reason.to_string())
    }

    #[allow(clippy::needless_pass_by_value)] // For `map_err`.
    fn bus(reason: impl Display) -> Self {
        Self::Bus(reason.to_string())
    }
}

/// The whole command.
pub(crate) fn command(args: &LatencyArgs) -> ExitCode {
    finish(measure(args))
}

/// The process that reads the estimates.
pub(crate) fn reader(args: &ReaderArgs) -> ExitCode {
    finish(reader::run(args))
}

fn finish(result: Result<(), LatencyError>) -> ExitCode {
    let Err(error) = result else {
        return ExitCode::SUCCESS;
    };
    eprintln!("coloc: {error}");
    ExitCode::FAILURE
}

fn measure(args: &LatencyArgs) -> Result<(), LatencyError> {
    let directory = tempfile::Builder::new()
        .prefix("coloc-latency-")
        .tempdir()
        .map_err(|error| LatencyError::Files(format!("no temporary directory: {error}")))?;
    // While there is one thread only.
    let buses = match args.can {
        CanArg::Auto => Buses::choose(1, directory.path()),
        CanArg::Vcan => Buses::kernels(1).map_err(LatencyError::Bus)?,
        CanArg::Local => Buses::local(1, directory.path(), "asked for".into()),
    };
    let setting = Setting::new(args, directory.path(), &buses)?;
    let _load = Load::start(args.load);
    let mut report = Report::new(Facts::gather(), args, &buses);
    for mode in [WaitArg::Poll, WaitArg::Sleep] {
        if args.wait.is_none_or(|only| only == mode) {
            eprintln!("measuring: {}", mode.describe());
            let pass = pass::run(&setting, mode)?;
            show::pass(&pass);
            report.passes.push(pass);
        }
    }
    show::end(&report);
    if let Some(path) = &args.json {
        report.write(path)?;
    }
    if let Some(path) = &args.plot {
        draw_percentiles(path, &report.title(), &curves(&report.passes))?;
    }
    Ok(())
}

fn curves(passes: &[Pass]) -> Vec<PercentileCurve> {
    passes.iter().flat_map(Pass::curves).collect()
}
