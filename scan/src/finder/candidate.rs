//! What looks like a robot, and what of it is one thing.

use nalgebra::Vector2;

use crate::fit::Fit;
use crate::shape::Body;

/// As many bodies of a scan are told apart.
const MOST_BODIES: usize = 64;
/// So many ways to stand that differ may fit one body.
pub(super) const MODES: usize = 4;

/// Something that looks like a robot.
#[derive(Copy, Clone, Debug)]
pub(super) struct Candidate {
    pub(super) look: usize,
    pub(super) fits: [Option<Fit>; MODES],
    pub(super) time_s: f64,
    pub(super) beams: usize,
    pub(super) score: f64,
    /// How often something else looks like that, over how often it does at best.
    pub(super) clutter: f64,
}

impl Candidate {
    pub(super) fn body(&self) -> Body {
        let fit = self.fits.iter().flatten().next();
        fit.map_or(
            Body::Round {
                centre: Vector2::zeros(),
                radius: 0.0,
            },
            |fit| fit.body,
        )
    }
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

    /// Where two overlap, the better stays. Whether there was room.
    pub(super) fn keep(&mut self, candidate: &Candidate) -> bool {
        if candidate.fits.iter().all(Option::is_none) {
            return true;
        }
        // As what it looks like is for the odds to say.
        let overlaps =
            |other: &Candidate| other.look == candidate.look && overlap(other, candidate);
        let better = |other: &Candidate| overlaps(other) && other.score >= candidate.score;
        if self.0.iter().any(better) {
            return true;
        }
        self.0.retain(|other| !overlaps(other));
        let has_room = self.0.len() < MOST_BODIES;
        if has_room {
            self.0.push(*candidate);
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
    use nalgebra::Matrix3;

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
            fits: [Some(fit), None, None, None],
            time_s: 0.0,
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
