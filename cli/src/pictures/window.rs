//! The part of the plane that a picture shows, a metre as long on both axes.

use super::style::extent;

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
