//! Where robots were, where they said they were and how sure they were of it, who saw whom; and for every robot a small panel with
//! the way that its wheels alone would have made of it.

use std::path::Path;

use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::ellipses::outline;
use super::legend::Legend;
use super::style::{GRID, INK, TRUTH, line, robot_color, thinned, tick_label};
use super::window::{LABELS_PX, MARGIN_PX, Window};
use super::{Area, Failure, write_svg};
use crate::comparison::Moment;
use crate::result_file::WriteError;

/// One robot's part in the picture.
pub(crate) struct Drive<'a> {
    pub(crate) name: &'a str,
    /// Under its name.
    pub(crate) note: String,
    /// In the order of their stamps; between the pieces there is a gap.
    pub(crate) pieces: Vec<&'a [Moment]>,
}

/// One robot sees another.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Glimpse {
    /// Where both are \[m\].
    pub(crate) between: [(f64, f64); 2],
    /// Whether one of them is told nothing by it.
    pub(crate) untold: bool,
}

const WIDTH_PX: u32 = 1200;
const CAPTION_PX: u32 = 40;
const BESIDE_PX: u32 = 2 * MARGIN_PX + LABELS_PX;
const PANELS_BESIDE_ONE_ANOTHER: u32 = 3;
const PANEL_PX: u32 = WIDTH_PX / PANELS_BESIDE_ONE_ANOTHER;
const PANEL_CAPTION_PX: u32 = 44;
const PANEL_MARGIN_PX: u32 = 10;
const PANEL_LABELS_PX: u32 = 28;
const PANEL_BESIDE_PX: u32 = 2 * PANEL_MARGIN_PX + PANEL_LABELS_PX;
const MOST_POINTS: usize = 2000;
const ELLIPSE_STEPS: u32 = 48;
/// About so many ellipses along a path.
const ELLIPSES: f64 = 15.0;

type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws every robot's drive into one plot with the `glimpses`, and below it each into a panel of its own.
pub(crate) fn draw_drives(
    file: &Path,
    caption: &str,
    drives: &[Drive<'_>],
    glimpses: &[Glimpse],
) -> Result<(), WriteError> {
    let whole = Window::around(places(drives, |m| {
        [m.comparison.truth, m.comparison.estimate]
    }));
    let panel = Window::around(places(drives, |m| [m.comparison.truth, m.by_wheels]));
    let legend = legend();
    let (legend_px, whole_px) = (
        legend.height_px(WIDTH_PX),
        whole.height_px(WIDTH_PX, BESIDE_PX),
    );
    let panel_px = PANEL_CAPTION_PX + panel.height_px(PANEL_PX, PANEL_BESIDE_PX);
    let rows = u32::try_from(drives.len())
        .unwrap_or(1)
        .div_ceil(PANELS_BESIDE_ONE_ANOTHER);
    let size = (
        WIDTH_PX,
        CAPTION_PX + legend_px + whole_px + rows * panel_px,
    );
    write_svg(file, size, |area| {
        area.fill(&WHITE)?;
        let (title, rest) = area.split_vertically(CAPTION_PX);
        let font = ("sans-serif", 20).into_font().color(&INK);
        title.draw(&Text::new(caption.to_owned(), (10, 12), font))?;
        let (keys, rest) = rest.split_vertically(legend_px);
        legend.draw(&keys)?;
        let (plot, panels) = rest.split_vertically(whole_px);
        draw_whole(&plot, drives, glimpses, &whole)?;
        let places = panels.split_evenly((rows as usize, PANELS_BESIDE_ONE_ANOTHER as usize));
        for (index, (place, drive)) in places.iter().zip(drives).enumerate() {
            draw_panel(place, index, drive, &panel)?;
        }
        Ok(())
    })
}

fn places<'a>(
    drives: &'a [Drive<'_>],
    of: fn(&Moment) -> [coloc_estimator::Pose; 2],
) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
    let moments = drives
        .iter()
        .flat_map(|drive| drive.pieces.iter().copied().flatten());
    moments.flat_map(of).map(|pose| (pose.x, pose.y))
}

fn legend() -> Legend {
    let key = |name: &str, style: ShapeStyle| (name.to_owned(), style);
    Legend::new(vec![
        key("truth", line(TRUTH, 5)),
        key("estimate", line(INK, 2)),
        key("95 % ellipse", INK.mix(0.25).stroke_width(12)),
        key("wheels alone", line(INK, 1)),
        key("sees", INK.mix(0.3).stroke_width(1)),
    ])
}

fn draw_whole(
    plot: &Area<'_>,
    drives: &[Drive<'_>],
    glimpses: &[Glimpse],
    window: &Window,
) -> Result<(), Failure> {
    let mut chart = ChartBuilder::on(plot)
        .margin(MARGIN_PX)
        .x_label_area_size(LABELS_PX)
        .y_label_area_size(LABELS_PX)
        .build_cartesian_2d(window.x.0..window.x.1, window.y.0..window.y.1)?;
    chart
        .configure_mesh()
        .x_desc("x [m]")
        .y_desc("y [m]")
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .draw()?;
    draw_glimpses(&mut chart, glimpses)?;
    for drive in drives {
        draw_truth(&mut chart, drive, 5)?;
    }
    for (index, drive) in drives.iter().enumerate() {
        draw_estimate(&mut chart, index, drive)?;
        draw_start(&mut chart, index, drive)?;
    }
    Ok(())
}

fn draw_panel(
    place: &Area<'_>,
    index: usize,
    drive: &Drive<'_>,
    window: &Window,
) -> Result<(), Failure> {
    let (caption, plot) = place.split_vertically(PANEL_CAPTION_PX);
    let name = ("sans-serif", 16).into_font().color(&robot_color(index));
    let note = ("sans-serif", 14).into_font().color(&INK);
    let left = i32::try_from(PANEL_MARGIN_PX + PANEL_LABELS_PX).unwrap_or(0);
    caption.draw(&Text::new(drive.name.to_owned(), (left, 6), name))?;
    caption.draw(&Text::new(drive.note.clone(), (left, 26), note))?;
    let mut chart = ChartBuilder::on(&plot)
        .margin(PANEL_MARGIN_PX)
        .x_label_area_size(PANEL_LABELS_PX)
        .y_label_area_size(PANEL_LABELS_PX)
        .build_cartesian_2d(window.x.0..window.x.1, window.y.0..window.y.1)?;
    chart
        .configure_mesh()
        .label_style(("sans-serif", 12).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .draw()?;
    draw_truth(&mut chart, drive, 4)?;
    draw_wheels(&mut chart, index, drive)?;
    draw_estimate(&mut chart, index, drive)
}

fn draw_glimpses(chart: &mut Chart<'_>, glimpses: &[Glimpse]) -> Result<(), Failure> {
    let style = INK.mix(0.25).stroke_width(1);
    let line = |glimpse: &Glimpse| PathElement::new(glimpse.between, style);
    chart.draw_series(glimpses.iter().map(line))?;
    Ok(())
}

fn draw_truth(chart: &mut Chart<'_>, drive: &Drive<'_>, width: u32) -> Result<(), Failure> {
    let truth = |m: &Moment| (m.comparison.truth.x, m.comparison.truth.y);
    chart.draw_series(lines(drive, truth).map(|at| PathElement::new(at, line(TRUTH, width))))?;
    Ok(())
}

fn draw_wheels(chart: &mut Chart<'_>, index: usize, drive: &Drive<'_>) -> Result<(), Failure> {
    let style = line(robot_color(index), 1);
    let wheels = |m: &Moment| (m.by_wheels.x, m.by_wheels.y);
    let dashed = lines(drive, wheels).map(|at| DashedPathElement::new(at, 6, 4, style));
    chart.draw_series(dashed)?;
    Ok(())
}

fn draw_estimate(chart: &mut Chart<'_>, index: usize, drive: &Drive<'_>) -> Result<(), Failure> {
    let color = robot_color(index);
    let estimate = |m: &Moment| (m.comparison.estimate.x, m.comparison.estimate.y);
    let ellipses: Vec<_> = at_intervals(drive).map(ellipse).collect();
    let filled = ellipses.iter().cloned();
    chart.draw_series(filled.map(|at| Polygon::new(at, color.mix(0.18))))?;
    let edge = color.mix(0.6).stroke_width(1);
    chart.draw_series(ellipses.into_iter().map(|at| PathElement::new(at, edge)))?;
    chart.draw_series(lines(drive, estimate).map(|at| PathElement::new(at, line(color, 2))))?;
    Ok(())
}

fn draw_start(chart: &mut Chart<'_>, index: usize, drive: &Drive<'_>) -> Result<(), Failure> {
    let first = drive.pieces.iter().copied().flatten().next();
    let start = first.map(|m| (m.comparison.truth.x, m.comparison.truth.y));
    let dot = robot_color(index).filled();
    chart.draw_series(start.map(|at| Circle::new(at, 5, dot)))?;
    // Colours start over after ten robots; names do not.
    let font = ("sans-serif", 14).into_font().color(&INK);
    let name = |at| EmptyElement::at(at) + Text::new(drive.name.to_owned(), (8, -16), font.clone());
    chart.draw_series(start.map(name))?;
    Ok(())
}

fn ellipse(moment: &Moment) -> Vec<(f64, f64)> {
    let mean = [moment.comparison.estimate.x, moment.comparison.estimate.y];
    outline(mean, moment.covariance, ELLIPSE_STEPS)
}

/// The first moment of each interval of a length that suits the whole.
fn at_intervals<'a>(drive: &'a Drive<'_>) -> impl Iterator<Item = &'a Moment> {
    let moments = || drive.pieces.iter().copied().flatten();
    let time_s = |moment: &Moment| moment.comparison.time_s;
    let length_s = moments().last().map_or(0.0, time_s);
    let interval_s = (length_s / ELLIPSES).max(0.1);
    let mut next_s = interval_s;
    moments().filter(move |moment| {
        let due = time_s(moment) >= next_s;
        while next_s <= time_s(moment) {
            next_s += interval_s;
        }
        due
    })
}

fn lines(
    drive: &Drive<'_>,
    place: impl Fn(&Moment) -> (f64, f64),
) -> impl Iterator<Item = Vec<(f64, f64)>> {
    thinned(&drive.pieces, MOST_POINTS).map(move |piece| piece.map(&place).collect())
}
