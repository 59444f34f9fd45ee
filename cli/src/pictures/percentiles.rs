//! Latency over percentiles: the further right, the rarer.

use std::path::Path;

use plotters::prelude::*;

use super::style::{GRID, INK, line, robot_color};
use super::{Area, Failure, write_svg};
use crate::result_file::WriteError;

/// A line of the picture.
pub(crate) struct PercentileCurve {
    pub(crate) name: String,
    /// `(quantile, µs)`
    pub(crate) points: Vec<(f64, f64)>,
}

const SIZE: (u32, u32) = (960, 560);

/// Draws `curves` into an SVG file: one more nine with every step to the right, microseconds upwards, both logarithmic.
pub(crate) fn draw_percentiles(
    path: &Path,
    title: &str,
    curves: &[PercentileCurve],
) -> Result<(), WriteError> {
    write_svg(path, SIZE, |area| draw(area, title, curves))
}

/// Nines of a quantile: 0.99 has two.
fn nines(quantile: f64) -> f64 {
    -(1.0 - quantile).log10()
}

/// No more digits than there are nines.
#[allow(clippy::trivially_copy_pass_by_ref)] // The plotting library hands out references.
fn percent(nines: &f64) -> String {
    let percent = 100.0 * (1.0 - 10_f64.powf(-nines));
    format!("{:.*} %", whole(nines - 2.0), percent)
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A handful.
fn whole(number: f64) -> usize {
    number.max(0.0).ceil() as usize
}

fn draw(area: &Area<'_>, title: &str, curves: &[PercentileCurve]) -> Result<(), Failure> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let most_nines = points().map(|point| nines(point.0)).fold(1.0, f64::max);
    let low = points().map(|point| point.1).fold(1.0, f64::min).max(0.01);
    let high = points().map(|point| point.1).fold(10.0, f64::max);
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 18).into_font().color(&INK))
        .margin(16)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..most_nines, (low..high * 1.2).log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(GRID)
        .bold_line_style(GRID)
        .x_desc("percentile")
        .y_desc("µs")
        .x_labels(whole(most_nines) + 1)
        .x_label_formatter(&percent)
        .draw()?;
    for (index, curve) in curves.iter().enumerate() {
        let color = robot_color(index);
        let points = curve
            .points
            .iter()
            .map(|(quantile, micros)| (nines(*quantile), micros.max(low)));
        chart
            .draw_series(LineSeries::new(points, line(color, 2)))?
            .label(curve.name.as_str())
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], line(color, 2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_names_axes_and_curves() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("latency.svg");
        let curve = PercentileCurve {
            name: "frame to estimate".into(),
            points: vec![(0.0, 5.0), (0.5, 10.0), (0.99, 30.0), (0.999, 500.0)],
        };
        draw_percentiles(&path, "colocd", &[curve]).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        for word in ["percentile", "µs", "frame to estimate", "99 %", "<polyline"] {
            assert!(text.contains(word), "{word}");
        }
    }

    #[test]
    fn labels_have_as_many_nines_as_they_need() {
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0].map(|nines| percent(&nines)),
            ["0 %", "90 %", "99 %", "99.9 %"]
        );
    }
}
