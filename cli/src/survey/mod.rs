//! `coloc survey`: where landmarks stand, from a drive that its daemon has recorded.
//!
//! ```text
//! read (recording, robot.toml) ──► coloc_calibrate::survey ──► told (table, [[landmark]])
//! ```

mod args;
mod read;
mod told;

use coloc_calibrate::survey::{Enough, NoSurvey, survey};
use coloc_daemon::config::{Config, ConfigError};
use coloc_daemon::record::{Recording, RecordingError};

pub(crate) use args::SurveyArgs;

use crate::calibrate::{Bar, tell_gaps};
use crate::output::{complain, print};
use crate::result_file::{ResultFile, WriteError};
use crate::status::Status;
use read::{Read, SURE_M, SURE_RAD};

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
enum SurveyError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    NoSurvey(#[from] NoSurvey),
    #[error(
        "the robot was never sure of its pose in this drive, to {SURE_M} m and {SURE_RAD} rad: nothing can begin from there"
    )]
    NeverSure,
    #[error("receiver {0} has no fixes in this drive: {1}")]
    NoReceiver(u16, String),
    #[error("sensor {0} has no sightings of landmarks in this drive: {1}")]
    NoSensor(u16, String),
    #[error(transparent)]
    Write(#[from] WriteError),
    #[error("cannot be written as TOML: {0}")]
    Toml(#[from] toml::ser::Error),
}

/// The whole command.
pub(crate) fn command(args: &SurveyArgs) -> Status {
    found(args).unwrap_or_else(|error| {
        complain(&format!("coloc: {error}"));
        Status::Failed
    })
}

#[allow(clippy::cast_possible_truncation)] // 32 bits, where the program runs.
fn found(args: &SurveyArgs) -> Result<Status, SurveyError> {
    let file = args.write.as_deref().map(ResultFile::prepare_new);
    let file = file.transpose()?;
    let recording = Recording::read(&args.recording)?;
    tell_gaps(&recording.gaps);
    let config = Config::load(&args.config())?;
    let read = Read::new(&recording, &config, args)?;
    let enough = Enough {
        sightings: args.least as usize,
        sigma_m: args.worst,
        ..Enough::default()
    };
    let bar = Bar::new("looking for the landmarks");
    let survey = survey(&read.journey, &enough, &|done| bar.show(done))?;
    drop(bar);
    print(&told::table(&survey, &read));
    if survey.landmarks.iter().all(|it| it.unfit.is_some()) {
        complain("coloc: no landmark was seen well enough");
        return Ok(Status::Failed);
    }
    let text = told::sections(&survey)?;
    match file {
        Some(file) => file.write(text.as_bytes())?,
        None => print(&format!("\n{text}")),
    }
    Ok(Status::Done)
}
