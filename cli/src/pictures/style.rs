//! Colours, sizes and axis arithmetic that the pictures share.

use coloc_shm_types::BeliefState;
use coloc_sim::method::Kind;
use plotters::style::{Color, RGBColor, ShapeStyle};

pub(super) const INK: RGBColor = RGBColor(40, 44, 52);
pub(super) const TRUTH: RGBColor = RGBColor(150, 155, 165);
pub(super) const GRID: RGBColor = RGBColor(226, 229, 234);

/// Okabe and Ito's palette, told apart by colour-blind readers too, and four more for larger teams.
const PALETTE: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(20, 20, 20),
    RGBColor(140, 90, 40),
    RGBColor(150, 150, 0),
    RGBColor(110, 60, 160),
];

/// The colour of the `index`-th line; after ten it starts over.
pub(super) fn robot_color(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// The same colour for a method in every picture; variants share their method's.
pub(crate) fn method_color(kind: Kind) -> RGBColor {
    let [
        blue,
        vermilion,
        green,
        pink,
        orange,
        sky,
        _,
        brown,
        olive,
        violet,
    ] = PALETTE;
    match kind {
        Kind::Sl | Kind::SlPlain => TRUTH,
        Kind::Nb => orange,
        Kind::Ei => pink,
        Kind::Ci | Kind::CiDet => sky,
        Kind::SplitCi => blue,
        Kind::Damped | Kind::Coloc | Kind::ColocStep => vermilion,
        Kind::LeaderKf => olive,
        Kind::LeaderSplit => brown,
        Kind::LeaderCross => violet,
        Kind::Ccl
        | Kind::Dkf
        | Kind::Rounds
        | Kind::Rounds5
        | Kind::RoundsStep
        | Kind::RoundsStep5 => green,
    }
}

/// Of a robot that knows where it is, or does not; none of the first robots' colours.
pub(super) fn state_color(index: usize, state: BeliefState) -> RGBColor {
    match state {
        BeliefState::Ok => robot_color(index),
        BeliefState::Finding => RGBColor(230, 159, 0),
        BeliefState::Contradicted => RGBColor(110, 60, 160),
        BeliefState::Lost => RGBColor(20, 20, 20),
    }
}

pub(super) fn line(color: RGBColor, width: u32) -> ShapeStyle {
    color.stroke_width(width)
}

/// A number at an axis: no more digits than it needs, and no minus before zero.
#[allow(clippy::trivially_copy_pass_by_ref)] // The plotting library hands out references.
pub(super) fn tick_label(value: &f64) -> String {
    let rounded = (value * 1e6).round() / 1e6 + 0.0;
    if rounded == 0.0 {
        "0".into()
    } else {
        rounded.to_string()
    }
}

/// Smallest and largest finite value; `[0, 1]` if there is none.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
    if low <= high { (low, high) } else { (0.0, 1.0) }
}

/// Of each piece only so many items that together there are about `most`, evenly spread, ends included: a picture has fewer
/// pixels than a run has ticks.
pub(super) fn thinned<'a, T: 'a, P: AsRef<[T]>>(
    pieces: &'a [P],
    most: usize,
) -> impl Iterator<Item = impl Iterator<Item = &'a T>> {
    let all: usize = pieces.iter().map(|piece| piece.as_ref().len()).sum();
    let step = all.div_ceil(most.max(1)).max(1);
    pieces.iter().map(move |piece| {
        let piece = piece.as_ref();
        let last = piece.len().saturating_sub(1);
        let end = (last % step != 0).then(|| piece.last()).flatten();
        piece.iter().step_by(step).chain(end)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extents_ignore_what_is_not_a_number() {
        assert_eq!(
            extent([f64::NAN, 2.0, -1.0, f64::INFINITY].into_iter()),
            (-1.0, 2.0)
        );
        assert_eq!(extent(std::iter::empty()), (0.0, 1.0));
    }

    #[test]
    fn labels_are_short() {
        assert_eq!(
            [-0.0, 0.1 + 0.2, -2.0].map(|value| tick_label(&value)),
            ["0", "0.3", "-2"]
        );
    }

    #[test]
    fn thinning_keeps_the_ends_of_every_piece_and_hardly_more_than_asked_for() {
        let pieces: [Vec<u32>; 2] = [(0..1001).collect(), (2000..2004).collect()];
        let thin: Vec<Vec<u32>> = thinned(&pieces, 100)
            .map(|p| p.copied().collect())
            .collect();
        assert!(thin[0].len() + thin[1].len() <= 104);
        assert_eq!(
            (thin[0].last(), &thin[1][..]),
            (Some(&1000), &[2000, 2003][..])
        );
        let few: Vec<Vec<u32>> = thinned(&pieces[1..], 100)
            .map(|p| p.copied().collect())
            .collect();
        assert_eq!(few, [[2000, 2001, 2002, 2003]]);
    }
}
