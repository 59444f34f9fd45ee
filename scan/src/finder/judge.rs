//! Which fits stand up to every beam.

use nalgebra::Matrix2;

use super::Finder;
use super::candidate::{Candidate, MODES};
use super::reading::wrapped;
use super::verdict::Verdict;
use crate::fit::{Fit, flatness, most_chi2};
use crate::shape::Body;

/// Fits that differ by less are one \[m, rad\].
const ALIKE_M: f64 = 0.03;
const ALIKE_RAD: f64 = 0.05;
/// A straight line must fit worse than a circle by so much, where none, one or both of its ends are seen in front of something farther.
const CURVED: [f64; 3] = [12.0, 2.0, 0.0];
/// The same of a rectangle of which no end is seen: where along a face it stands is told by its other face alone.
const CORNERED: f64 = 25.0;
/// By so much more often does something else look like a robot of which that is seen.
const CLUTTER: [f64; 3] = [4.0, 2.0, 1.0];
/// Of two fits, one whose score is higher by that.
const CLEARLY_BETTER: f64 = 16.0;
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

    /// Takes a fit into a candidate, if it stands up to every beam.
    pub(super) fn judge(&self, candidate: &mut Candidate, fit: Option<Fit>, middle: usize) {
        let Some(fit) = fit else {
            return;
        };
        let is_good = fit.chi2 <= most_chi2(fit.freedom) && self.is_sharp(&fit);
        if !is_good {
            return;
        }
        let verdict = Verdict::of(
            &self.beams,
            &self.settings.noise,
            &fit,
            candidate.time_s,
            middle,
        );
        // One that grazes the rim, or gives a range in between, is a beam that met it all the same.
        let is_one = verdict.hits + 1 >= self.settings.least_beams
            && verdict.through * 8 <= verdict.hits
            && !(verdict.beside[0] && verdict.beside[1])
            && self.is_no_wall(&fit, verdict.ends());
        if !is_one {
            return;
        }
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let score = 8.0 * verdict.hits as f64 - 16.0 * verdict.through as f64 - fit.chi2;
        if score > candidate.score + CLEARLY_BETTER {
            candidate.fits = [None; MODES];
        } else if score < candidate.score - CLEARLY_BETTER {
            return;
        }
        candidate.score = candidate.score.max(score);
        candidate.beams = candidate.beams.max(verdict.hits);
        candidate.clutter = CLUTTER[verdict.ends()] * if verdict.is_flat() { FLAT } else { 1.0 };
        let same = candidate
            .fits
            .iter()
            .flatten()
            .any(|other| fit.is_like(other));
        if let Some(free) = candidate
            .fits
            .iter_mut()
            .find(|it| it.is_none())
            .filter(|_| !same)
        {
            *free = Some(fit);
        }
    }

    pub(super) fn is_sharp(&self, fit: &Fit) -> bool {
        let position: Matrix2<f64> = fit.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let worst = position.symmetric_eigenvalues().max();
        let is_covariance =
            fit.covariance.iter().all(|it| it.is_finite()) && position.cholesky().is_some();
        is_covariance && worst <= self.settings.most_sigma_m * self.settings.most_sigma_m
    }
}

impl Fit {
    /// Whether it stands as another one does.
    fn is_like(&self, other: &Self) -> bool {
        let apart = (self.body.centre() - other.body.centre()).norm();
        let turned = self.heading.zip(other.heading).map_or(0.0, |(a, b)| {
            let turned = 2.0 * (a - b);
            0.5 * wrapped(turned).abs()
        });
        apart < ALIKE_M && turned < ALIKE_RAD
    }
}
