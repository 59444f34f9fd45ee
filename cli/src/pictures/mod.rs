//! Pictures of a run as SVG: axes with units, legends, the same colours everywhere.
//!
//! SVG needs no font files: the text stays text and the viewer draws it.

mod errors;
mod nees;
mod paths;
mod style;

use std::path::{Path, PathBuf};

pub(crate) use errors::{ErrorPoint, draw_errors};
pub(crate) use nees::{NeesCurve, draw_nees};
pub(crate) use paths::{RobotPath, draw_paths};

/// A picture that could not be drawn or written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the picture {path}: {reason}", path = path.display())]
pub(crate) struct PictureError {
    path: PathBuf,
    reason: String,
}

impl PictureError {
    fn new(path: &Path, reason: &impl std::fmt::Display) -> Self {
        Self {
            path: path.to_owned(),
            reason: reason.to_string(),
        }
    }
}
