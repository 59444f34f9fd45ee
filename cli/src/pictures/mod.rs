//! Pictures of a run as SVG: axes with units, legends, the same colours everywhere.
//!
//! SVG needs no font files: the text stays text and the viewer draws it.

mod bars;
mod ellipses;
mod errors;
mod lines;
mod paths;
mod percentiles;
mod png;
mod style;

use std::path::{Path, PathBuf};

pub(crate) use bars::{BarPanel, draw_bars};
pub(crate) use ellipses::{Ellipse, EllipsePanel, draw_ellipses};
pub(crate) use errors::{ErrorPoint, draw_errors};
pub(crate) use lines::{Line, Panel, Scale, draw_lines};
pub(crate) use paths::{RobotPath, draw_paths};
pub(crate) use percentiles::{PercentileCurve, draw_percentiles};
pub(crate) use png::to_png;
pub(crate) use style::method_color;

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
