//! The command line of `coloc calibrate`.

use std::path::PathBuf;

use clap::Args;

/// Finds the numbers of a robot in a drive that its daemon has recorded (`[telemetry] record`): scales of the wheels, track, noises,
/// errors and delays of the receivers, where the antenna is; how surely, and what the drive does not show.
///
/// The first two thirds of the drive are used; on the last one it is tried whether the robot knows better than before where it is.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  coloc calibrate drive.jsonl
  coloc calibrate drive.jsonl --config robot.toml --write found.toml

What is to be driven, in five minutes, with fixes: stand 30 s; 50 m straight ahead at changing speeds; loops to the left, the
same to the right, some narrow, some wide; turn on the spot ten times if it can; stand 30 s. The better the fixes, the more is
shown. What is not shown stays as it is configured, and the drive that shows it is named.

Exit status: 0 something was found, or 1 nothing was, or something could not be read or written, 2 the arguments were not
understood.")]
pub(crate) struct CalibrateArgs {
    /// The recording
    pub(crate) recording: PathBuf,
    /// The configuration with which it was made [default: robot.toml beside the recording]
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Where to write the sections that change, a new file [default: standard output, behind the tables]
    #[arg(long, value_name = "FILE")]
    pub(crate) write: Option<PathBuf>,
    /// How long the wheels are left alone when it is tried, in seconds
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = crate::args::seconds)]
    pub(crate) block: f64,
}

impl CalibrateArgs {
    /// The configuration's file.
    pub(crate) fn config(&self) -> PathBuf {
        let beside = || self.recording.with_file_name("robot.toml");
        self.config.clone().unwrap_or_else(beside)
    }
}
