//! Lines over time in panels under one another, each with the band that it should stay in, if there is one.

use std::path::Path;

use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::style::{GRID, INK, extent, line, tick_label};
use super::{Area, Failure, write_svg};
use crate::result_file::WriteError;

const WIDTH_PX: u32 = 1000;
const CAPTION_PX: u32 = 36;
const PANEL_PX: u32 = 260;
const BAND: RGBColor = RGBColor(205, 230, 205);

/// One panel.
pub(crate) struct Panel<'a> {
    pub(crate) y_axis: String,
    pub(crate) scale: Scale,
    /// Where values should be, and what the legend calls that.
    pub(crate) band: Option<([f64; 2], &'a str)>,
    pub(crate) lines: Vec<Line>,
}

/// How values become heights.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    /// From zero.
    Linear,
    /// Positive values only.
    Logarithmic,
}

/// One line.
pub(crate) struct Line {
    pub(crate) label: String,
    pub(crate) color: RGBColor,
    /// Time \[s\] and value; the line is interrupted where there is none.
    pub(crate) points: Vec<(f64, Option<f64>)>,
}

impl Line {
    /// The uninterrupted pieces.
    fn pieces(&self) -> impl Iterator<Item = Vec<(f64, f64)>> {
        let drawable = |value: &Option<f64>| value.is_some_and(f64::is_finite);
        self.points
            .chunk_by(move |a, b| drawable(&a.1) == drawable(&b.1))
            .filter(move |piece| piece.first().is_some_and(|(_, value)| drawable(value)))
            .map(|piece| {
                piece
                    .iter()
                    .filter_map(|&(t, value)| Some((t, value?)))
                    .collect()
            })
    }

    fn values(&self) -> impl Iterator<Item = f64> {
        self.points.iter().filter_map(|(_, value)| *value)
    }
}

/// Draws `panels` under `caption`.
#[allow(clippy::cast_possible_truncation)] // A few panels.
pub(crate) fn draw_lines(
    file: &Path,
    caption: &str,
    panels: &[Panel<'_>],
) -> Result<(), WriteError> {
    let size = (WIDTH_PX, CAPTION_PX + PANEL_PX * panels.len() as u32);
    write_svg(file, size, |area| draw(area, caption, panels))
}

fn draw(area: &Area<'_>, caption: &str, panels: &[Panel<'_>]) -> Result<(), Failure> {
    area.fill(&WHITE)?;
    let (title, rest) = area.split_vertically(CAPTION_PX);
    let font = ("sans-serif", 20).into_font().color(&INK);
    title.draw(&Text::new(caption.to_owned(), (10, 10), font))?;
    for (index, (place, panel)) in rest
        .split_evenly((panels.len(), 1))
        .iter()
        .zip(panels)
        .enumerate()
    {
        draw_panel(place, panel, index == 0)?;
    }
    Ok(())
}

fn draw_panel(place: &Area<'_>, panel: &Panel<'_>, legend: bool) -> Result<(), Failure> {
    let points = || panel.lines.iter().flat_map(|line| &line.points);
    let (start, end) = extent(points().map(|(t, _)| *t));
    let time = start..end.max(start + 1e-3);
    let (low, high) = panel.range();
    let mut builder = ChartBuilder::on(place);
    builder
        .margin(8)
        .margin_right(20)
        .x_label_area_size(40)
        .y_label_area_size(70);
    match panel.scale {
        Scale::Linear => {
            let chart = builder.build_cartesian_2d(time.clone(), 0.0..high)?;
            fill(chart, panel, &time, legend)
        }
        Scale::Logarithmic => {
            let chart = builder.build_cartesian_2d(time.clone(), (low..high).log_scale())?;
            fill(chart, panel, &time, legend)
        }
    }
}

impl Panel<'_> {
    /// Smallest and largest value with some air; what is worth a decade on a logarithmic scale ends at whole decades.
    fn range(&self) -> (f64, f64) {
        let band = self.band.iter().flat_map(|(band, _)| *band);
        let values = self.lines.iter().flat_map(Line::values).chain(band);
        match self.scale {
            Scale::Linear => (0.0, 1.1 * extent(values).1.max(1e-9)),
            Scale::Logarithmic => {
                let (low, high) = extent(values.filter(|&value| value > 0.0));
                (
                    decade(low.log10().floor()),
                    decade(high.log10().ceil()).max(low * 10.0),
                )
            }
        }
    }
}

fn decade(exponent: f64) -> f64 {
    10.0_f64.powf(exponent.clamp(-12.0, 12.0))
}

type Chart<'a, Y> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, Y>>;

fn fill<Y>(
    mut chart: Chart<'_, Y>,
    panel: &Panel<'_>,
    time: &std::ops::Range<f64>,
    legend: bool,
) -> Result<(), Failure>
where
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc(panel.y_axis.as_str())
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .x_label_formatter(&tick_label)
        .y_label_formatter(&tick_label)
        .y_labels(6)
        .draw()?;
    if let Some(([low, high], name)) = panel.band {
        let area = Rectangle::new([(time.start, low), (time.end, high)], BAND.filled());
        chart
            .draw_series([area])?
            .label(name)
            .legend(|(x, y)| Rectangle::new([(x, y - 5), (x + 20, y + 5)], BAND.filled()));
    }
    for one in &panel.lines {
        let style = line(one.color, 2);
        let key = move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style);
        chart
            .draw_series(one.pieces().map(|piece| PathElement::new(piece, style)))?
            .label(one.label.clone())
            .legend(key);
    }
    if legend {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .label_font(("sans-serif", 14).into_font().color(&INK))
            .draw()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(points: &[(f64, Option<f64>)]) -> Line {
        Line {
            label: "coloc".into(),
            color: INK,
            points: points.to_vec(),
        }
    }

    #[test]
    fn a_line_is_interrupted_where_nobody_knows() {
        let line = one(&[
            (0.0, Some(1.0)),
            (1.0, None),
            (2.0, Some(f64::INFINITY)),
            (3.0, Some(3.0)),
            (4.0, Some(4.0)),
        ]);
        let pieces: Vec<_> = line.pieces().collect();
        assert_eq!(pieces, [vec![(0.0, 1.0)], vec![(3.0, 3.0), (4.0, 4.0)]]);
    }

    #[test]
    fn both_scales_draw_axes_legend_and_band() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("lines.svg");
        let panel = |scale| Panel {
            y_axis: "NEES".into(),
            scale,
            band: Some(([2.0, 4.0], "95 % band")),
            lines: vec![one(&[(0.0, Some(0.5)), (10.0, Some(300.0))])],
        };
        draw_lines(
            &file,
            "Honest?",
            &[panel(Scale::Logarithmic), panel(Scale::Linear)],
        )
        .unwrap();
        let svg = std::fs::read_to_string(&file).unwrap();
        for text in ["Honest?", "time [s]", "NEES", "95 % band", "coloc"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert_eq!(panel(Scale::Logarithmic).range(), (0.1, 1000.0));
    }

    #[test]
    fn nothing_to_draw_is_no_error() {
        let folder = tempfile::tempdir().unwrap();
        let panel = Panel {
            y_axis: String::new(),
            scale: Scale::Logarithmic,
            band: None,
            lines: vec![one(&[(0.0, None)])],
        };
        draw_lines(&folder.path().join("empty.svg"), "", &[panel]).unwrap();
    }
}
