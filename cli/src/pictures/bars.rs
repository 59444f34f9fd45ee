//! Groups of bars on a logarithmic scale: for every robot a group, for every method a bar.

use std::path::Path;

use plotters::prelude::*;

use super::legend::Legend;
use super::style::{GRID, INK, extent, tick_label};
use super::{Area, Failure, write_svg};
use crate::result_file::WriteError;

const WIDTH_PX: u32 = 1000;
const CAPTION_PX: u32 = 36;
const PANEL_PX: u32 = 260;
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
) -> Result<(), WriteError> {
    let legend = Legend::of_colors(methods);
    let height = CAPTION_PX + legend.height_px(WIDTH_PX) + PANEL_PX * panels.len() as u32;
    write_svg(file, (WIDTH_PX, height), |area| {
        draw(area, caption, groups, &legend, methods, panels)
    })
}

fn draw(
    area: &Area<'_>,
    caption: &str,
    groups: &[String],
    legend: &Legend,
    methods: &[(&str, RGBColor)],
    panels: &[BarPanel],
) -> Result<(), Failure> {
    area.fill(&WHITE)?;
    let (title, rest) = area.split_vertically(CAPTION_PX);
    let font = ("sans-serif", 20).into_font().color(&INK);
    title.draw(&Text::new(caption.to_owned(), (10, 10), font))?;
    let (keys, rest) = rest.split_vertically(legend.height_px(WIDTH_PX));
    legend.draw(&keys)?;
    let places = rest.split_evenly((panels.len(), 1));
    for (place, panel) in places.iter().zip(panels) {
        draw_panel(place, groups, methods, panel)?;
    }
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
            svg.matches("#FF0000").count(),
            3,
            "two bars and the legend's"
        );
    }
}
