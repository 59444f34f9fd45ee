//! The folder that the demo leaves to its user: pictures, summary, the daemons' logs.

use std::path::{Path, PathBuf};

use super::DemoError;
use super::record::Record;
use super::robot_file::name;
use super::summary::Summary;
use crate::comparison::Comparison;
use crate::pictures::{ErrorPoint, PictureError, RobotPath, draw_errors, draw_paths};

/// The folder asked for, or `demo-out`, or the first `demo-out-N` that does not exist.
pub(crate) fn folder(asked: Option<&Path>) -> Result<PathBuf, DemoError> {
    let fresh = || {
        let numbered = (2..).map(|n| PathBuf::from(format!("demo-out-{n}")));
        std::iter::once(PathBuf::from("demo-out"))
            .chain(numbered)
            .find(|path| !path.exists())
    };
    let path = asked.map(Path::to_owned).or_else(fresh).unwrap_or_default();
    std::fs::create_dir_all(&path).map_err(|error| DemoError::files(&path, &error))?;
    Ok(path)
}

/// Draws all paths into one picture and the errors of every robot into one each.
pub(crate) fn draw(
    folder: &Path,
    world: &str,
    records: &[Record],
) -> Result<Vec<PathBuf>, PictureError> {
    let names: Vec<String> = (1..=records.len()).map(name).collect();
    let robots = || {
        names
            .iter()
            .zip(records.iter().map(|record| record.comparisons.as_slice()))
    };
    let paths: Vec<_> = robots()
        .map(|(name, comparisons)| RobotPath { name, comparisons })
        .collect();
    let mut pictures = vec![folder.join("paths.svg")];
    draw_paths(
        &pictures[0],
        &format!("Where the robots were, and where they said they were ({world})"),
        &paths,
    )?;
    for (index, (name, comparisons)) in robots().enumerate() {
        let points: Vec<_> = comparisons.iter().map(error_point).collect();
        let picture = folder.join(format!("errors-{name}.svg"));
        draw_errors(
            &picture,
            &format!("{name}: errors inside of ±3σ ({world})"),
            index,
            &points,
        )?;
        pictures.push(picture);
    }
    Ok(pictures)
}

fn error_point(comparison: &Comparison) -> ErrorPoint {
    ErrorPoint {
        time_s: comparison.time_s,
        error: comparison.error(),
        three_sigma: comparison.three_sigma(),
    }
}

/// Writes the summary as JSON beside the pictures, and returns its text.
pub(crate) fn write_summary(folder: &Path, summary: &Summary) -> Result<String, DemoError> {
    let path = folder.join("summary.json");
    let text =
        serde_json::to_string_pretty(summary).map_err(|error| DemoError::files(&path, &error))?;
    std::fs::write(&path, &text).map_err(|error| DemoError::files(&path, &error))?;
    Ok(text)
}
