//! One error that moves all priors alike: that of the own heading.
//!
//! Every prior swings about one point by the same angle δ. The odds of all pairs are worked out for some angles, as if δ were known, and
//! each counts as much as it explains the whole scan: `p(δ) ∝ exp(−δ²/2σ²) Σ over all ways`. The angles lie so close that the sum is the
//! integral.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector2, Vector3};

use super::Finder;
use super::place::Place;
use super::reading::{Reading, wrapped};
use crate::associate::Odds;

/// How far the own heading may be off.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct OwnHeading {
    /// Its variance, which the covariances of all priors have in them \[rad²\].
    pub variance: f64,
    /// Where everything swings about that stands around the robot: near its origin, forward and left of the scanner \[m\].
    pub about_m: [f64; 2],
}

/// So much information about δ, in its own σ, is as good as none.
const NOTHING: f64 = 0.01;
/// δ is looked at up to so many σ, at so many angles on each side.
const FARTHEST_SIGMAS: f64 = 5.5;
const MOST_ANGLES: i32 = 48;

/// So often is the most likely δ of one pair bettered.
const STEPS: usize = 3;

/// δ, with what it takes to turn by it.
#[derive(Copy, Clone, Debug)]
struct Turn {
    delta: f64,
    sin: f64,
    cos: f64,
}

impl Turn {
    fn by(delta: f64) -> Self {
        let (sin, cos) = delta.sin_cos();
        Self { delta, sin, cos }
    }
}

/// What a place has in common with all others.
#[derive(Copy, Clone, Debug)]
pub(super) struct Swing {
    variance: f64,
    about: Vector2<f64>,
    mean: Vector3<f64>,
    /// Covariance of the place, if δ were known.
    rest: Matrix3<f64>,
    slope: Vector3<f64>,
}

impl Swing {
    /// As far as the covariance allows; what it does not is no common error.
    pub(super) fn of(own: &OwnHeading, mean: &Vector3<f64>, covariance: &Matrix3<f64>) -> Self {
        let about = Vector2::from(own.about_m);
        let arm = mean.xy() - about;
        let slope = Vector3::new(-arm.y, arm.x, 1.0);
        Self {
            variance: own.variance,
            about,
            mean: *mean,
            rest: covariance - slope * slope.transpose() * own.variance,
            slope,
        }
    }

    /// Whether there is such an error.
    pub(super) fn is_there(&self) -> bool {
        self.variance > 0.0
    }

    /// Covariance of what is seen at the place, if δ were known, inverted; without a heading the third row and column are zero.
    fn inverse(&self, of_reading: &Matrix3<f64>, has_heading: bool) -> Option<(Matrix3<f64>, f64)> {
        let sum = self.rest + of_reading;
        if has_heading {
            return Some((sum.try_inverse()?, sum.determinant()));
        }
        let flat = sum.fixed_view::<2, 2>(0, 0).into_owned();
        let mut inverse = Matrix3::zeros();
        inverse
            .fixed_view_mut::<2, 2>(0, 0)
            .copy_from(&flat.try_inverse()?);
        Some((inverse, flat.determinant()))
    }

    /// Mahalanobis distance, squared: the place swings on a circle, not along its tangent, and δ costs what it is off by.
    pub(super) fn distance(&self, reading: &Reading) -> f64 {
        let inverse = self.inverse(&reading.covariance, reading.has_heading);
        let Some((inverse, _)) = inverse else {
            return f64::INFINITY;
        };
        let mut delta = 0.0;
        for _ in 0..STEPS {
            let (off, slope) = self.off(&reading.pose, &Turn::by(delta));
            let information = (slope.transpose() * inverse * slope)[0] + 1.0 / self.variance;
            let pull = (slope.transpose() * inverse * off)[0] - delta / self.variance;
            delta += pull / information;
        }
        let (off, _) = self.off(&reading.pose, &Turn::by(delta));
        (off.transpose() * inverse * off)[0] + delta * delta / self.variance
    }

    /// How far `pose` is from the place that has swung by δ, and which way it swings there.
    fn off(&self, pose: &Vector3<f64>, turn: &Turn) -> (Vector3<f64>, Vector3<f64>) {
        let Turn { delta, sin, cos } = *turn;
        let arm = self.mean.xy() - self.about;
        let arm = Vector2::new(cos * arm.x - sin * arm.y, sin * arm.x + cos * arm.y);
        let place = self.about + arm;
        let turned = wrapped(pose.z - self.mean.z - delta);
        let off = Vector3::new(pose.x - place.x, pose.y - place.y, turned);
        (off, Vector3::new(-arm.y, arm.x, 1.0))
    }
}

/// One way in which a pair may belong together, if δ were known.
#[derive(Copy, Clone, Debug)]
struct Term {
    pose: Vector3<f64>,
    inverse: Matrix3<f64>,
    factor: f64,
    /// What it says of δ \[1/rad²\].
    information: f64,
}

/// How likely a pair is for each δ.
#[derive(Copy, Clone, Debug)]
pub(super) struct Likeness {
    swing: Swing,
    terms: [Option<Term>; 2],
}

impl Likeness {
    /// Of a place and the readings that it may have, without and with a heading, each with the factor of its likelihood.
    pub(super) fn of(place: &Place, readings: [Option<(Reading, f64)>; 2]) -> Self {
        let swing = &place.swing;
        Self {
            swing: *swing,
            terms: readings
                .map(|it| it.and_then(|(reading, factor)| Term::of(swing, &reading, factor))),
        }
    }

    /// Likelier by a factor.
    pub(super) fn times(mut self, factor: f64) -> Self {
        for term in self.terms.iter_mut().flatten() {
            term.factor *= factor;
        }
        self
    }

    fn information(&self) -> f64 {
        let all = self.terms.iter().flatten().map(|it| it.information);
        all.fold(0.0, f64::max)
    }

    /// The weight of the pair, if the heading is off by δ.
    fn at(&self, turn: &Turn) -> f64 {
        let terms = self.terms.iter().flatten();
        terms
            .map(|it| {
                let (off, _) = self.swing.off(&it.pose, turn);
                it.factor * (-0.5 * (off.transpose() * it.inverse * off)[0]).exp()
            })
            .sum()
    }
}

impl Term {
    fn of(swing: &Swing, reading: &Reading, factor: f64) -> Option<Self> {
        let (inverse, determinant) = swing.inverse(&reading.covariance, reading.has_heading)?;
        let dimensions = if reading.has_heading { 3 } else { 2 };
        let root = (TAU.powi(dimensions) * determinant).sqrt();
        let information = (swing.slope.transpose() * inverse * swing.slope)[0];
        (root > 0.0 && information >= 0.0).then(|| Self {
            pose: reading.pose,
            inverse,
            factor: factor / root,
            information,
        })
    }
}

impl Finder {
    /// The odds of all pairs, over every δ that may be.
    pub(super) fn work_out(&mut self) {
        let (robots, missed) = (self.places.len(), self.settings.missed);
        let variance = self.own_heading.variance;
        let step = self.step_of_angles();
        if step.is_none() {
            self.associator
                .work_out(robots, &self.pairs, missed, &mut self.odds);
            return;
        }
        let step = step.unwrap_or(0.0);
        self.mixed.clear();
        self.mixed.resize(self.pairs.len(), Odds::default());
        let (mut top, mut sum) = (f64::NEG_INFINITY, 0.0);
        for angle in -MOST_ANGLES..=MOST_ANGLES {
            let delta = f64::from(angle) * step;
            if delta.abs() > FARTHEST_SIGMAS * variance.sqrt() {
                continue;
            }
            let turn = Turn::by(delta);
            for (pair, likeness) in self.pairs.iter_mut().zip(&self.likenesses) {
                pair.weight = likeness.at(&turn);
            }
            let evidence = self
                .associator
                .work_out(robots, &self.pairs, missed, &mut self.odds);
            let share = evidence - 0.5 * delta * delta / variance;
            if share > top {
                let shrink = (top - share).exp();
                sum *= shrink;
                for it in &mut self.mixed {
                    *it = Odds {
                        own: it.own * shrink,
                        others: it.others * shrink,
                    };
                }
                top = share;
            }
            let share = (share - top).exp();
            sum += share;
            for (mixed, odds) in self.mixed.iter_mut().zip(&self.odds) {
                mixed.own += share * odds.own;
                mixed.others += share * odds.others;
            }
        }
        for (odds, mixed) in self.odds.iter_mut().zip(&self.mixed) {
            odds.own = mixed.own / sum;
            odds.others = mixed.others / sum;
        }
    }

    /// How far angles lie from one another; none where δ changes nothing.
    fn step_of_angles(&self) -> Option<f64> {
        let variance = self.own_heading.variance;
        let of_robot = |robot: usize| {
            let pairs = self.pairs.iter().zip(&self.likenesses);
            let own = pairs.filter(|(pair, _)| pair.robot == robot);
            own.map(|(_, it)| it.information()).fold(0.0, f64::max)
        };
        let information: f64 = (0..self.places.len()).map(of_robot).sum();
        let matters = variance * information > NOTHING;
        let finest = FARTHEST_SIGMAS * variance.sqrt() / f64::from(MOST_ANGLES);
        matters.then(|| (information + 1.0 / variance).sqrt().recip().max(finest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finder::{Prior, Settings};
    use crate::shape::Look;

    const VARIANCE: f64 = 0.03;

    fn place(own: &OwnHeading) -> Place {
        let (arm, near) = (4.0, 0.04);
        let prior = Prior {
            robot: 2,
            look: 0,
            pose: [arm, 0.0, 0.0],
            covariance: [
                [near, 0.0, 0.0],
                [0.0, near + arm * arm * VARIANCE, arm * VARIANCE],
                [0.0, arm * VARIANCE, near + VARIANCE],
            ],
        };
        Place::of(&prior, &[Look::Cylinder { radius_m: 0.2 }], own).unwrap()
    }

    fn seen(angle: f64) -> Reading {
        Reading {
            candidate: 0,
            time_s: 0.0,
            pose: Vector3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 0.0),
            covariance: Matrix3::identity() * 1e-4,
            has_heading: false,
            is_clear: true,
        }
    }

    #[test]
    fn a_pair_is_likeliest_where_its_own_angle_is_and_all_angles_together_are_what_the_prior_says()
    {
        let own = OwnHeading {
            variance: VARIANCE,
            about_m: [0.0; 2],
        };
        let (place, reading) = (place(&own), seen(0.2));
        let likeness = Likeness::of(&place, [Some((reading, 1.0)), None]);
        let at = |delta| likeness.at(&Turn::by(delta));
        assert!(at(0.2) > 10.0 * at(0.05));
        let mut sum = 0.0;
        for it in -800..=800 {
            let delta = f64::from(it) * 0.001;
            let density = (-0.5 * delta * delta / VARIANCE).exp();
            sum += 0.001 * density / (TAU * VARIANCE).sqrt() * at(delta);
        }
        let whole = place.likelihood(&reading, place.distance(&reading));
        // As far as a circle is a straight line.
        assert!((sum / whole - 1.0).abs() < 0.1, "{sum} {whole}");
    }

    #[test]
    fn who_stands_on_the_circle_is_as_near_as_its_angle_is_likely() {
        let own = OwnHeading {
            variance: VARIANCE,
            about_m: [0.0; 2],
        };
        let angle = 0.6;
        let far = place(&own).distance(&seen(angle));
        // Along the circle it is as uncertain as δ makes it, and the rest.
        let along = VARIANCE + 0.0401 / 16.0;
        assert!((far / (angle * angle / along) - 1.0).abs() < 0.01, "{far}");
        // Off the tangent it would be by five σ.
        let straight = place(&OwnHeading::default()).distance(&seen(angle));
        assert!(straight > far + 5.0, "{straight} {far}");
    }

    #[test]
    fn a_heading_that_is_known_asks_for_no_angles() {
        let finder = Finder::new(Settings::of(Vec::new()));
        assert_eq!(finder.step_of_angles(), None);
    }
}
