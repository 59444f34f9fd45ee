//! A robot's errors inside their ±3σ bounds: three panels under one another, x, y and heading over time.

use std::path::Path;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::style::{GRID, INK, extent, line, robot_color, thinned, tick_label};
use super::{Area, Failure, write_svg};
use crate::result_file::WriteError;

const SIZE_PX: (u32, u32) = (1000, 800);
const CAPTION_PX: u32 = 36;
const MOST_POINTS: usize = 3000;
const BOUND_RED: RGBColor = RGBColor(190, 60, 60);
const AXES: [&str; 3] = ["x error [m]", "y error [m]", "heading error [rad]"];

/// An error and its bound, at a moment.
#[derive(Copy, Clone, Debug)]
pub(crate) struct ErrorPoint {
    /// \[s\]
    pub(crate) time_s: f64,
    /// Estimate minus truth `[x, y, φ]` \[m, m, rad\].
    pub(crate) error: [f64; 3],
    /// 3σ \[m, m, rad\].
    pub(crate) three_sigma: [f64; 3],
    /// Whether the robot says that it knows where it is: the panel has room for that.
    pub(crate) knows: bool,
}

/// Draws estimate minus truth of one robot over world time, with the ±3σ that it claimed. Between `pieces` there is a gap.
/// `index` picks the robot's colour, the same as in [`super::draw_paths`].
pub(crate) fn draw_errors(
    file: &Path,
    caption: &str,
    index: usize,
    pieces: &[Vec<ErrorPoint>],
) -> Result<(), WriteError> {
    write_svg(file, SIZE_PX, |area| draw(area, caption, index, pieces))
}

type Panel<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn draw(
    area: &Area<'_>,
    caption: &str,
    index: usize,
    pieces: &[Vec<ErrorPoint>],
) -> Result<(), Failure> {
    area.fill(&WHITE)?;
    let (title, panels) = area.split_vertically(CAPTION_PX);
    title.draw(&Text::new(
        caption.to_owned(),
        (10, 10),
        ("sans-serif", 20).into_font().color(&INK),
    ))?;
    for (coordinate, panel) in panels.split_evenly((3, 1)).iter().enumerate() {
        draw_panel(panel, coordinate, index, pieces)?;
    }
    area.present()?;
    Ok(())
}

fn draw_panel(
    area: &Area<'_>,
    coordinate: usize,
    index: usize,
    pieces: &[Vec<ErrorPoint>],
) -> Result<(), Failure> {
    let (start, end) = extent(pieces.iter().flatten().map(|c| c.time_s));
    let half = half_height(coordinate, pieces);
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(20)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(start..end.max(start + 1e-3), -half..half)?;
    draw_axes(&mut chart, AXES[coordinate])?;
    let curve = |value: fn(&ErrorPoint, usize) -> f64, style: ShapeStyle| {
        thinned(pieces, MOST_POINTS).map(move |piece| {
            let points = piece.map(|c| (c.time_s, value(c, coordinate).clamp(-half, half)));
            PathElement::new(points.collect::<Vec<_>>(), style)
        })
    };
    let bound = line(BOUND_RED, 1);
    chart
        .draw_series(curve(|c, i| c.three_sigma[i], bound))?
        .label("±3σ")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], bound));
    chart.draw_series(curve(|c, i| -c.three_sigma[i], bound))?;
    let style = line(robot_color(index), 1);
    chart
        .draw_series(curve(|c, i| c.error[i], style))?
        .label("error")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
    if coordinate == 0 {
        draw_legend(&mut chart)?;
    }
    Ok(())
}

fn draw_axes(chart: &mut Panel<'_>, y_axis: &str) -> Result<(), Failure> {
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc(y_axis)
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .y_labels(7)
        .draw()?;
    Ok(())
}

fn draw_legend(chart: &mut Panel<'_>) -> Result<(), Failure> {
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .label_font(("sans-serif", 14).into_font().color(&INK))
        .draw()?;
    Ok(())
}

/// Half the panel's height: the bounds with some air, but not the first second's, which would dwarf the rest;
/// the errors always fit. Where the robot does not know where it is the bounds may leave the panel.
fn half_height(coordinate: usize, pieces: &[Vec<ErrorPoint>]) -> f64 {
    let knows = pieces.iter().flatten().any(|it| it.knows);
    let points = || pieces.iter().flatten().filter(move |it| it.knows || !knows);
    let largest = |values: &mut dyn Iterator<Item = f64>| {
        values.filter(|value| value.is_finite()).fold(0.0, f64::max)
    };
    let start_s = points().next().map_or(0.0, |c| c.time_s);
    let late = points().filter(|c| c.time_s > start_s + 1.0);
    let usual = largest(&mut late.map(|c| c.three_sigma[coordinate]));
    let worst = largest(&mut points().map(|c| c.error[coordinate].abs()));
    (1.15 * usual.max(worst)).max(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wiggle() -> Vec<ErrorPoint> {
        (0..500)
            .map(|k| {
                let t = f64::from(k) * 0.02;
                ErrorPoint {
                    time_s: t,
                    error: [0.05 * t.sin(), 0.03 * t.cos(), 0.02 * (2.0 * t).sin()],
                    three_sigma: [0.12, 0.15, 0.06],
                    knows: true,
                }
            })
            .collect()
    }

    #[test]
    fn three_panels_with_units_and_a_legend() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("errors.svg");
        draw_errors(&file, "Robot 1", 0, &[wiggle()]).unwrap();
        let svg = std::fs::read_to_string(&file).unwrap();
        for text in [
            "time [s]",
            "x error [m]",
            "y error [m]",
            "heading error [rad]",
            "±3σ",
            "Robot 1",
        ] {
            assert!(svg.contains(text), "{text} is missing");
        }
    }

    #[test]
    fn the_panel_holds_every_error() {
        let mut points = wiggle();
        points[7].error[0] = 3.0;
        points[8].error[0] = f64::INFINITY;
        let half = half_height(0, &[points]);
        assert!(half > 3.0 && half.is_finite());
    }

    #[test]
    fn between_pieces_there_is_a_gap() {
        let folder = tempfile::tempdir().unwrap();
        let polylines = |name: &str, pieces: &[Vec<ErrorPoint>]| {
            let file = folder.path().join(name);
            draw_errors(&file, "Robot 1", 0, pieces).unwrap();
            let svg = std::fs::read_to_string(&file).unwrap();
            svg.matches("<polyline").count()
        };
        let whole = wiggle();
        let (before, after) = (whole[..200].to_vec(), whole[300..].to_vec());
        let more = polylines("two", &[before, after]) - polylines("one", &[whole]);
        assert_eq!(more, 9, "three lines in three panels, each in two pieces");
    }

    #[test]
    fn an_empty_run_still_draws() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("errors.svg");
        draw_errors(&file, "Robot 1", 0, &[]).unwrap();
        assert!(std::fs::metadata(&file).unwrap().len() > 500);
    }
}
