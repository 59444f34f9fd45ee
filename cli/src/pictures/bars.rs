//! Groups of bars on a logarithmic scale: for every robot a group, for every method a bar.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::PictureError;
use super::style::{GRID, INK, extent, tick_label};

const WIDTH_PX: u32 = 1000;
const CAPTION_PX: u32 = 36;
const LEGEND_PX: u32 = 26;
const PANEL_PX: u32 = 260;
/// From one name to the next in the legend.
const KEY_PX: i32 = 90;
/// Where the first name begins: above the panels' axes.
const FIRST_KEY_PX: i32 = 80;
/// Share of a group's width that its bars take.
const FULL: f64 = 0.84;

/// One panel: the same groups and bars of another quantity.
pub(crate) struct BarPanel {
    pub(crate) y_axis: &'static str,
    /// By method, then by group; positive.
    pub(crate) heights: Vec<Vec<f64>>,
}

/// Draws `panels` with `groups` along the horizontal axis and a bar for each of `methods` in each.
#[allow(clippy::cast_possible_truncation)] // A few panels.
pub(crate) fn draw_bars(
    file: &Path,
    caption: &str,
    groups: &[String],
    methods: &[(&str, RGBColor)],
    panels: &[BarPanel],
) -> Result<(), PictureError> {
    let height = CAPTION_PX + LEGEND_PX + PANEL_PX * panels.len() as u32;
    let size = (WIDTH_PX, height);
    let area = SVGBackend::new(file, size).into_drawing_area();
    draw(&area, caption, groups, methods, panels).map_err(|error| PictureError::new(file, &error))
}

type Failure = Box<dyn std::error::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(
    area: &Area<'_>,
    caption: &str,
    groups: &[String],
    methods: &[(&str, RGBColor)],
    panels: &[BarPanel],
) -> Result<(), Failure> {
    area.fill(&WHITE)?;
    let (title, rest) = area.split_vertically(CAPTION_PX);
    let font = ("sans-serif", 20).into_font().color(&INK);
    title.draw(&Text::new(caption.to_owned(), (10, 10), font))?;
    let (legend, rest) = rest.split_vertically(LEGEND_PX);
    draw_legend(&legend, methods)?;
    let places = rest.split_evenly((panels.len(), 1));
    for (place, panel) in places.iter().zip(panels) {
        draw_panel(place, groups, methods, panel)?;
    }
    area.present()?;
    Ok(())
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss
)] // A few bars.
fn draw_panel(
    place: &Area<'_>,
    groups: &[String],
    methods: &[(&str, RGBColor)],
    panel: &BarPanel,
) -> Result<(), Failure> {
    let positive = panel
        .heights
        .iter()
        .flatten()
        .copied()
        .filter(|&height| height > 0.0);
    let (low, high) = extent(positive);
    let (low, high) = (low / 2.0, high.max(low * 10.0) * 2.0);
    let mut chart = ChartBuilder::on(place)
        .margin(8)
        .margin_right(20)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..groups.len() as f64, (low..high).log_scale())?;
    let name = |at: &f64| {
        let (group, part) = (at.floor(), at.fract());
        let named = groups.get(group.max(0.0) as usize);
        named
            .filter(|_| (part - 0.5).abs() < 0.01)
            .cloned()
            .unwrap_or_default()
    };
    chart
        .configure_mesh()
        .x_desc("robot")
        .y_desc(panel.y_axis)
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(INK)
        .disable_x_mesh()
        .x_labels(2 * groups.len() + 1)
        .x_label_formatter(&name)
        .y_label_formatter(&tick_label)
        .draw()?;
    let width = FULL / methods.len().max(1) as f64;
    for (bar, ((_, color), heights)) in methods.iter().zip(&panel.heights).enumerate() {
        let bars = heights
            .iter()
            .enumerate()
            .filter(|(_, height)| **height > 0.0)
            .map(|(group, &height)| {
                let left = group as f64 + (1.0 - FULL) / 2.0 + bar as f64 * width;
                Rectangle::new([(left, low), (left + 0.9 * width, height)], color.filled())
            });
        chart.draw_series(bars)?;
    }
    Ok(())
}

/// In a row of its own: the panels are full of bars.
#[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // A few names.
fn draw_legend(row: &Area<'_>, methods: &[(&str, RGBColor)]) -> Result<(), Failure> {
    for (index, (method, color)) in methods.iter().enumerate() {
        let x = FIRST_KEY_PX + KEY_PX * index as i32;
        row.draw(&Rectangle::new([(x, 5), (x + 12, 17)], color.filled()))?;
        let font = ("sans-serif", 14).into_font().color(&INK);
        row.draw(&Text::new((*method).to_owned(), (x + 17, 4), font))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_group_and_method_is_named_and_has_its_bar() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("bars.svg");
        let groups = ["R1".to_owned(), "R2".to_owned()];
        let panel = BarPanel {
            y_axis: "x [cm]",
            heights: vec![vec![1.0, 200.0], vec![3.0, 4.0]],
        };
        draw_bars(
            &file,
            "Methods",
            &groups,
            &[("sl", RED), ("coloc", BLUE)],
            &[panel],
        )
        .unwrap();
        let svg = std::fs::read_to_string(&file).unwrap();
        for text in ["Methods", "R1", "R2", "sl", "coloc", "x [cm]"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert_eq!(
            svg.matches("fill=\"#FF0000\"").count(),
            3,
            "two bars and the legend's"
        );
    }
}
