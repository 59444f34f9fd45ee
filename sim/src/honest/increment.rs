//! What a robot really does in a step: the arc that its wheels report, and noise of the covariance that the filter is told.
//!
//! Written anew, not with the estimator's functions: this is what they are held against. A translation `d` held in the body
//! frame while it turns by Δ leads to `t(d, Δ) = [S d_x − C d_y, C d_x + S d_y]`, `S = sin Δ/Δ`, `C = (1 − cos Δ)/Δ`. To it is
//! added `∂t/∂(d, Δ)` times the noise of `(d, Δ)`, which are three independent normal numbers.

use crate::random::Draws;

/// Half a turn below which sin h/h and its slope are series \[rad\].
const SERIES: f64 = 1e-3;

/// In the body frame at the start of the step.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Increment {
    /// \[m\]
    way: [f64; 2],
    /// \[rad\]
    turn: f64,
    /// What one standard deviation of the way ahead, to the side, and of the turn adds to `way` \[m\].
    ahead: [f64; 2],
    aside: [f64; 2],
    by_turn: [f64; 2],
    /// Standard deviation of the turn \[rad\].
    turning: f64,
    slips: bool,
}

/// Where a robot really is.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Place {
    /// \[m\]
    pub(crate) position: [f64; 2],
    /// Not wrapped \[rad\].
    pub(crate) heading: f64,
}

impl Increment {
    /// Of `held = [d_x, d_y, Δ]`, whose noise has these variances.
    pub(crate) fn new([x, y, turn]: [f64; 3], variances: [f64; 3]) -> Self {
        let [ahead, aside, turning] = variances.map(f64::sqrt);
        let (s, c, slope_s, slope_c) = means(turn);
        Self {
            way: [s * x - c * y, c * x + s * y],
            turn,
            ahead: [s * ahead, c * ahead],
            aside: [-c * aside, s * aside],
            by_turn: [slope_s * x - slope_c * y, slope_c * x + slope_s * y].map(|it| turning * it),
            turning,
            slips: aside > 0.0,
        }
    }

    /// After one step; whoever cannot slip draws two numbers.
    #[inline]
    pub(crate) fn drive(&self, place: &mut Place, draws: &mut Draws) {
        let [a, b] = draws.normals();
        let slip = if self.slips { draws.normal() } else { 0.0 };
        let along =
            |i: usize| self.way[i] + a * self.ahead[i] + b * self.by_turn[i] + slip * self.aside[i];
        let [x, y] = [along(0), along(1)];
        let (sin, cos) = libm::sincos(place.heading);
        place.position[0] += cos * x - sin * y;
        place.position[1] += sin * x + cos * y;
        place.heading += self.turn + b * self.turning;
    }
}

/// S, C and their slopes: with `h = Δ/2`, `g = sin h/h` they are `g cos h` and `g sin h`.
fn means(turn: f64) -> (f64, f64, f64, f64) {
    let h = 0.5 * turn;
    let (sin, cos) = libm::sincos(h);
    let (g, slope) = if h.abs() < SERIES {
        (1.0 - h * h / 6.0, -h / 3.0 * (1.0 - 0.1 * h * h))
    } else {
        (sin / h, (h * cos - sin) / (h * h))
    };
    let (s, c) = (g * cos, g * sin);
    (s, c, 0.5 * (slope * cos - c), 0.5 * (slope * sin + s))
}

#[cfg(test)]
mod tests {
    use coloc_estimator::{Covariance3, Increments};

    use super::*;
    use crate::random::{Noise, Purpose};

    /// The moments of 200 000 steps are those that the estimator claims.
    #[test]
    fn a_step_has_the_mean_and_the_covariance_that_the_estimator_is_told() {
        let (held, variances) = ([0.8, 0.1, 0.7], [0.04, 0.01, 0.02]);
        let told = Increments::arc(held, &Covariance3::diagonal(variances).expect("positive"));
        let increment = Increment::new(held, variances);
        let mut draws = Noise::new(5, 0).draws(Purpose::TrueWay, 0, 0, 0);
        let n = 200_000;
        let (mut mean, mut products) = ([0.0; 3], [0.0; 9]);
        for _ in 0..n {
            let mut place = Place::default();
            increment.drive(&mut place, &mut draws);
            let [x, y] = place.position;
            let [mx, my] = told.translation;
            let error = [x - mx, y - my, place.heading - told.turn];
            for i in 0..9 {
                mean[i % 3] += error[i % 3] / 3.0 / f64::from(n);
                products[i] += error[i / 3] * error[i % 3] / f64::from(n);
            }
        }
        assert!(mean.iter().all(|it| it.abs() < 2e-3), "{mean:?}");
        for (found, expected) in products.into_iter().zip(told.noise.to_row_major()) {
            assert!((found - expected).abs() < 5e-4, "{found} is not {expected}");
        }
    }

    #[test]
    fn the_series_meets_the_sines() {
        let (below, above) = (means(2.0 * SERIES * (1.0 - 1e-12)), means(2.0 * SERIES));
        for (a, b) in [(below.0, above.0), (below.1, above.1)] {
            assert!((a - b).abs() < 1e-12);
        }
        for (a, b) in [(below.2, above.2), (below.3, above.3)] {
            assert!((a - b).abs() < 1e-9, "{a} is not {b}");
        }
    }
}
