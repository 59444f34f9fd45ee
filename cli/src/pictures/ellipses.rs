//! Clouds of points with ellipses around them, in panels beside one another.

use std::f64::consts::TAU;
use std::path::Path;

use plotters::prelude::*;

use super::style::{GRID, INK, TRUTH, extent, line, tick_label};
use super::{Area, Failure, write_svg};
use crate::result_file::WriteError;

const PANEL_PX: u32 = 520;
const CAPTION_PX: u32 = 36;
/// χ² with two degrees of freedom, 95 %.
const CHI2_2_95: f64 = 5.991_464_547_107_979;
const STEPS: u32 = 120;

/// One panel.
pub(crate) struct EllipsePanel {
    pub(crate) title: String,
    /// x, y \[m\].
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) points_label: &'static str,
    /// Of those with one label only the last has a cross and is named.
    pub(crate) ellipses: Vec<Ellipse>,
    pub(crate) traces: Vec<Trace>,
}

/// A line through places.
pub(crate) struct Trace {
    pub(crate) label: &'static str,
    pub(crate) color: RGBColor,
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
    let size = (PANEL_PX * panels.len() as u32, PANEL_PX + CAPTION_PX);
    write_svg(file, size, |area| draw(area, caption, panels))
}

fn draw(area: &Area<'_>, caption: &str, panels: &[EllipsePanel]) -> Result<(), Failure> {
    area.fill(&WHITE)?;
    let (title, rest) = area.split_vertically(CAPTION_PX);
    let font = ("sans-serif", 20).into_font().color(&INK);
    title.draw(&Text::new(caption.to_owned(), (10, 10), font))?;
    for (place, panel) in rest.split_evenly((1, panels.len())).iter().zip(panels) {
        draw_panel(place, panel)?;
    }
    Ok(())
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
        .caption(
            panel.title.as_str(),
            ("sans-serif", 16).into_font().color(&INK),
        )
        .margin(10)
        .x_label_area_size(40)
        .y_label_area_size(56)
        .build_cartesian_2d(around(x), around(y))?;
    chart
        .configure_mesh()
        .x_desc("x [m]")
        .y_desc("y [m]")
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_labels(6)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .draw()?;
    let dots = panel
        .points
        .iter()
        .map(|&at| Circle::new(at, 1, TRUTH.filled()));
    chart
        .draw_series(dots)?
        .label(panel.points_label)
        .legend(|(x, y)| Circle::new((x + 10, y), 2, TRUTH.filled()));
    for (at, (ellipse, outline)) in panel.ellipses.iter().zip(outlines).enumerate() {
        let style = line(ellipse.color, ellipse.width_px);
        let series = chart.draw_series([PathElement::new(outline, style)])?;
        let later = panel.ellipses.iter().skip(at + 1);
        if later.into_iter().any(|it| it.label == ellipse.label) {
            continue;
        }
        series
            .label(ellipse.label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
        let [x, y] = ellipse.mean;
        chart.draw_series([Cross::new((x, y), 5, style)])?;
    }
    for trace in &panel.traces {
        let style = line(trace.color, 2);
        chart
            .draw_series([PathElement::new(trace.points.clone(), style)])?
            .label(trace.label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
        let end = trace.points.last().copied();
        chart.draw_series(end.map(|at| Circle::new(at, 4, trace.color.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .label_font(("sans-serif", 14).into_font().color(&INK))
        .draw()?;
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
