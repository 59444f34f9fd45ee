//! Which fits stand up to every beam.

use nalgebra::Matrix2;

use super::Finder;
use super::candidate::{CLEARLY_BETTER, Candidate, MODES, Mode};
use super::verdict::Verdict;
use crate::fit::{Fit, flatness, most_chi2};
use crate::shape::Body;

/// A straight line must fit worse than a circle by so much, where none, one or both of its ends are seen in front of something farther.
const CURVED: [f64; 3] = [12.0, 2.0, 0.0];
/// The same of a rectangle of which no end is seen: where along a face it stands is told by its other face alone.
const CORNERED: f64 = 25.0;
/// By so much more often does something else look like a robot of which that is seen.
const CLUTTER: [f64; 3] = [4.0, 2.0, 1.0];
/// And of which one face alone.
const FLAT: f64 = 5.0;

impl Finder {
    /// Whether it is less straight than a wall would be, of which no end or one is seen.
    fn is_no_wall(&self, fit: &Fit, ends: usize) -> bool {
        let bent = match fit.body {
            Body::Round { .. } => CURVED[ends],
            Body::Square { .. } if ends == 0 => CORNERED,
            Body::Square { .. } => return true,
        };
        flatness(&self.samples, fit, &self.settings.noise) > fit.chi2 + bent
    }

    /// What all beams say of a fit to the samples, if it stands up to them, and its score.
    pub(super) fn weigh(&self, fit: &Fit, window: [usize; 2]) -> Option<(Verdict, f64)> {
        let is_good = fit.chi2 <= most_chi2(fit.freedom) && self.is_sharp(fit);
        if !is_good {
            return None;
        }
        let middle = usize::midpoint(window[0], window[1]);
        let time_s = self.beams.time_s(middle);
        let verdict = Verdict::of(&self.beams, &self.settings.noise, fit, time_s, middle);
        // One that grazes the rim, or gives a range in between, is a beam that met it all the same.
        let grazing = usize::from(verdict.ends() > 0);
        let is_one = verdict.hits + grazing >= self.settings.least_beams
            && verdict.through * 8 <= verdict.hits
            && !(verdict.beside[0] && verdict.beside[1])
            && self.is_no_wall(fit, verdict.ends());
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let score = 8.0 * verdict.hits as f64 - 16.0 * verdict.through as f64 - fit.chi2;
        is_one.then_some((verdict, score))
    }

    pub(super) fn is_sharp(&self, fit: &Fit) -> bool {
        let position: Matrix2<f64> = fit.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let worst = position.symmetric_eigenvalues().max();
        let is_covariance =
            fit.covariance.iter().all(|it| it.is_finite()) && position.cholesky().is_some();
        is_covariance && worst <= self.settings.most_sigma_m * self.settings.most_sigma_m
    }
}

impl Candidate {
    /// Takes in a fit that stands up to every beam.
    pub(super) fn take(&mut self, mode: Mode, verdict: &Verdict, score: f64) {
        if score > self.score + CLEARLY_BETTER {
            self.modes = [None; MODES];
        } else if score < self.score - CLEARLY_BETTER {
            return;
        }
        self.score = self.score.max(score);
        self.beams = self.beams.max(verdict.hits);
        self.clutter = CLUTTER[verdict.ends()] * if verdict.is_flat() { FLAT } else { 1.0 };
        self.add(mode);
    }
}
