//! Clouds of points with ellipses around them, in panels beside one another.

use std::f64::consts::TAU;
use std::path::Path;

use plotters::prelude::*;

use super::legend::{Legend, Look};
use super::style::{GRID, INK, TRUTH, extent, line, tick_label};
use super::{Area, Failure, write_fine_svg};
use crate::result_file::WriteError;

const PANEL_PX: u32 = 520;
/// The library's places are whole numbers: of a pixel they would make a curve of steps.
const FINE: u32 = 4;
const CAPTION_PX: u32 = 36;
const POINT_PX: u32 = 1;
const END_PX: u32 = 4;
/// χ² with two degrees of freedom, 95 %.
const CHI2_2_95: f64 = 5.991_464_547_107_979;
const STEPS: u32 = 120;

/// One panel.
pub(crate) struct EllipsePanel {
    pub(crate) title: String,
    /// x, y \[m\].
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) points_label: &'static str,
    /// Of those with one label only the last has a cross.
    pub(crate) ellipses: Vec<Ellipse>,
    pub(crate) traces: Vec<Trace>,
}

/// A line through places.
pub(crate) struct Trace {
    pub(crate) label: &'static str,
    pub(crate) color: RGBColor,
    /// What its last place is, if that has a dot.
    pub(crate) end_label: Option<&'static str>,
    /// x, y \[m\].
    pub(crate) points: Vec<(f64, f64)>,
}

/// The ellipse that holds 95 % of a normal distribution.
pub(crate) struct Ellipse {
    pub(crate) label: &'static str,
    pub(crate) color: RGBColor,
    pub(crate) width_px: u32,
    /// \[m\]
    pub(crate) mean: [f64; 2],
    /// `[xx, xy, yy]` \[m²\].
    pub(crate) covariance: [f64; 3],
}

impl Ellipse {
    fn outline(&self) -> Vec<(f64, f64)> {
        outline(self.mean, self.covariance, STEPS)
    }
}

/// Points around 95 % of a normal distribution: mean + L (cos, sin), P = L Lᵀ.
pub(super) fn outline(mean: [f64; 2], covariance: [f64; 3], steps: u32) -> Vec<(f64, f64)> {
    let [xx, xy, yy] = covariance.map(|entry| CHI2_2_95 * entry);
    let a = xx.max(0.0).sqrt();
    let b = if a > 0.0 { xy / a } else { 0.0 };
    let c = (yy - b * b).max(0.0).sqrt();
    let point = |step| {
        let (sin, cos) = (TAU * f64::from(step) / f64::from(steps)).sin_cos();
        (mean[0] + a * cos, mean[1] + b * cos + c * sin)
    };
    (0..=steps).map(point).collect()
}

/// Draws `panels` side by side, a metre as long on both axes.
#[allow(clippy::cast_possible_truncation)] // A few panels.
pub(crate) fn draw_ellipses(
    file: &Path,
    caption: &str,
    panels: &[EllipsePanel],
) -> Result<(), WriteError> {
    let legend = legend(panels);
    let width = FINE * PANEL_PX * panels.len() as u32;
    let legend_height = legend.height_px(width);
    let size = (width, FINE * (CAPTION_PX + PANEL_PX) + legend_height);
    write_fine_svg(file, size, FINE, |area| {
        area.fill(&WHITE)?;
        let (title, rest) = area.split_vertically(FINE * CAPTION_PX);
        let at = (10 * FINE.cast_signed(), 10 * FINE.cast_signed());
        title.draw(&Text::new(caption.to_owned(), at, font(20)))?;
        let (keys, rest) = rest.split_vertically(legend_height);
        legend.draw(&keys)?;
        for (place, panel) in rest.split_evenly((1, panels.len())).iter().zip(panels) {
            draw_panel(place, panel)?;
        }
        Ok(())
    })
}

/// Everything that has a name, once.
fn legend(panels: &[EllipsePanel]) -> Legend {
    let mut keys: Vec<(String, Look)> = Vec::new();
    let mut add = |name: &str, look| {
        if keys.iter().all(|(known, _)| known != name) {
            keys.push((name.to_owned(), look));
        }
    };
    for panel in panels {
        add(
            panel.points_label,
            Look::Dot(TRUTH.filled(), FINE * 2 * POINT_PX),
        );
        for ellipse in &panel.ellipses {
            add(
                ellipse.label,
                Look::Solid(fine(ellipse.color, ellipse.width_px)),
            );
        }
        for trace in &panel.traces {
            add(trace.label, Look::Solid(fine(trace.color, 2)));
            if let Some(end) = trace.end_label {
                add(end, Look::Dot(trace.color.filled(), FINE * END_PX));
            }
        }
    }
    Legend::of_looks(keys).scaled(FINE)
}

fn fine(color: RGBColor, width_px: u32) -> ShapeStyle {
    line(color, FINE * width_px)
}

fn font(size_px: u32) -> TextStyle<'static> {
    ("sans-serif", FINE * size_px).into_font().color(&INK)
}

fn draw_panel(place: &Area<'_>, panel: &EllipsePanel) -> Result<(), Failure> {
    let outlines: Vec<_> = panel.ellipses.iter().map(Ellipse::outline).collect();
    let traces = || panel.traces.iter().flat_map(|trace| &trace.points);
    let all = || {
        outlines
            .iter()
            .flatten()
            .chain(&panel.points)
            .chain(traces())
    };
    let (x, y) = (extent(all().map(|p| p.0)), extent(all().map(|p| p.1)));
    let half = 0.55 * (x.1 - x.0).max(y.1 - y.0).max(1e-6);
    let around = |(low, high): (f64, f64)| {
        let middle = f64::midpoint(low, high);
        (middle - half)..(middle + half)
    };
    let mut chart = ChartBuilder::on(place)
        .caption(panel.title.as_str(), font(16))
        .margin(FINE * 10)
        .x_label_area_size(FINE * 40)
        .y_label_area_size(FINE * 56)
        .build_cartesian_2d(around(x), around(y))?;
    chart
        .configure_mesh()
        .x_desc("x [m]")
        .y_desc("y [m]")
        .label_style(font(14))
        .light_line_style(TRANSPARENT)
        .bold_line_style(fine(GRID, 1))
        .axis_style(fine(INK, 1))
        .set_all_tick_mark_size(FINE * 5)
        .x_labels(6)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .draw()?;
    let dot = |&at| Circle::new(at, FINE * POINT_PX, TRUTH.filled());
    chart.draw_series(panel.points.iter().map(dot))?;
    for (at, (ellipse, outline)) in panel.ellipses.iter().zip(outlines).enumerate() {
        let style = fine(ellipse.color, ellipse.width_px);
        chart.draw_series([PathElement::new(outline, style)])?;
        let mut later = panel.ellipses.iter().skip(at + 1);
        if later.any(|it| it.label == ellipse.label) {
            continue;
        }
        let [x, y] = ellipse.mean;
        chart.draw_series([Cross::new((x, y), FINE * 5, style)])?;
    }
    for trace in &panel.traces {
        let path = PathElement::new(trace.points.clone(), fine(trace.color, 2));
        chart.draw_series([path])?;
        let end = trace.end_label.and(trace.points.last().copied());
        let dot = |at| Circle::new(at, FINE * END_PX, trace.color.filled());
        chart.draw_series(end.map(dot))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_is_where_the_mahalanobis_distance_is_the_quantile() {
        let ellipse = Ellipse {
            label: "",
            color: INK,
            width_px: 1,
            mean: [1.0, -2.0],
            covariance: [4.0, 1.0, 0.5],
        };
        let determinant = 4.0 * 0.5 - 1.0;
        for (x, y) in ellipse.outline() {
            let (dx, dy) = (x - 1.0, y + 2.0);
            let d2 = (0.5 * dx * dx - 2.0 * dx * dy + 4.0 * dy * dy) / determinant;
            assert!((d2 - CHI2_2_95).abs() < 1e-9, "{d2}");
        }
    }
}
