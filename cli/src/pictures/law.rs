//! A quantity over another one, from the smallest to the largest by factors of ten.

use std::path::Path;

use plotters::coord::combinators::LogCoord;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

use super::style::{GRID, INK, extent, line, robot_color, tick_label};
use super::{Area, Failure, write_svg};
use crate::result_file::WriteError;

const WIDTH_PX: u32 = 1000;
const CAPTION_PX: u32 = 36;
const PANEL_PX: u32 = 260;
/// What grows less than this is drawn from zero.
const DECADE: f64 = 10.0;

/// One panel: points of positive numbers, by the first of them.
pub(crate) struct LawPanel {
    pub(crate) y_axis: &'static str,
    pub(crate) points: Vec<(f64, f64)>,
}

/// Draws `panels` under one another, all over `x_axis`.
#[allow(clippy::cast_possible_truncation)] // A few panels.
pub(crate) fn draw_law(
    file: &Path,
    caption: &str,
    x_axis: &str,
    panels: &[LawPanel],
) -> Result<(), WriteError> {
    let size = (WIDTH_PX, CAPTION_PX + PANEL_PX * panels.len() as u32);
    write_svg(file, size, |area| {
        area.fill(&WHITE)?;
        let (title, rest) = area.split_vertically(CAPTION_PX);
        let font = ("sans-serif", 20).into_font().color(&INK);
        title.draw(&Text::new(caption.to_owned(), (10, 10), font))?;
        let places = rest.split_evenly((panels.len(), 1));
        let mut pairs = places.iter().zip(panels);
        pairs.try_for_each(|(place, panel)| draw_panel(place, x_axis, panel))
    })
}

fn draw_panel(place: &Area<'_>, x_axis: &str, panel: &LawPanel) -> Result<(), Failure> {
    let (left, right) = extent(panel.points.iter().map(|point| point.0));
    let (low, high) = extent(panel.points.iter().map(|point| point.1));
    let x = (left / 1.3..right * 1.3).log_scale();
    let mut builder = ChartBuilder::on(place);
    builder
        .margin(8)
        .margin_right(20)
        .x_label_area_size(40)
        .y_label_area_size(70);
    if high < DECADE * low {
        let chart = builder.build_cartesian_2d(x, 0.0..1.15 * high)?;
        fill(chart, x_axis, panel)
    } else {
        let chart = builder.build_cartesian_2d(x, (low / 1.5..high * 1.5).log_scale())?;
        fill(chart, x_axis, panel)
    }
}

type Chart<'a, Y> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<LogCoord<f64>, Y>>;

fn fill<Y>(mut chart: Chart<'_, Y>, x_axis: &str, panel: &LawPanel) -> Result<(), Failure>
where
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .x_desc(x_axis)
        .y_desc(panel.y_axis)
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .y_labels(6)
        .draw()?;
    let color = robot_color(0);
    chart.draw_series(LineSeries::new(
        panel.points.iter().copied(),
        line(color, 2),
    ))?;
    let dots = panel.points.iter();
    chart.draw_series(dots.map(|&point| Circle::new(point, 4, color.filled())))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_drawn_and_every_axis_is_named() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("law.svg");
        let panel = |y_axis, points: [(f64, f64); 3]| LawPanel {
            y_axis,
            points: points.into(),
        };
        let panels = [
            panel("flat", [(10.0, 800.0), (100.0, 900.0), (1000.0, 1600.0)]),
            panel("steep", [(10.0, 0.1), (100.0, 1.0), (1000.0, 20.0)]),
        ];
        draw_law(&file, "A law", "robots", &panels).unwrap();
        let svg = std::fs::read_to_string(file).unwrap();
        for text in ["A law", "robots", "flat", "steep"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert_eq!(svg.matches("<circle").count(), 6);
    }
}
