//! What looks like a robot, and what of it is one thing.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::reading::wrapped;
use crate::fit::Fit;
use crate::shape::Body;

/// As many bodies of a scan are told apart.
const MOST_BODIES: usize = 64;
/// So many ways to stand that differ may fit one body.
pub(super) const MODES: usize = 6;
/// Of two fits to one body, one whose score is higher by that is right.
pub(super) const CLEARLY_BETTER: f64 = 16.0;
/// Fits that differ by less are one \[m, rad\], and those within so many σ of one another.
const ALIKE_M: f64 = 0.03;
const ALIKE_RAD: f64 = 0.05;
const SAME_SIGMAS: f64 = 2.0;

/// A way to stand, seen from where the scanner was at a moment.
#[derive(Copy, Clone, Debug)]
pub(super) struct Mode {
    pub(super) fit: Fit,
    pub(super) time_s: f64,
    /// All beams that met it agree; else something is there, but not so surely like that that it could be said.
    pub(super) is_settled: bool,
}

impl Mode {
    /// From another one to this \[m, m, rad\].
    fn off(&self, other: &Self) -> Vector3<f64> {
        let (own, other) = (&self.fit, &other.fit);
        let apart = own.body.centre() - other.body.centre();
        let turned = own.heading.zip(other.heading);
        let turned = turned.map_or(0.0, |(a, b)| 0.5 * wrapped(2.0 * (a - b)));
        Vector3::new(apart.x, apart.y, turned)
    }

    /// Whether it is the way in which another one stands, as far as that is known.
    fn is_like(&self, other: &Self) -> bool {
        let off = self.off(other);
        let (own, other) = (&self.fit.covariance, &other.fit.covariance);
        let widest = |of: fn(&Matrix3<f64>) -> f64| SAME_SIGMAS * of(own).max(of(other)).sqrt();
        let far = widest(|it| it[(0, 0)].max(it[(1, 1)]));
        off.xy().norm() < ALIKE_M.max(far) && off.z.abs() < ALIKE_RAD.max(widest(|it| it[(2, 2)]))
    }

    /// The better of two that are one, as uncertain as it is which of them is right.
    fn with(&self, other: &Self) -> Self {
        let (mut better, worse) = if other.fit.chi2 < self.fit.chi2 {
            (*other, self)
        } else {
            (*self, other)
        };
        let off = worse.off(&better);
        let odds = (0.5 * (better.fit.chi2 - worse.fit.chi2)).exp();
        better.fit.covariance += off * off.transpose() * (odds / (1.0 + odds));
        better
    }
}

/// Something that looks like a robot.
#[derive(Copy, Clone, Debug)]
pub(super) struct Candidate {
    pub(super) look: usize,
    pub(super) modes: [Option<Mode>; MODES],
    pub(super) beams: usize,
    pub(super) score: f64,
    /// How often something else looks like that, over how often it does at best.
    pub(super) clutter: f64,
}

impl Candidate {
    pub(super) fn body(&self) -> Body {
        let mode = self.modes.iter().flatten().next();
        mode.map_or(
            Body::Round {
                centre: Vector2::zeros(),
                radius: 0.0,
            },
            |mode| mode.fit.body,
        )
    }

    /// In which ways it may stand as well, from one that fits hardly worse.
    fn learn(&mut self, worse: &Self) {
        if self.score - worse.score <= CLEARLY_BETTER {
            worse
                .modes
                .iter()
                .flatten()
                .for_each(|mode| self.add(*mode));
        }
    }

    /// One more way in which it may stand, if there is room; of two that are one, the better.
    pub(super) fn add(&mut self, mode: Mode) {
        let mut known = self.modes.iter_mut().flatten();
        if let Some(known) = known.find(|it| it.is_like(&mode)) {
            *known = known.with(&mode);
        } else if let Some(free) = self.modes.iter_mut().find(|it| it.is_none()) {
            *free = Some(mode);
        }
    }
}

/// A single way to stand.
pub(super) fn modes(fit: Fit, time_s: f64) -> [Option<Mode>; MODES] {
    let mut modes = [None; MODES];
    modes[0] = Some(Mode {
        fit,
        time_s,
        is_settled: true,
    });
    modes
}

/// All of a scan.
#[derive(Debug)]
pub(super) struct Candidates(Vec<Candidate>);

impl Candidates {
    pub(super) fn new() -> Self {
        Self(Vec::with_capacity(MOST_BODIES))
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    pub(super) fn all(&self) -> &[Candidate] {
        &self.0
    }

    /// Where two overlap, the better stays; in which way it stands, the other one may know, unless it is clearly worse. Whether there
    /// was room.
    pub(super) fn keep(&mut self, candidate: &Candidate) -> bool {
        if candidate.modes.iter().all(Option::is_none) {
            return true;
        }
        // As what it looks like is for the odds to say.
        let overlaps =
            |other: &Candidate| other.look == candidate.look && overlap(other, candidate);
        let better = |other: &&mut Candidate| overlaps(other) && other.score >= candidate.score;
        if let Some(better) = self.0.iter_mut().find(better) {
            better.learn(candidate);
            return true;
        }
        let mut best = *candidate;
        for other in self.0.iter().filter(|other| overlaps(other)) {
            best.learn(other);
        }
        self.0.retain(|other| !overlaps(other));
        let has_room = self.0.len() < MOST_BODIES;
        if has_room {
            self.0.push(best);
        }
        has_room
    }

    /// The first of those that are one thing with this one, and by how much this one fits worse than the best of them.
    pub(super) fn thing(&self, seen: usize) -> (usize, f64) {
        let own = &self.0[seen];
        let mut same = self.0.iter().enumerate().filter(|(_, it)| overlap(it, own));
        let first = same.next().map_or(seen, |(place, _)| place);
        let same = self.0.iter().filter(|it| overlap(it, own));
        let best = same.map(|it| it.score).fold(own.score, f64::max);
        (first, best - own.score)
    }
}

fn overlap(one: &Candidate, other: &Candidate) -> bool {
    let [one, other] = [one, other].map(Candidate::body);
    let inner = 0.4 * (inner(&one) + inner(&other));
    one.contains(other.centre(), inner) || other.contains(one.centre(), inner)
}

fn inner(body: &Body) -> f64 {
    match *body {
        Body::Round { radius, .. } => radius,
        Body::Square { half, .. } => half.min(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round(look: usize, x: f64, score: f64) -> Candidate {
        let body = Body::Round {
            centre: Vector2::new(x, 0.0),
            radius: 0.25,
        };
        let fit = Fit {
            body,
            covariance: Matrix3::identity(),
            heading: None,
            chi2: 0.0,
            freedom: 1.0,
            lone: None,
        };
        Candidate {
            look,
            modes: modes(fit, 0.0),
            beams: 5,
            score,
            clutter: 1.0,
        }
    }

    #[test]
    fn where_two_overlap_the_better_stays() {
        let mut all = Candidates::new();
        for (x, score) in [(1.0, 1.0), (1.05, 3.0), (1.1, 2.0), (3.0, 0.5)] {
            assert!(all.keep(&round(0, x, score)));
        }
        let scores: Vec<_> = all.all().iter().map(|it| it.score.to_bits()).collect();
        assert_eq!(scores, [3.0_f64, 0.5].map(f64::to_bits));
    }

    #[test]
    fn two_looks_of_one_thing_are_one_thing() {
        let mut all = Candidates::new();
        all.keep(&round(0, 1.0, 1.0));
        all.keep(&round(1, 1.05, 3.0));
        all.keep(&round(1, 3.0, 2.0));
        assert_eq!(all.all().len(), 3);
        assert_eq!([0, 1, 2].map(|it| all.thing(it).0), [0, 0, 2]);
        assert!((all.thing(0).1 - 2.0).abs() < 1e-12 && all.thing(1).1.abs() < 1e-12);
    }

    #[test]
    fn what_there_is_no_room_for_is_said() {
        let mut all = Candidates::new();
        let mut x = 0.0;
        for _ in 0..MOST_BODIES {
            x += 1.0;
            assert!(all.keep(&round(0, x, 1.0)));
        }
        assert!(!all.keep(&round(0, x + 1.0, 1.0)));
    }
}
