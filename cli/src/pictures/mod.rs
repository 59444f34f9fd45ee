//! Pictures of a run as SVG: axes with units, legends, the same colours everywhere.
//!
//! SVG needs no font files: the text stays text and the viewer draws it.

mod bars;
mod drives;
mod ellipses;
mod errors;
mod law;
mod legend;
mod lines;
mod paths;
mod percentiles;
#[cfg_attr(not(feature = "png"), path = "no_png.rs")]
mod png;
mod style;
mod window;

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, IntoDrawingArea, SVGBackend};

pub(crate) use bars::{BarPanel, draw_bars};
pub(crate) use drives::{Drive, GLIMPSES, Glimpse, Happening, Words, draw_drives};
pub(crate) use ellipses::{Ellipse, EllipsePanel, Trace, draw_ellipses};
pub(crate) use errors::{ErrorPoint, draw_errors};
pub(crate) use law::{LawPanel, draw_law};
pub(crate) use lines::{Line, Panel, Scale, draw_lines};
pub(crate) use paths::{RobotPath, draw_paths};
pub(crate) use percentiles::{PercentileCurve, draw_percentiles};
pub(crate) use png::{check_fonts, to_png};
pub(crate) use style::method_color;

use crate::result_file::{self, WriteError};

type Failure = Box<dyn std::error::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Draws in memory, then writes: a picture is whole, or as it was before.
fn write_svg(
    file: &Path,
    size_px: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), Failure>,
) -> Result<(), WriteError> {
    write_fine_svg(file, size_px, 1, draw)
}

/// The same, drawn in so many times as many units a pixel in both directions.
fn write_fine_svg(
    file: &Path,
    size: (u32, u32),
    fine: u32,
    draw: impl FnOnce(&Area<'_>) -> Result<(), Failure>,
) -> Result<(), WriteError> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    let drawn = draw(&area).and_then(|()| Ok(area.present()?));
    drop(area);
    drawn.map_err(|error| WriteError::new(file, &error))?;
    result_file::write(file, slim(&shown_smaller(&text, size, fine)).as_bytes())
}

fn shown_smaller(svg: &str, (width, height): (u32, u32), fine: u32) -> String {
    let sized = |width, height| format!("<svg width=\"{width}\" height=\"{height}\"");
    svg.replacen(
        &sized(width, height),
        &sized(width / fine, height / fine),
        1,
    )
}

/// Without what says no more than the default, which is half of every dot.
fn slim(svg: &str) -> String {
    svg.replace(" opacity=\"1\"", "")
        .replace(" stroke=\"none\" stroke-width=\"1\"", "")
}
