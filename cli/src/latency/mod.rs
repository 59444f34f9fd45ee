//! `coloc latency`: how long after an encoder frame is the new estimate in another program's hands, and where does it go?
//!
//! ```text
//! sender ──► encoder frames, fixes, sightings, neighbours ──► colocd ──► estimates ──► reader (another process)
//!   └── when each frame was due ──────────────► matched ◄── when each estimate arrived ──┘
//! ```
//!
//! * **Open loop.** The sender keeps to absolute deadlines whatever the daemon does, and every frame is charged from the
//!   moment it was due to the first estimate that contains it. A stall counts once for each frame that it delayed.
//! * **Floors in the same run**: the wake-up and read of a frame with nothing behind it, and a Unix datagram of as many bytes
//!   between two processes, on the same processors at the same rate; with `--plain` a whole program in C.
//! * **A run that others disturbed says so**: who else had the processors, and whether the figures are worth comparing.

mod args;
mod busy;
mod error;
mod facts;
mod floors;
mod interrupted;
mod load;
mod matching;
mod pass;
mod percentiles;
mod place;
mod placement;
mod plain;
mod reader;
mod report;
mod robot_file;
mod sender;
mod show;

use std::path::PathBuf;

use crate::demo::bus::Buses;
use crate::output::{complain, takes_no_more};
use crate::pictures::{PercentileCurve, draw_percentiles};
use crate::result_file::{ResultFile, WriteError};
use crate::status::Status;
use args::CanArg;
pub(crate) use args::{LatencyArgs, ReaderArgs};
use error::LatencyError;
use facts::Facts;
use load::Load;
use pass::{Pass, Setting};
use place::home;
use report::Report;

/// The whole command.
pub(crate) fn command(args: &LatencyArgs) -> Status {
    finish(measure(args))
}

/// The process that reads the estimates.
pub(crate) fn reader(args: &ReaderArgs) -> Status {
    finish(reader::run(args))
}

fn finish(result: Result<(), LatencyError>) -> Status {
    let Err(error) = result else {
        return Status::Done;
    };
    complain(&format!("coloc: {error}"));
    interrupted::signal().map_or(Status::Failed, Status::Interrupted)
}

fn measure(args: &LatencyArgs) -> Result<(), LatencyError> {
    interrupted::catch()?;
    let outputs = Outputs::prepare(args)?;
    let home = home()?;
    // While there is one thread only.
    let count = if args.two_buses { 2 } else { 1 };
    let buses = match args.can {
        CanArg::Auto => Buses::choose(count, home.path()),
        CanArg::Vcan => Buses::kernels(count).map_err(LatencyError::Bus)?,
        CanArg::Local => Buses::local(count, home.path(), "asked for".into()),
    };
    buses.check(&home)?;
    let setting = Setting::new(args, &home, &buses)?;
    let _load = Load::start(args.load)?;
    let mut report = Report::new(Facts::gather(), args, &buses);
    let measured = measure_passes(args, &setting, &mut report);
    if report.passes.is_empty() {
        return measured;
    }
    show::end(&report);
    // What was measured before something went wrong is not lost.
    let written = outputs.write(&report);
    measured.and(written.map_err(Into::into))
}

fn measure_passes(
    args: &LatencyArgs,
    setting: &Setting,
    report: &mut Report,
) -> Result<(), LatencyError> {
    for &mode in &args.wait {
        if takes_no_more() && args.json.is_none() && args.plot.is_none() {
            break;
        }
        complain(&format!(
            "measuring for {:.0} s: {}",
            if args.plain { 2.5 } else { 2.0 } * args.seconds,
            mode.describe()
        ));
        let pass = pass::run(setting, mode)?;
        show::pass(&pass);
        report.passes.push(pass);
    }
    Ok(())
}

/// What the command was asked to write, tried before anything is measured.
struct Outputs {
    json: Option<ResultFile>,
    plot: Option<PathBuf>,
}

impl Outputs {
    fn prepare(args: &LatencyArgs) -> Result<Self, WriteError> {
        let try_out = |path: &PathBuf| ResultFile::prepare(path);
        let plot = args.plot.as_ref().map(try_out).transpose()?;
        let json = args.json.as_ref().map(try_out).transpose()?;
        if let (Some(plot), Some(json)) = (plot, &json) {
            plot.check_apart(json)?;
        }
        Ok(Self {
            json,
            plot: args.plot.clone(),
        })
    }

    /// Writes both, whatever became of the other.
    fn write(&self, report: &Report) -> Result<(), WriteError> {
        let json = self
            .json
            .as_ref()
            .map_or(Ok(()), |file| file.write(report.text().as_bytes()));
        let plot = self.plot.as_ref().map_or(Ok(()), |path| {
            draw_percentiles(path, &report.title(), &curves(&report.passes))
        });
        json.and(plot)
    }
}

fn curves(passes: &[Pass]) -> Vec<PercentileCurve> {
    passes.iter().flat_map(Pass::curves).collect()
}
