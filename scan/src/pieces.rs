//! Where a scan jumps.

use crate::beams::Beams;
use crate::view::Met;

/// A jump is wider than that at least \[m\].
const LEAST_JUMP_M: f64 = 0.07;
/// A surface that leans away by two to one is still one.
const LEANING: f64 = 2.0;

/// Beams next to each other whose ranges do not jump.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    /// Place of its first beam.
    pub(crate) first: usize,
    /// So many beams; those after the last one of the scan are its first ones.
    pub(crate) count: usize,
}

/// Cuts the beams wherever their ranges jump. What does not fit into `pieces` is left out; how many.
pub(crate) fn cut(beams: &Beams, farthest_m: f64, pieces: &mut Vec<Piece>) -> u64 {
    pieces.clear();
    let mut left_out = 0;
    let mut open: Option<(Piece, f64)> = None;
    let mut keep = |piece: Piece| {
        if pieces.len() < pieces.capacity() {
            pieces.push(piece);
        } else {
            left_out += 1;
        }
    };
    for place in 0..beams.count() {
        let range = match beams.met(place) {
            Met::Surface(range) if range <= farthest_m => Some(range),
            _ => None,
        };
        open = match (open, range) {
            (Some((piece, before)), Some(range)) if !jumps(before, range, beams.step_rad()) => {
                Some((
                    Piece {
                        count: piece.count + 1,
                        ..piece
                    },
                    range,
                ))
            }
            (before, range) => {
                if let Some((piece, _)) = before {
                    keep(piece);
                }
                range.map(|range| {
                    let piece = Piece {
                        first: place,
                        count: 1,
                    };
                    (piece, range)
                })
            }
        };
    }
    if let Some((piece, _)) = open {
        keep(piece);
    }
    close(beams, farthest_m, pieces);
    left_out
}

/// Where the scanner sees all round, the last piece goes on with the first one if there is no jump between them.
fn close(beams: &Beams, farthest_m: f64, pieces: &mut Vec<Piece>) {
    let (Some(first), Some(last)) = (pieces.first().copied(), pieces.last().copied()) else {
        return;
    };
    let end = last.first + last.count;
    let meet = first.first == 0 && end == beams.count() && first != last;
    let ranges = [end.saturating_sub(1), 0].map(|place| match beams.met(place) {
        Met::Surface(range) if range <= farthest_m => Some(range),
        _ => None,
    });
    let [Some(before), Some(after)] = ranges else {
        return;
    };
    if beams.is_round() && meet && !jumps(before, after, beams.step_rad()) {
        pieces.remove(0);
        if let Some(last) = pieces.last_mut() {
            last.count += first.count;
        }
    }
}

fn jumps(before: f64, range: f64, step_rad: f64) -> bool {
    let beside = before.min(range) * step_rad;
    (range - before).abs() > LEAST_JUMP_M.max(LEANING * beside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beams::ScannerMotion;
    use crate::view::{Raw, View};

    #[test]
    fn a_piece_goes_on_across_the_seam_of_a_scan_that_goes_round() {
        // Forty beams, of which those in between meet nothing.
        let cut_at = |first: &[f32], last: &[f32], step: f32| {
            let mut ranges = [9.0; 40];
            ranges[..first.len()].copy_from_slice(first);
            ranges[40 - last.len()..].copy_from_slice(last);
            let raw = Raw {
                angle_increment_rad: step,
                range_max_m: 10.0,
                ranges: &ranges,
                ..Raw::default()
            };
            let mut beams = Beams::new();
            beams.fill(&View::check(raw).unwrap(), ScannerMotion::default());
            let mut pieces = Vec::with_capacity(8);
            cut(&beams, 8.0, &mut pieces);
            let cut_at: Vec<_> = pieces.iter().map(|it| (it.first, it.count)).collect();
            cut_at
        };
        let step = std::f32::consts::TAU / 40.0;
        let split = [1.0, 1.0, 5.0];
        assert_eq!(
            cut_at(&split, &[3.0, 1.0], step),
            [(2, 1), (38, 1), (39, 3)]
        );
        let half = cut_at(&split, &[3.0, 1.0], 0.5 * step);
        assert_eq!(half, [(0, 2), (2, 1), (38, 1), (39, 1)]);
        assert_eq!(cut_at(&[4.0, 4.0], &[1.0], step), [(0, 2), (39, 1)]);
        assert_eq!(cut_at(&[2.0; 40], &[], step), [(0, 40)]);
    }

    #[test]
    fn pieces_end_where_ranges_jump_or_nothing_is_hit() {
        let ranges = [1.0, 1.02, 1.01, 1.5, 1.52, 20.0, 1.0, f32::NAN, 1.0];
        let raw = Raw {
            angle_increment_rad: 0.01,
            range_max_m: 10.0,
            ranges: &ranges,
            ..Raw::default()
        };
        let mut beams = Beams::new();
        beams.fill(&View::check(raw).unwrap(), ScannerMotion::default());
        let mut pieces = Vec::with_capacity(8);
        assert_eq!(cut(&beams, 8.0, &mut pieces), 0);
        let cut_at: Vec<_> = pieces.iter().map(|it| (it.first, it.count)).collect();
        assert_eq!(cut_at, [(0, 3), (3, 2), (6, 1), (8, 1)]);
        let mut few = Vec::with_capacity(2);
        assert_eq!(cut(&beams, 8.0, &mut few), 2);
    }
}
