//! A heading: a Kalman update with `H = [0 0 1]`, the innovation wrapped.
//!
//! # A slow error
//!
//! The error of a compass drifts for minutes: iron and currents near it, a map of the declination. What a word has in common with the
//! one before is counted as white noise that is as strong: with τ the memory of the error, `σ_s²` its variance and T the time since the
//! last word
//!
//! ```text
//! R = r + σ_s² (1 + coth(T/2τ))
//! ```
//!
//! `σ_s² coth(T/2τ)` is the process's power at its lowest frequency; it has less at any other, so that no linear filter, however
//! it weighs the words, errs by more than one that had such white noise. The one more is for the first word after a silence, which those
//! that follow it repeat. So the noise stays independent and nothing else of the belief is paid for it: split covariance intersection
//! (`slow`) would double the position's dependent part for a heading, which a robot that has no fixes cannot pay.

use crate::angle::wrap;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::fix::FixUpdate;
use crate::gate::accepts;
use crate::honest;
use crate::kind::SlowError;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::stamp::Span;
use crate::symmetric::{Square3, Symmetric3};

/// The variances of a heading: what it may be off by at once, and what it is to be weighed by.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct HeadingNoise {
    /// r + `σ_s²` \[rad²\]: the gate's.
    pub error: f64,
    /// R \[rad²\]: the gain's.
    pub weight: f64,
}

impl HeadingNoise {
    /// New in each word.
    #[must_use]
    pub fn white(variance: f64) -> Self {
        Self {
            error: variance,
            weight: variance,
        }
    }

    /// With a slow error, `since` the word before; `None`: there was none.
    pub(crate) fn of(white: f64, slow: &SlowError, since: Option<Span>) -> Self {
        if !slow.is_there() {
            return Self::white(white);
        }
        let repeated = since.map_or(1.0, |since| coth_of_half(since, slow.memory));
        Self {
            error: white + slow.variance,
            weight: white + slow.variance * (1.0 + repeated),
        }
    }
}

/// `coth(T/2τ)`; in no time nothing is new.
fn coth_of_half(since: Span, memory: Span) -> f64 {
    let kept = -libm::expm1(-since.as_seconds() / memory.as_seconds());
    if kept > 0.0 {
        (2.0 - kept) / kept
    } else {
        f64::INFINITY
    }
}

/// `own` after a `heading` \[rad\], if d² ≤ `gate` (χ², one degree of freedom; infinite accepts everything).
///
/// Both parts are updated in Joseph's form with the gain of P, and the bend shrinks ([`crate::honest`]).
#[must_use]
pub fn update(own: &Belief, heading: f64, noise: &HeadingNoise, gate: f64) -> FixUpdate {
    let p = own.total().symmetric();
    let innovation = wrap(heading - own.pose.phi);
    let d2 = innovation * innovation / (p.pp + noise.error);
    let refused = FixUpdate {
        belief: *own,
        accepted: false,
        d2,
    };
    if !accepts(d2, gate) {
        return refused;
    }
    let belief = turned(own, &p, innovation, noise.weight);
    if !belief.is_finite() {
        return refused;
    }
    FixUpdate {
        belief,
        accepted: true,
        d2,
    }
}

/// `I − W H` of a heading of that variance.
pub(crate) fn complement(own: &Belief, variance: f64) -> Square3 {
    let p = own.total().symmetric();
    let sum = p.pp + variance;
    let kept = [p.xp, p.yp].map(|it| -it / sum);
    Square3([
        [1.0, 0.0, kept[0]],
        [0.0, 1.0, kept[1]],
        [0.0, 0.0, variance / sum],
    ])
}

#[inline]
fn turned(own: &Belief, p: &Symmetric3, innovation: f64, variance: f64) -> Belief {
    let sum = p.pp + variance;
    if sum.is_infinite() {
        return *own;
    }
    let gain = [p.xp / sum, p.yp / sum, p.pp / sum];
    let [x, y, _] = gain;
    let complement = Square3([[1.0, 0.0, -x], [0.0, 1.0, -y], [0.0, 0.0, variance / sum]]);
    let independent = complement.congruence(&own.parts.independent.symmetric())
        + Symmetric3::outer(variance, gain);
    let dependent = own.parts.dependent.symmetric();
    let (dependent, bend) = honest::left(&dependent, &own.bend, &complement);
    let after = independent.pp + dependent.pp;
    let [dx, dy, dphi] = gain.map(|it| it * innovation);
    let Pose { x, y, phi } = own.pose;
    Belief {
        pose: Pose::new(x + dx, y + dy, phi + dphi),
        parts: Parts {
            independent: Covariance3::trusted(&independent),
            dependent: Covariance3::trusted(&dependent),
        },
        bend: bend.shrunk(own.heading_variance(), after),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;

    use super::*;
    use crate::gate::CHI2_1_99;

    fn belief(phi: f64) -> Belief {
        let p = [0.04, 0.006, 0.002, 0.006, 0.09, -0.003, 0.002, -0.003, 0.01];
        Belief::independent(
            Pose::new(1.0, 2.0, phi),
            Covariance3::from_row_major(p).unwrap(),
        )
    }

    #[test]
    fn a_refused_heading_changes_nothing() {
        let noise = HeadingNoise::white(0.01);
        let refused = update(&belief(0.5), 1.0, &noise, CHI2_1_99);
        assert!(!refused.accepted && (refused.d2 - 12.5).abs() < 1e-12);
        assert_eq!(refused.belief, belief(0.5));
        assert!(!update(&belief(0.5), f64::NAN, &noise, f64::INFINITY).accepted);
    }

    /// Half of the way where both know as much, over the cut of the circle; the position follows as it is correlated.
    #[test]
    fn a_heading_is_met_in_the_middle_on_the_shorter_side() {
        let noise = HeadingNoise::white(0.01);
        let told = update(&belief(3.1), -3.083_185_307_179_586, &noise, CHI2_1_99).belief;
        assert!((told.pose.phi - 3.15 + core::f64::consts::TAU).abs() < 1e-12);
        assert!((told.pose.x - 1.01).abs() < 1e-12 && (told.pose.y - 1.985).abs() < 1e-12);
        let [xx, yy, pp] = told.total().variances();
        assert!((pp - 0.005).abs() < 1e-15);
        assert!((xx - 0.0398).abs() < 1e-15 && (yy - 0.08955).abs() < 1e-15);
    }

    #[test]
    fn certainty_learns_nothing_and_a_weight_of_nothing_teaches_nothing() {
        let certain = Belief::independent(Pose::new(1.0, 2.0, 0.5), Covariance3::ZERO);
        let white = HeadingNoise::white(0.01);
        assert_eq!(update(&certain, 0.6, &white, CHI2_1_99).belief, certain);
        let worthless = HeadingNoise {
            error: 0.01,
            weight: f64::INFINITY,
        };
        let told = update(&belief(0.5), 0.6, &worthless, CHI2_1_99);
        assert!(told.accepted && told.belief == belief(0.5));
    }

    const WORDS: usize = 40;

    /// Times of words, `step` s apart on average, regular or not.
    fn times(step: f64, irregular: bool) -> [f64; WORDS] {
        let mut time = 0.0;
        core::array::from_fn(|k| {
            #[allow(clippy::cast_precision_loss)] // There are few.
            let k = k as f64;
            let scale = if irregular {
                libm::pow(10.0, 1.5 * libm::sin(2.3 * k * k))
            } else {
                1.0
            };
            time += step * scale;
            time
        })
    }

    /// What the words are weighed by bounds their error, whatever they are weighed for: `D − K` has no negative eigenvalue.
    #[test]
    fn no_linear_filter_errs_by_more_than_the_white_noise_that_stands_for_the_slow_error() {
        let slow = SlowError {
            variance: 1.0,
            memory: Span::from_seconds(60.0),
        };
        for (step, irregular) in [
            (0.1, false),
            (5.0, false),
            (30.0, false),
            (1.0, true),
            (20.0, true),
        ] {
            let times = times(step, irregular);
            let bound = |row: usize| {
                let before = row.checked_sub(1).map(|it| times[it]);
                let since = before.map(|it| Span::from_seconds(times[row] - it));
                HeadingNoise::of(0.0, &slow, since).weight
            };
            let excess = SMatrix::<f64, WORDS, WORDS>::from_fn(|row, column| {
                let shared = libm::exp(-(times[row] - times[column]).abs() / 60.0);
                if row == column {
                    bound(row) - 1.0
                } else {
                    -shared
                }
            });
            let least = excess.symmetric_eigenvalues().min();
            assert!(least > -1e-9, "{step} {irregular}: {least}");
        }
    }

    /// A robot that nothing else tells its heading is as certain after a memory of the compass as there is new in that: no more.
    #[test]
    fn a_compass_that_drifts_is_not_averaged_away() {
        let slow = SlowError {
            variance: 0.01,
            memory: Span::from_seconds(60.0),
        };
        let mut known = Belief::independent(
            Pose::default(),
            Covariance3::diagonal([1.0, 1.0, 3.0]).unwrap(),
        );
        let mut since = None;
        for _ in 0..600 {
            let noise = HeadingNoise::of(1e-4, &slow, since);
            known = update(&known, 0.0, &noise, CHI2_1_99).belief;
            since = Some(Span::from_millis(100));
        }
        let [_, _, heading] = known.total().variances();
        assert!((0.01..0.02).contains(&heading), "{heading}");
    }
}
