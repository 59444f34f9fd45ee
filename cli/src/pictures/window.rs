//! The part of the plane that a picture shows, a metre as long on both axes.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, IntoFont, SVGBackend, TRANSPARENT,
};

use super::style::{GRID, INK, extent, tick_label};
use super::{Area, Failure};

/// A plot with such a window.
pub(super) type Chart<'a> =
    ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

pub(super) const MARGIN_PX: u32 = 15;
pub(super) const LABELS_PX: u32 = 50;

/// \[m\]
pub(super) struct Window {
    pub(super) x: (f64, f64),
    pub(super) y: (f64, f64),
}

impl Window {
    /// All places with 5 % of air around them.
    pub(super) fn around(places: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let (x, y) = (
            extent(places.clone().map(|place| place.0)),
            extent(places.map(|place| place.1)),
        );
        let air = 0.05 * (x.1 - x.0).max(y.1 - y.0).max(0.2);
        let mut window = Self {
            x: (x.0 - air, x.1 + air),
            y: (y.0 - air, y.1 + air),
        };
        window.widen_to_half_as_high();
        window
    }

    /// An empty plot of it, with its axes in metres.
    pub(super) fn chart<'a>(&self, plot: &Area<'a>) -> Result<Chart<'a>, Failure> {
        let mut chart = ChartBuilder::on(plot)
            .margin(MARGIN_PX)
            .x_label_area_size(LABELS_PX)
            .y_label_area_size(LABELS_PX)
            .build_cartesian_2d(self.x.0..self.x.1, self.y.0..self.y.1)?;
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
        Ok(chart)
    }

    /// The same middle, so many times as wide and high.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let scaled = |(low, high): (f64, f64)| {
            let (middle, half) = (f64::midpoint(low, high), 0.5 * factor * (high - low));
            (middle - half, middle + half)
        };
        Self {
            x: scaled(self.x),
            y: scaled(self.y),
        }
    }

    /// The part that is within another window, which it overlaps.
    pub(super) fn within(&self, other: &Self) -> Self {
        let both = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.min(b.1));
        let mut window = Self {
            x: both(self.x, other.x),
            y: both(self.y, other.y),
        };
        window.widen_to_half_as_high();
        window
    }

    /// The same middle, of another width and height.
    pub(super) fn of_size(&self, [width, height]: [f64; 2]) -> Self {
        let around = |(low, high): (f64, f64), size: f64| {
            let middle = f64::midpoint(low, high);
            (middle - size / 2.0, middle + size / 2.0)
        };
        Self {
            x: around(self.x, width),
            y: around(self.y, height),
        }
    }

    pub(super) fn size(&self) -> [f64; 2] {
        [self.x, self.y].map(|(low, high)| high - low)
    }

    /// What a chart shows.
    pub(super) fn of(chart: &Chart<'_>) -> Self {
        let bounds = |range: std::ops::Range<f64>| (range.start, range.end);
        Self {
            x: bounds(chart.x_range()),
            y: bounds(chart.y_range()),
        }
    }

    /// The pieces of a line that are in the window: what is outside would be drawn along its edge.
    pub(super) fn inside(&self, line: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
        let shows = |&(x, y): &(f64, f64)| {
            (self.x.0..=self.x.1).contains(&x) && (self.y.0..=self.y.1).contains(&y)
        };
        line.chunk_by(|a, b| shows(a) == shows(b))
            .filter(|piece| piece.first().is_some_and(shows))
            .map(<[_]>::to_vec)
            .collect()
    }

    /// An outline, as much of it as shows.
    pub(super) fn clamped(&self, outline: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let clamped =
            |&(x, y): &(f64, f64)| (x.clamp(self.x.0, self.x.1), y.clamp(self.y.0, self.y.1));
        outline.iter().map(clamped).collect()
    }

    /// A window much taller than wide would make a picture of several screens.
    fn widen_to_half_as_high(&mut self) {
        let missing = (self.y.1 - self.y.0) - (self.x.1 - self.x.0);
        if missing > 0.0 {
            self.x = (self.x.0 - missing / 2.0, self.x.1 + missing / 2.0);
        }
        let missing = 0.4 * (self.x.1 - self.x.0) - (self.y.1 - self.y.0);
        if missing > 0.0 {
            self.y = (self.y.0 - missing / 2.0, self.y.1 + missing / 2.0);
        }
    }

    /// Height that makes a metre equally long on both axes, where `beside_px` of the width and of the height are no plot.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Between 40 % and 100 % of the width.
    pub(super) fn height_px(&self, width_px: u32, beside_px: u32) -> u32 {
        let plot_width = f64::from(width_px - beside_px);
        let plot_height = plot_width * (self.y.1 - self.y.0) / (self.x.1 - self.x.0);
        plot_height.round() as u32 + beside_px
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_line_only_what_is_inside_remains() {
        let window = Window {
            x: (0.0, 1.0),
            y: (0.0, 1.0),
        };
        let line = [(0.1, 0.1), (0.2, 0.2), (0.3, 1.5), (0.4, 0.4), (9.0, 0.5)];
        assert_eq!(
            window.inside(&line),
            [vec![(0.1, 0.1), (0.2, 0.2)], vec![(0.4, 0.4)]]
        );
    }

    #[test]
    fn a_long_row_and_a_tall_one_make_pictures_of_a_bearable_shape() {
        let height = |places: [(f64, f64); 2]| {
            let window = Window::around(places.into_iter());
            window.height_px(1050, 50)
        };
        assert_eq!(height([(0.0, 0.0), (9.0, 0.0)]), 400 + 50);
        assert_eq!(height([(0.0, 0.0), (0.0, 9.0)]), 1000 + 50);
    }
}
