//! `coloc survey`: where landmarks stand, from a drive that its daemon has recorded.
//!
//! ```text
//! read (recording, robot.toml) ──► coloc_calibrate::survey ──► told (table, [[landmark]])
//! ```

mod args;
mod read;
mod told;

use std::path::PathBuf;

use coloc_calibrate::survey::{Enough, NoSurvey, survey};
use coloc_daemon::config::{Config, ConfigError};
use coloc_daemon::record::{Recording, RecordingError};

pub(crate) use args::SurveyArgs;

use crate::calibrate::{Bar, write_new};
use crate::output::{complain, print};
use crate::status::Status;
use read::Read;

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
enum SurveyError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    NoSurvey(#[from] NoSurvey),
    #[error("cannot write {path}: {reason}", path = .0.display(), reason = .1)]
    Write(PathBuf, std::io::Error),
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
    let recording = Recording::read(&args.recording)?;
    let config = Config::load(&args.config())?;
    let read = Read::new(&recording, &config, args);
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
    match &args.write {
        Some(path) => {
            write_new(path, &text).map_err(|error| SurveyError::Write(path.clone(), error))?;
        }
        None => print(&format!("\n{text}")),
    }
    Ok(Status::Done)
}
