//! What is published where it is not known who is right: a mean, and a covariance that holds every possibility.
//!
//! For each of them that is not the mean itself the position's covariance grows by `e eᵀ + C_pp`, e its distance from the mean, and
//! the heading's variance by `e_φ² + σ_φ²`, without what they have in common: its sign is chance near half a turn. The truth's NEES
//! grows by at most 2, whoever is right.

use nalgebra::Matrix2;

use super::hypothesis::Hypothesis;
use super::lifted::{Lifted, UNKNOWN_HEADING, Wandering};
use super::{Dissent, FindingState, Found, SILENT};
use crate::angle::wrap;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::honest::{Increments, Swept};
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
        pp: UNKNOWN_HEADING * UNKNOWN_HEADING,
        ..Symmetric3::ZERO
    };
    Belief::gaussian(
        Pose::new(x, y, 0.0),
        Parts::dependent(Covariance3::trusted(&covariance)),
    )
}

impl Found {
    /// What to publish instead of the belief, `way` from what has left the history to now.
    pub(crate) fn cover(&self, belief: &Belief, way: &Increments, settings: &Settings) -> Belief {
        let swept = way.swept(0.0);
        let lever = settings.fusion.heading_lever_m;
        let mean = if self.knows {
            *belief
        } else {
            self.best_guess(&swept, lever)
        };
        let mut covariance = mean.total().symmetric();
        for lifted in self.others(lever) {
            covariance = covariance + spread(&moved(lifted, &swept), &mean.pose);
        }
        Belief::gaussian(
            mean.pose,
            Parts::dependent(Covariance3::trusted(&covariance)),
        )
    }

    fn best_guess(&self, swept: &Swept, lever: f64) -> Belief {
        let tightest = self.tightest(lever).map(|hypothesis| hypothesis.lifted);
        let guess = tightest.or(self.seed);
        guess.map_or_else(|| nowhere(None), |lifted| moved(lifted, swept).as_belief())
    }

    fn tightest(&self, lever: f64) -> Option<&Hypothesis> {
        let hypotheses = self.hypotheses().map(|(_, hypothesis)| hypothesis);
        hypotheses.min_by(|a, b| a.lifted.size(lever).total_cmp(&b.lifted.size(lever)))
    }

    /// All that the mean is not.
    fn others(&self, lever: f64) -> impl Iterator<Item = Lifted> {
        let best = self.tightest(lever).filter(|_| !self.knows);
        let hypotheses = self.hypotheses().filter(move |(seat, hypothesis)| {
            let is_mean = best.is_some_and(|best| core::ptr::eq(best, *hypothesis));
            !is_mean && (!self.knows || seat.disagrees(self.last_word))
        });
        hypotheses.map(|(_, hypothesis)| hypothesis.lifted)
    }

    /// The state once everything up to `now` has left the history; `belief` is the one then.
    pub(crate) fn conclude(&mut self, now: Stamp, belief: &Belief) {
        let state = self.state(now);
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

fn moved(mut lifted: Lifted, swept: &Swept) -> Lifted {
    lifted.step(swept, Wandering::NONE);
    lifted
}

/// `e eᵀ + C_pp`, `e_φ² + σ_φ²`
fn spread(lifted: &Lifted, mean: &Pose) -> Symmetric3 {
    let pose = lifted.pose();
    let own = lifted.as_belief().total().symmetric();
    let turned = if lifted.direction().is_resolved() {
        wrap(pose.phi - mean.phi)
    } else {
        0.0 // Its variance is that of all headings.
    };
    let apart = [pose.x - mean.x, pose.y - mean.y, turned];
    Symmetric3 {
        xp: 0.0,
        yp: 0.0,
        ..own + Symmetric3::outer(1.0, apart)
    }
}
