//! A legend in rows of its own, above what it explains: it covers nothing, however many names there are.

use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::style::INK;
use super::{Area, Failure};

const ROW_PX: u32 = 22;
/// Where the first name of a row begins: above the panels' axes.
const LEFT_PX: u32 = 80;
/// Between a key and its name, and from a name to the next key.
const GAPS_PX: u32 = 5 + 18;
const KEY_PX: u32 = 18;
/// About the width of a letter.
const LETTER_PX: usize = 8;

/// Of a dashed line, the dashes and the gaps between them.
pub(super) const DASH_PX: [u32; 2] = [6, 4];

/// Half the size of a cross.
pub(super) const CROSS_PX: u32 = 4;

/// Names with the look of what they name.
pub(super) struct Legend {
    keys: Vec<(String, Look)>,
    /// All sizes are so many times as large.
    scale: u32,
}

/// How a line is drawn.
#[derive(Copy, Clone)]
pub(super) enum Look {
    Solid(ShapeStyle),
    Dashed(ShapeStyle),
    /// Places, not a line.
    Cross(ShapeStyle),
    /// The same, of this radius.
    Dot(ShapeStyle, u32),
}

impl Legend {
    pub(super) fn new(keys: Vec<(String, ShapeStyle)>) -> Self {
        let solid = |(name, style)| (name, Look::Solid(style));
        Self::of_looks(keys.into_iter().map(solid).collect())
    }

    pub(super) fn of_looks(keys: Vec<(String, Look)>) -> Self {
        Self { keys, scale: 1 }
    }

    pub(super) fn scaled(self, scale: u32) -> Self {
        Self { scale, ..self }
    }

    /// Names of filled areas.
    pub(super) fn of_colors(names: &[(&str, RGBColor)]) -> Self {
        let key = |(name, color): &(&str, RGBColor)| ((*name).to_owned(), color.stroke_width(12));
        Self::new(names.iter().map(key).collect())
    }

    pub(super) fn height_px(&self, width_px: u32) -> u32 {
        let rows = self.keys.len().div_ceil(self.columns(width_px));
        self.scale * (ROW_PX * u32::try_from(rows).unwrap_or(1) + 4)
    }

    /// All columns are as wide as the longest name wants.
    fn column_px(&self) -> u32 {
        let longest = self.keys.iter().map(|(name, _)| name.chars().count()).max();
        let name_px = LETTER_PX * longest.unwrap_or(0).min(100);
        self.scale * (KEY_PX + GAPS_PX + u32::try_from(name_px).unwrap_or(0))
    }

    fn columns(&self, width_px: u32) -> usize {
        let columns = width_px.saturating_sub(self.scale * LEFT_PX) / self.column_px();
        usize::try_from(columns).unwrap_or(1).max(1)
    }

    pub(super) fn draw(&self, area: &Area<'_>) -> Result<(), Failure> {
        let (columns, scale) = (self.columns(area.dim_in_pixel().0), pixels(self.scale));
        let key_px = scale * pixels(KEY_PX);
        for (index, (name, look)) in self.keys.iter().enumerate() {
            let (row, column) = (index / columns, index % columns);
            let x = scale * pixels(LEFT_PX) + pixels(self.column_px()) * whole(column);
            let y = scale * (pixels(ROW_PX) * whole(row) + 11);
            let line = [(x, y), (x + key_px, y)];
            match *look {
                Look::Solid(style) => area.draw(&PathElement::new(line, style))?,
                Look::Dashed(style) => area.draw(&dashed(line, style))?,
                Look::Cross(style) => {
                    area.draw(&Cross::new((x + key_px / 2, y), CROSS_PX, style))?;
                }
                Look::Dot(style, radius_px) => {
                    area.draw(&Circle::new((x + key_px / 2, y), radius_px, style))?;
                }
            }
            let font = ("sans-serif", 14 * scale).into_font().color(&INK);
            area.draw(&Text::new(
                name.clone(),
                (x + key_px + scale * 5, y - scale * 7),
                font,
            ))?;
        }
        Ok(())
    }
}

/// A dashed line through the points.
pub(super) fn dashed<T, P>(points: P, style: ShapeStyle) -> DashedPathElement<P::IntoIter, u32>
where
    P: IntoIterator<Item = T, IntoIter: Clone>,
{
    let [dash, gap] = DASH_PX;
    DashedPathElement::new(points, dash, gap, style)
}

fn pixels(px: u32) -> i32 {
    i32::try_from(px).unwrap_or(0)
}

fn whole(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_its_place_within_the_width() {
        let names: Vec<String> = (1..=33).map(|robot| format!("robot{robot}")).collect();
        let key = |name: &String| (name.clone(), BLACK.stroke_width(2));
        let legend = Legend::new(names.iter().map(key).collect());
        let columns = legend.columns(1000);
        assert!(
            columns > 5 && LEFT_PX + legend.column_px() * u32::try_from(columns).unwrap() <= 1000
        );
        let rows = 33_usize.div_ceil(columns);
        assert!(legend.height_px(1000) >= ROW_PX * u32::try_from(rows).unwrap());
        assert_eq!(legend.columns(10), 1);
    }
}
