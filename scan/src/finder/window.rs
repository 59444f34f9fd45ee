//! Windows of a few pieces, and the fits to each.

use nalgebra::Vector2;

use super::Finder;
use super::candidate::{Candidate, MODES, Mode};
use crate::beams::Ray;
use crate::fit::{End, Fit, STARTS, Sample, cylinder, rectangle, rectangle_starts};
use crate::pieces::Piece;
use crate::shape::{Look, cross};
use crate::view::Met;

/// A robot is cut into no more pieces by what stands in front of it.
const MOST_PIECES_OF_ONE: usize = 8;
/// Beams between two pieces of one robot that met nothing.
const WIDEST_GAP: usize = 2;
/// What is farther than an end by that is behind it \[m\].
const ENDS_M: f64 = 0.15;
/// Every fit with which all beams agree has a better score.
const UNSETTLED: f64 = 1e4;

impl Finder {
    /// All windows of a few pieces that are no larger than a robot.
    pub(super) fn look_through(&mut self, look: usize) {
        let reach = self.settings.looks[look].reach_m();
        for first in 0..self.pieces.len() {
            let a = self.pieces[first];
            let mut before_end = a.first;
            for last in first..first + MOST_PIECES_OF_ONE {
                let Some(b) = self.piece(first, last) else {
                    break;
                };
                if b.first - before_end > WIDEST_GAP {
                    break;
                }
                let end = b.first + b.count;
                before_end = end;
                if !self.fits_in(a.first, end, reach) {
                    break;
                }
                if end - a.first >= self.settings.least_beams {
                    self.try_window(look, a.first, end);
                }
            }
        }
    }

    /// A piece of a window that begins with `first`: where the scanner sees all round, after the last one comes the first one.
    fn piece(&self, first: usize, place: usize) -> Option<Piece> {
        let count = self.pieces.len();
        if place < count {
            return Some(self.pieces[place]);
        }
        let again = place - count;
        let piece = self
            .pieces
            .get(again)
            .filter(|_| again < first && self.beams.is_round());
        piece.map(|it| Piece {
            first: it.first + self.beams.count(),
            ..*it
        })
    }

    /// Whether the beams from `first` to before `end` end no farther from each other than a robot is large.
    fn fits_in(&self, first: usize, end: usize, reach: f64) -> bool {
        let [a, b, middle] =
            [first, end - 1, usize::midpoint(first, end)].map(|it| self.beams.point(it));
        let most = 2.0 * reach + 0.1;
        match (a, b, middle) {
            (Some(a), Some(b), Some(middle)) => {
                (a - b).norm() <= most && (a - middle).norm() <= most && (b - middle).norm() <= most
            }
            (Some(a), Some(b), None) => (a - b).norm() <= most,
            _ => true,
        }
    }

    fn try_window(&mut self, look: usize, first: usize, end: usize) {
        let middle = usize::midpoint(first, end);
        let shape = self.settings.looks[look];
        let reach = shape.reach_m();
        let Some(near) = self.beams.point(middle).or(self.beams.point(first)) else {
            return;
        };
        let about = near + near.normalize() * (0.5 * reach);
        if !self.are_places(look, |it| it.may_be(about)) {
            return;
        }
        let window = [first, end];
        self.gather(window);
        if self.samples.len() < self.settings.least_beams {
            return;
        }
        let mut candidate = Candidate {
            look,
            modes: [None; MODES],
            beams: 0,
            score: f64::NEG_INFINITY,
            clutter: 1.0,
        };
        let mut starts = [None; STARTS];
        match shape {
            Look::Cylinder { .. } => starts[0] = Some((about, 0.0)),
            Look::Rectangle { .. } => {
                let half = half(&shape);
                let all = rectangle_starts(&self.samples, half);
                starts
                    .iter_mut()
                    .zip(all)
                    .for_each(|(it, start)| *it = Some(start));
            }
            Look::Marks(_) => {}
        }
        for start in starts.into_iter().flatten() {
            self.try_start(&mut candidate, &shape, window, start);
        }
        self.keep(&candidate);
    }

    /// Fits a body to the samples of a window, and again to all beams that met what was found: where a piece is missing, or one of
    /// something else is there, an end of the window is none of the body.
    fn try_start(
        &mut self,
        candidate: &mut Candidate,
        shape: &Look,
        mut window: [usize; 2],
        start: (Vector2<f64>, f64),
    ) {
        let Some(mut fit) = self.fit(shape, window, start) else {
            return;
        };
        let Some((mut verdict, mut score)) = self.weigh(&fit, window) else {
            return;
        };
        let middle = usize::midpoint(window[0], window[1]);
        let whole = verdict.window(middle, &self.beams);
        let mut is_settled = true;
        if let Some(whole) = whole.filter(|whole| *whole != window) {
            std::mem::swap(&mut self.samples, &mut self.aside);
            self.gather(whole);
            let start = (fit.body.centre(), fit.heading.unwrap_or(0.0));
            let again = self.fit(shape, whole, start);
            let again = again.and_then(|fit| Some((fit, self.weigh(&fit, whole)?)));
            std::mem::swap(&mut self.samples, &mut self.aside);
            is_settled = again.is_some();
            if let Some(again) = again {
                (fit, (verdict, score)) = again;
                window = whole;
            } else {
                score -= UNSETTLED;
            }
        }
        let time_s = self.beams.time_s(usize::midpoint(window[0], window[1]));
        let mode = Mode {
            fit,
            time_s,
            is_settled,
        };
        candidate.take(mode, &verdict, score);
    }

    fn fit(&self, shape: &Look, window: [usize; 2], start: (Vector2<f64>, f64)) -> Option<Fit> {
        let noise = &self.settings.noise;
        if self.samples.len() < self.settings.least_beams {
            return None;
        }
        match shape {
            Look::Cylinder { radius_m } => cylinder(&self.samples, *radius_m, noise),
            Look::Rectangle { .. } => {
                let ends = self.ends(window);
                let ends: &[End] = match &ends {
                    [Some(a), Some(b)] => &[*a, *b],
                    [Some(a), None] | [None, Some(a)] => &[*a],
                    _ => &[],
                };
                rectangle(&self.samples, ends, half(shape), start, noise)
            }
            Look::Marks(_) => None,
        }
    }

    /// Seen from where the scanner was at the window's middle.
    fn gather(&mut self, [first, end]: [usize; 2]) {
        let time_s = self.beams.time_s(usize::midpoint(first, end));
        self.samples.clear();
        for place in first..end {
            let ray = self.beams.ray(place, time_s);
            if let (Some(point), Met::Surface(range)) = (ray.point(), ray.met) {
                self.samples.push(Sample { ray, point, range });
            }
        }
    }

    /// The ends of a window that stand in front of something farther.
    fn ends(&self, [first, end]: [usize; 2]) -> [Option<End>; 2] {
        let time_s = self.beams.time_s(usize::midpoint(first, end));
        [(first, -1), (end - 1, 1)].map(|(last, by)| {
            let beside = self.beams.beside(last, by)?;
            let (own, other) = (self.beams.ray(last, time_s), self.beams.ray(beside, time_s));
            let Met::Surface(range) = own.met else {
                return None;
            };
            let is_free = match other.met {
                Met::Surface(beyond) => beyond > range + ENDS_M,
                Met::Nothing => true,
                Met::Unknown => false,
            };
            let direction = (own.direction + other.direction).normalize();
            let step = self.beams.step_rad();
            let angle = self.settings.noise.angle_sigma_rad;
            is_free.then(|| End {
                ray: Ray {
                    origin: (own.origin + other.origin) * 0.5,
                    direction,
                    met: Met::Nothing,
                },
                side: cross(own.direction, direction).signum(),
                variance: step * step / 12.0 + angle * angle,
            })
        })
    }
}

/// Of a rectangle, along and across.
fn half(shape: &Look) -> Vector2<f64> {
    match shape {
        Look::Rectangle {
            length_m, width_m, ..
        } => Vector2::new(0.5 * length_m, 0.5 * width_m),
        Look::Cylinder { .. } | Look::Marks(_) => Vector2::zeros(),
    }
}
