//! The command line of `coloc survey`.

use std::path::PathBuf;

use clap::Args;

/// Learns where landmarks stand from a drive with fixes that the daemon has recorded (`[telemetry] record`), by least squares over the
/// whole drive, and writes them as `[[landmark]]` sections for robot.toml.
///
/// What was not seen well enough is left out, under its reason; sightings that are far off are left out too.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  coloc survey drive.jsonl
  coloc survey drive.jsonl --config robot.toml --write landmarks.toml

What is to be driven: past every landmark, several times, in different directions and at different times, with fixes. A landmark
that is not known yet is listed so that it is heard, and counts for nothing:
  [sighting]
  heard = true
  [[landmark]]
  number = 6
  position = [0.0, 0.0]
  sigma_m = 1e6

Exit status: 0 something was found, or 1 nothing was, or something could not be read or written, 2 the arguments were not
understood.")]
pub(crate) struct SurveyArgs {
    /// The recording
    pub(crate) recording: PathBuf,
    /// The configuration with which it was made [default: robot.toml beside the recording]
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Where to write the sections, a new file [default: standard output, behind the table]
    #[arg(long, value_name = "FILE")]
    pub(crate) write: Option<PathBuf>,
    /// Which sensor of sightings, by the number in its messages [default: the one that saw most]
    #[arg(long, value_name = "N")]
    pub(crate) sensor: Option<u16>,
    /// Which receiver, by the number in its messages [default: the one with most fixes]
    #[arg(long, value_name = "N")]
    pub(crate) receiver: Option<u16>,
    /// How long the sensor's slow errors last, in seconds
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = crate::args::seconds)]
    pub(crate) slow_time: f64,
    /// How much of its slow errors the sensor makes about each landmark for itself, beside what is the same for all in an image
    #[arg(long, value_name = "PART", default_value_t = 1.0, value_parser = part)]
    pub(crate) own: f64,
    /// What the sensor errs by about each landmark for the whole drive, as a part of its slow errors: it does not average out
    #[arg(long, value_name = "PART", default_value_t = 0.3, value_parser = part)]
    pub(crate) stays: f64,
    /// A landmark that is not known to this is left out: σ along its ellipse's longer axis, in metres
    #[arg(long, value_name = "M", default_value_t = 0.25, value_parser = metres)]
    pub(crate) worst: f64,
    /// So many sightings at least have to agree
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) least: u32,
}

fn part(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|part| (0.0..=10.0).contains(part))
        .ok_or_else(|| "must be a number, 0 to 10".into())
}

fn metres(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|metres| (1e-3..=1e3).contains(metres))
        .ok_or_else(|| "must be a number of metres, 0.001 to 1000".into())
}

impl SurveyArgs {
    /// The configuration's file.
    pub(crate) fn config(&self) -> PathBuf {
        let beside = || self.recording.with_file_name("robot.toml");
        self.config.clone().unwrap_or_else(beside)
    }
}
