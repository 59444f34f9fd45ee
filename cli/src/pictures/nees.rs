//! Normalised estimation error squared over time: whether a method's uncertainty is what its errors are.

use std::path::Path;

use plotters::prelude::*;

use super::PictureError;
use super::style::{GRID, INK, extent, line, robot_color, thinned, tick_label};

const SIZE_PX: (u32, u32) = (1000, 500);
const MOST_POINTS: usize = 1000;
/// The picture ends here, below and above: what is beyond is wrong by any measure.
const LIMITS: (f64, f64) = (0.05, 1000.0);

/// One method's line in the picture.
pub(crate) struct NeesCurve<'a> {
    /// As the legend calls it.
    pub(crate) name: &'a str,
    /// `(time [s], NEES)`.
    pub(crate) points: Vec<(f64, f64)>,
}

/// Draws the curves on a logarithmic axis, with the band in which an honest method's are for 95 % of the time.
pub(crate) fn draw_nees(
    file: &Path,
    caption: &str,
    band: [f64; 2],
    curves: &[NeesCurve<'_>],
) -> Result<(), PictureError> {
    let area = SVGBackend::new(file, SIZE_PX).into_drawing_area();
    draw(&area, caption, band, curves).map_err(|error| PictureError::new(file, &error))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw(
    area: &Area<'_>,
    caption: &str,
    [low, high]: [f64; 2],
    curves: &[NeesCurve<'_>],
) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let times = curves.iter().flat_map(|curve| &curve.points);
    let (start, end) = extent(times.map(|(time_s, _)| *time_s));
    let end = end.max(start + 1e-3);
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 20).into_font().color(&INK))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d(start..end, (LIMITS.0..LIMITS.1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc("NEES (an honest one is 3)")
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .draw()?;
    let shade = RGBColor(0, 158, 115).mix(0.2).filled();
    chart
        .draw_series([Rectangle::new([(start, low), (end, high)], shade)])?
        .label("95 % band")
        .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 20, y + 5)], shade));
    for (index, curve) in curves.iter().enumerate() {
        let style = line(robot_color(index), 1);
        let points = thinned(&curve.points, MOST_POINTS)
            .map(|(time_s, nees)| (*time_s, nees.clamp(LIMITS.0, LIMITS.1)));
        chart
            .draw_series(LineSeries::new(points, style))?
            .label(curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(GRID)
        .label_font(("sans-serif", 14).into_font().color(&INK))
        .draw()?;
    area.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_and_the_band_are_in_the_picture_whatever_the_values() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("nees.svg");
        let curve = |name, nees| NeesCurve {
            name,
            points: vec![(0.0, nees), (1.0, nees)],
        };
        let curves = [
            curve("nb", 2e5),
            curve("coloc", 0.0),
            curve("ei", f64::INFINITY),
        ];
        draw_nees(&file, "R5", [2.0, 4.0], &curves).unwrap();
        let svg = std::fs::read_to_string(&file).unwrap();
        for text in ["nb", "coloc", "ei", "95 % band", "time [s]", "NEES"] {
            assert!(svg.contains(text), "{text} is missing");
        }
    }
}
