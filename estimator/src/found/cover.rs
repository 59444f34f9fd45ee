//! What is published where it is not known who is right: a mean, and a covariance that holds every possibility.
//!
//! For each of them that is not the mean itself the position's covariance grows by `e eᵀ + C_pp`, e its distance from the mean, and
//! the heading's variance by `e_φ² + σ_φ²`, without what they have in common: its sign is chance near half a turn. The truth's NEES
//! grows by at most 2, whoever is right.

use nalgebra::Matrix2;

use super::lifted::{Lifted, UNKNOWN_VARIANCE};
use super::stride::Stride;
use super::{Dissent, FindingState, Found, SILENT};
use crate::angle::wrap;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::settings::Settings;
use crate::stamp::Stamp;
use crate::symmetric::Symmetric3;

/// σ of a position of which nothing is known \[m\]: nowhere on Earth is farther away.
const ANYWHERE: f64 = 2e7;

/// A pose of which nothing is known, or only a position and its covariance.
pub(super) fn nowhere(position: Option<([f64; 2], Matrix2<f64>)>) -> Belief {
    let anywhere = Matrix2::identity() * (ANYWHERE * ANYWHERE);
    let ([x, y], at) = position.unwrap_or(([0.0; 2], anywhere));
    let covariance = Symmetric3 {
        xx: at.m11,
        xy: at.m21,
        yy: at.m22,
        pp: UNKNOWN_VARIANCE,
        ..Symmetric3::ZERO
    };
    Belief::gaussian(
        Pose::new(x, y, 0.0),
        Parts::dependent(Covariance3::trusted(&covariance)),
    )
}

impl Found {
    /// What to publish instead of the belief, `way` from what has left the history to now.
    pub(crate) fn cover(&self, belief: &Belief, way: &Stride, settings: &Settings) -> Belief {
        let best = self.best(settings.fusion.heading_lever_m);
        let mean = if self.knows {
            *belief
        } else {
            self.guess(best, way)
        };
        let mut covariance = mean.total().symmetric();
        for lifted in self.others(best) {
            covariance = covariance + spread(&lifted.moved(way), &mean.pose);
        }
        Belief::gaussian(
            mean.pose,
            Parts::dependent(Covariance3::trusted(&covariance)),
        )
    }

    fn guess(&self, best: Option<usize>, way: &Stride) -> Belief {
        let tightest = best.and_then(|at| self.lifted(at)).or(self.seed.as_ref());
        tightest.map_or_else(|| nowhere(None), |lifted| lifted.moved(way).as_belief())
    }

    /// The seat of the tightest hypothesis, where there is no belief.
    fn best(&self, lever: f64) -> Option<usize> {
        if self.knows {
            return None;
        }
        let mut best: Option<(f64, usize)> = None;
        for at in 0..self.seated {
            let Some(size) = self.lifted(at).map(|lifted| lifted.size(lever)) else {
                continue;
            };
            if best.is_none_or(|(least, _)| size.total_cmp(&least).is_lt()) {
                best = Some((size, at));
            }
        }
        best.map(|(_, at)| at)
    }

    fn lifted(&self, at: usize) -> Option<&Lifted> {
        let hypothesis = self.seats.get(at)?.as_ref()?.hypothesis.as_ref()?;
        Some(&hypothesis.lifted)
    }

    /// All that the mean is not.
    fn others(&self, best: Option<usize>) -> impl Iterator<Item = &Lifted> {
        let seats = self.seats[..self.seated].iter().enumerate();
        let others = seats.filter(move |(at, _)| Some(*at) != best);
        others.filter_map(|(_, seat)| {
            let seat = seat.as_ref()?;
            let hypothesis = seat.hypothesis.as_ref()?;
            let counts = !self.knows || seat.disagrees(self.last_word);
            counts.then_some(&hypothesis.lifted)
        })
    }

    /// The state once everything up to `now` has left the history; `belief` is the one then.
    pub(crate) fn conclude(&mut self, now: Stamp, belief: &Belief) {
        let agreed = self.knows && self.suspended.as_slice().is_empty();
        let state = if agreed {
            FindingState::Ok
        } else {
            self.state(now)
        };
        if state != self.finding.state {
            (self.finding.state, self.finding.since) = (state, now);
        }
        self.finding.dissents.clear();
        if self.suspended.as_slice().is_empty() {
            return;
        }
        for seat in self.seats[..self.seated].iter().flatten() {
            let Some(since) = seat.against_since else {
                continue;
            };
            let hypothesis = seat.hypothesis.as_ref();
            let _ = self.finding.dissents.push(Dissent {
                source: seat.source,
                since,
                d2: seat.d2,
                distance_m: hypothesis.map_or(f64::NAN, |it| it.lifted.distance_from(&belief.pose)),
            }); // There are as many places as seats.
        }
    }

    fn state(&self, now: Stamp) -> FindingState {
        let (by, against) = self.balance(now);
        if self.knows && (against == 0 || by > against) {
            return FindingState::Ok;
        }
        if now - self.last_word > SILENT {
            return FindingState::Lost;
        }
        if self.knows {
            FindingState::Contradicted
        } else {
            FindingState::Finding
        }
    }

    /// Another tick begins: what was decided has been told.
    pub(crate) fn begin_tick(&mut self) {
        self.finding.decisions.clear();
    }
}

/// `e eᵀ + C_pp`, `e_φ² + σ_φ²`
#[inline]
fn spread(lifted: &Lifted, mean: &Pose) -> Symmetric3 {
    let direction = lifted.direction();
    let (turned, heading) = if direction.is_resolved() {
        (wrap(direction.heading() - mean.phi), direction.variance())
    } else {
        (0.0, UNKNOWN_VARIANCE) // Its variance is that of all headings.
    };
    let [x, y] = lifted.position();
    let apart = [x - mean.x, y - mean.y, turned];
    Symmetric3 {
        xp: 0.0,
        yp: 0.0,
        ..lifted.unturned_covariance(heading) + Symmetric3::outer(1.0, apart)
    }
}
