//! The folder that the demo leaves to its user: pictures, summary, the daemons' logs.

use std::path::{Path, PathBuf};

use coloc_shm_types::BeliefState;

use super::record::Record;
use super::robot_file::name;
use super::summary::Summary;
use super::tale::EVENT_S;
use super::world::Stage;
use crate::comparison::Moment;
use crate::pictures::{Drive, ErrorPoint, Happening, Words, draw_drives, draw_errors};
use crate::result_file::{ResultFile, WriteError, prepare_folder};

/// A folder that was tried before the robots started.
pub(crate) struct Out {
    folder: PathBuf,
    summary_path: PathBuf,
    summary: ResultFile,
}

impl Out {
    /// The folder asked for, or `demo-out`, or the first `demo-out-N` that does not exist.
    pub(crate) fn prepare(asked: Option<&Path>) -> Result<Self, WriteError> {
        let folder = asked.map_or_else(fresh, Path::to_owned);
        prepare_folder(&folder)?;
        prepare_folder(&folder.join("logs"))?;
        let summary_path = folder.join("summary.json");
        Ok(Self {
            summary: ResultFile::prepare(&summary_path)?,
            summary_path,
            folder,
        })
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where the daemons' logs go.
    pub(crate) fn logs(&self) -> PathBuf {
        self.folder.join("logs")
    }

    /// Draws all paths into one picture and the errors of every robot into one each, as far as that goes. Says which are there.
    pub(crate) fn draw(
        &self,
        stage: &Stage,
        records: &[Record],
    ) -> (Vec<PathBuf>, Result<(), WriteError>) {
        let robots = records.iter().enumerate();
        let errors =
            robots.map(|(robot, record)| self.draw_errors(stage.description(), robot, record));
        let (mut drawn, mut result) = (Vec::new(), Ok(()));
        for picture in std::iter::once(self.draw_paths(stage, records)).chain(errors) {
            match picture {
                Ok(file) => drawn.push(file),
                Err(error) => result = result.and(Err(error)),
            }
        }
        (drawn, result)
    }

    fn draw_paths(&self, stage: &Stage, records: &[Record]) -> Result<PathBuf, WriteError> {
        let names: Vec<String> = (1..=records.len()).map(name).collect();
        let robots = names.iter().zip(records).enumerate();
        let drives: Vec<_> = robots
            .map(|(robot, (name, record))| Drive {
                name,
                note: note(stage, robot, record),
                pieces: record.pieces(),
                happening: happening(stage, robot, record),
            })
            .collect();
        let file = self.folder.join("paths.svg");
        let caption = format!(
            "Where the robots were, and where they said they were ({})",
            stage.description()
        );
        let words = Words {
            caption: &caption,
            story: &stage.story(),
        };
        let times = records.iter().filter_map(Record::latest_comparison);
        let until_s = times.map(|c| c.time_s).fold(0.0, f64::max);
        draw_drives(&file, &words, &drives, &stage.glimpses(until_s, records)).map(|()| file)
    }

    fn draw_errors(
        &self,
        world: &str,
        robot: usize,
        record: &Record,
    ) -> Result<PathBuf, WriteError> {
        let name = name(robot + 1);
        let pieces: Vec<Vec<ErrorPoint>> = record
            .pieces()
            .into_iter()
            .map(|piece| piece.iter().map(error_point).collect())
            .collect();
        let file = self.folder.join(format!("errors-{name}.svg"));
        let caption =
            format!("{name}: estimate minus truth, and the ±3σ that it claimed ({world})");
        draw_errors(&file, &caption, robot, &pieces).map(|()| file)
    }

    /// Writes the summary as JSON beside the pictures, and returns its text.
    pub(crate) fn write_summary(&self, summary: &Summary) -> (String, Result<(), WriteError>) {
        match serde_json::to_string_pretty(summary) {
            Ok(text) => {
                let written = self.summary.write(text.as_bytes());
                (text, written)
            }
            Err(error) => (
                String::new(),
                Err(WriteError::new(&self.summary_path, &error)),
            ),
        }
    }
}

fn fresh() -> PathBuf {
    let numbered = (2..).map(|n| PathBuf::from(format!("demo-out-{n}")));
    std::iter::once(PathBuf::from("demo-out"))
        .chain(numbered)
        .find(|path| !path.exists())
        .unwrap_or_default()
}

/// What a robot has to go by, and how far that takes it.
fn note(stage: &Stage, robot: usize, record: &Record) -> String {
    let metres = |error: Option<[f64; 3]>| {
        error.map_or("?".into(), |[x, y, _]| format!("{:.2} m", x.hypot(y)))
    };
    let help = stage.parts()[robot].help.words();
    format!(
        "{}: error {} rms, wheels alone {}",
        stage.tale(robot).map_or(help, |tale| tale.words()),
        metres(record.accuracy().map(|it| it.rms_error)),
        metres(record.rms_error_of_wheels())
    )
}

/// What the picture shows of what happens to the robot.
fn happening(stage: &Stage, robot: usize, record: &Record) -> Option<Happening> {
    let until_s = record.latest_comparison()?.time_s;
    let tale = stage.tale(robot)?;
    Some(Happening {
        what: tale.event().map(|what| (EVENT_S, what)),
        lies: stage.lies(robot, until_s),
    })
}

fn error_point(moment: &Moment) -> ErrorPoint {
    let comparison = &moment.comparison;
    ErrorPoint {
        time_s: comparison.time_s,
        error: comparison.error(),
        three_sigma: comparison.three_sigma(),
        knows: moment.state == BeliefState::Ok,
    }
}
