//! `coloc calibrate`: the numbers of a robot, from a drive that its daemon has recorded.
//!
//! ```text
//! read (recording, robot.toml) ──► coloc_calibrate (two thirds) ──► told, judged (the last third) ──► section (robot.toml)
//! ```

mod args;
mod read;
mod section;
mod told;
mod turns;

use coloc_calibrate::{Fit, Judgement, NoFit, Robot, SampleSize, fit};
use coloc_daemon::config::{Config, ConfigError};
use coloc_daemon::record::{Gaps, Recording, RecordingError};
use indicatif::{ProgressBar, ProgressStyle};

pub(crate) use args::CalibrateArgs;

use crate::output::{complain, print};
use crate::result_file::{ResultFile, WriteError};
use crate::status::Status;
use read::Recorded;

/// Of the drive, what is used.
const USED: f64 = 2.0 / 3.0;

/// Of the progress bar.
const WHOLE: f64 = 1000.0;

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
enum CalibrateError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error("the recording has no odometry: was the daemon hearing its wheels?")]
    NoOdometry,
    #[error(
        "a robot that moves sideways cannot be calibrated yet: set its numbers by hand, see docs/first-robot.md"
    )]
    Sideways,
    #[error(transparent)]
    NoFit(#[from] NoFit),
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error("cannot be written as TOML: {0}")]
    Toml(#[from] toml::ser::Error),
}

/// The whole command.
pub(crate) fn command(args: &CalibrateArgs) -> Status {
    calibrate(args).unwrap_or_else(|error| {
        complain(&format!("coloc: {error}"));
        Status::Failed
    })
}

fn calibrate(args: &CalibrateArgs) -> Result<Status, CalibrateError> {
    let file = args.write.as_deref().map(ResultFile::prepare_new);
    let file = file.transpose()?;
    let recording = Recording::read(&args.recording)?;
    tell_gaps(&recording.gaps);
    let config = Config::load(&args.config())?;
    let recorded = Recorded::new(&recording, &config)?;
    let (begin_s, end_s) = (recorded.drive.begin_s(), recorded.drive.end_s());
    let split_s = begin_s + USED * (end_s - begin_s);
    let used = recorded.drive.until(split_s);
    let bar = Bar::new("looking for the robot");
    let fit = fit(&used, &recorded.start, &|done| bar.show(done))?;
    drop(bar);
    print(&told::shown(&fit.found, &recorded, &used));
    print("\n");
    print(&told::refused(&fit.found, &recorded));
    print("\n");
    let sizes = (0..recorded.sources.len()).map(|it| SampleSize::of(&used, &fit.likely, it));
    print(&told::samples(
        &sizes.collect::<Vec<_>>(),
        &recorded.sources,
    ));
    let judge = |robot: &Robot| Judgement::of(&recorded.drive, robot, split_s, args.block);
    let after = judge(&as_written(&fit, &recorded.before));
    print(&told::judged(
        &judge(&with_heading(&recorded.before, &fit)),
        &after,
        args.block,
    ));
    if !fit.found.iter().any(|it| it.shown) {
        complain("coloc: the drive shows nothing that could be written");
        return Ok(Status::Failed);
    }
    let text = section::sections(&config, &recorded, &fit)?;
    match file {
        Some(file) => file.write(text.as_bytes())?,
        None => print(&format!("\n{text}")),
    }
    Ok(Status::Done)
}

/// What the robot will do with what is written: a slow error that the drive does not show stays as it was.
fn as_written(fit: &Fit, before: &Robot) -> Robot {
    let mut robot = with_heading(&fit.robot, fit);
    let receivers = robot.receivers.iter_mut().zip(&before.receivers);
    for (index, (receiver, before)) in receivers.enumerate() {
        let shown = |it: &&coloc_calibrate::Found| {
            it.shown && it.parameter == coloc_calibrate::Parameter::SlowSigma(index)
        };
        if fit.found.iter().find(shown).is_none() {
            receiver.slow_sigma_m = before.slow_sigma_m;
        }
    }
    robot
}

/// Where it looked at the begin is the drive's.
fn with_heading(robot: &Robot, fit: &Fit) -> Robot {
    Robot {
        heading_rad: fit.likely.heading_rad,
        ..robot.clone()
    }
}

/// What is missing of a recording, on standard error.
pub(crate) fn tell_gaps(gaps: &Gaps) {
    let Gaps { ticks, lines } = *gaps;
    if ticks + lines > 0 {
        complain(&format!(
            "coloc: the recording has gaps: {ticks} ticks are missing and {lines} lines were lost or cannot be read; the rest is used"
        ));
    }
}

/// How far the search is, on standard error if that is a terminal.
pub(crate) struct Bar(ProgressBar);

impl Bar {
    pub(crate) fn new(what: &'static str) -> Self {
        let bar = ProgressBar::new(1000).with_message(what);
        // The template is a constant; a wrong one would leave the usual bar.
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %") {
            bar.set_style(style);
        }
        Self(bar)
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // From 0 to 1.
    pub(crate) fn show(&self, done: f64) {
        self.0.set_position((done * WHOLE) as u64);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
