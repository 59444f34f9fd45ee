//! Wheels of which each says a part of the motion, and all of them more than there is to say.

use super::kinematics::{NO_SPREAD, Spread, Twist, add_outer};
use super::merge::MAX_CHANNELS;

/// The velocity of the body that fits the wheels' speeds best, and in how far they do not fit one another.
///
/// A wheel that rolls without slip goes at `s = a · [v_x, v_y, ω]`:
///
/// | wheel | a | source |
/// | --- | --- | --- |
/// | pointing forward, y to the left | `[1, 0, −y / scale]` | Siegwart et al., Introduction to Autonomous Mobile Robots, 2nd ed., 3.2.2; scale as of an axle |
/// | mecanum, front left and rear right | `[1, −1, ∓(l + w)]` | Taheri, Qiao and Ghaeminezhad, Kinematic Model of a Four Mecanum Wheeled Mobile Robot, 2015, (20) |
/// | mecanum, front right and rear left | `[1, 1, ±(l + w)]` | the same |
/// | omni, at the angle α, d from the middle | `[−sin α, cos α, d]` | Siegwart et al., 3.2.3, a Swedish wheel with γ = 0 |
///
/// With a row of A for each wheel, least squares has `[v_x, v_y, ω] = B s`, `B = (Aᵀ A)⁻¹ Aᵀ`; independent noise of the wheels'
/// speeds with variances R has `B R Bᵀ` of covariance. What no motion explains is the part of s along the unit vectors n with
/// `nᵀ A = 0`: one for four wheels that move in three directions, two for four that move in two.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct LeastSquares {
    /// B.
    inverse: [[f64; MAX_CHANNELS]; 3],
    /// n, as many as there are.
    redundant: [Option<[f64; MAX_CHANNELS]>; 2],
    /// What each metre adds to the variance of a wheel's way \[m²/m\].
    wheel_per_m: f64,
}

/// Wheels that leave a direction to chance have a determinant below this, lengths being stated in mean distances.
const LEAST_DETERMINANT: f64 = 1e-3;

const HALF_ROOT: f64 = std::f64::consts::FRAC_1_SQRT_2;

impl LeastSquares {
    /// Front left, front right, rear left, rear right, all pointing forward.
    pub(super) fn four(track_m: f64, turning_scale: f64, wheel_per_m: f64) -> Self {
        let (mean, turn) = (0.25, turning_scale / (2.0 * track_m));
        Self {
            inverse: [[mean; 4], [0.0; 4], [-turn, turn, -turn, turn]],
            redundant: [
                Some([HALF_ROOT, 0.0, -HALF_ROOT, 0.0]),
                Some([0.0, HALF_ROOT, 0.0, -HALF_ROOT]),
            ],
            wheel_per_m,
        }
    }

    /// Front left, front right, rear left, rear right.
    pub(super) fn mecanum(half_length_m: f64, half_width_m: f64, wheel_per_m: f64) -> Option<Self> {
        let lever_m = half_length_m + half_width_m;
        let rows = [
            [1.0, -1.0, -lever_m],
            [1.0, 1.0, lever_m],
            [1.0, 1.0, -lever_m],
            [1.0, -1.0, lever_m],
        ];
        Self::of(&rows, lever_m, wheel_per_m)
    }

    /// Wheels at these angles and distances \[rad, m\]; `None` if they leave a direction open.
    pub(super) fn omni(wheels: &[[f64; 2]], wheel_per_m: f64) -> Option<Self> {
        let row = |[angle, distance_m]: [f64; 2]| [-angle.sin(), angle.cos(), distance_m];
        let mut rows = [[0.0; 3]; MAX_CHANNELS];
        for (to, wheel) in rows.iter_mut().zip(wheels) {
            *to = row(*wheel);
        }
        let count = wheels.len().min(MAX_CHANNELS);
        let distances = wheels.iter().map(|[_, distance_m]| distance_m);
        #[expect(clippy::cast_precision_loss, reason = "four at most")]
        let mean_m = distances.sum::<f64>() / count.max(1) as f64;
        Self::of(rows.get(..count)?, mean_m, wheel_per_m)
    }

    fn of(rows: &[[f64; 3]], lever_m: f64, wheel_per_m: f64) -> Option<Self> {
        let scaled: Vec<_> = rows.iter().map(|&[x, y, w]| [x, y, w / lever_m]).collect();
        let normal = |i: usize, j: usize| scaled.iter().map(|a| a[i] * a[j]).sum::<f64>();
        let matrix = [0, 1, 2].map(|i| [0, 1, 2].map(|j| normal(i, j)));
        let determinant = determinant(&matrix);
        // Not-a-number is none either.
        if determinant.is_nan() || determinant <= LEAST_DETERMINANT {
            return None;
        }
        let cofactors = cofactors(&matrix);
        let mut inverse = [[0.0; MAX_CHANNELS]; 3];
        for (to, cofactors) in inverse.iter_mut().zip(cofactors) {
            for (entry, row) in to.iter_mut().zip(&scaled) {
                *entry = dot(cofactors, *row) / determinant;
            }
        }
        let [_, _, turn] = &mut inverse;
        for entry in turn {
            *entry /= lever_m;
        }
        Some(Self {
            inverse,
            redundant: [unexplained(&scaled), None],
            wheel_per_m,
        })
    }

    /// With the wheels' mean speeds over `dt_s` seconds.
    pub(super) fn twist(&self, speeds: [f64; MAX_CHANNELS], dt_s: f64) -> Twist {
        let mut spread = NO_SPREAD;
        if self.wheel_per_m > 0.0 {
            for (wheel, speed) in speeds.into_iter().enumerate() {
                // A way's variance is that of its mean speed times dt².
                let variance = self.wheel_per_m * speed.abs() / dt_s;
                add_outer(&mut spread, self.of_wheel(wheel), variance);
            }
        }
        Twist {
            velocity: self.velocity(speeds),
            spread,
        }
    }

    /// B s.
    pub(super) fn velocity(&self, speeds: [f64; MAX_CHANNELS]) -> [f64; 3] {
        self.inverse.map(|row| sum_of_products(row, speeds))
    }

    /// What 1 m/s of a wheel makes of the body's velocity.
    #[allow(clippy::indexing_slicing)] // A wheel is one of the channels.
    pub(super) fn of_wheel(&self, wheel: usize) -> [f64; 3] {
        self.inverse.map(|row| row[wheel])
    }

    /// The directions in which wheels can contradict one another.
    pub(super) fn redundant(&self) -> impl Iterator<Item = [f64; MAX_CHANNELS]> {
        self.redundant.into_iter().flatten()
    }

    /// Where wheel `wheel` alone was off, by as much as the part `along` of n: what it did to the body's way. For each wheel that
    /// could have been.
    pub(super) fn suspects(
        &self,
        n: [f64; MAX_CHANNELS],
        along: f64,
    ) -> impl Iterator<Item = (usize, [f64; 3])> {
        n.into_iter()
            .enumerate()
            .filter(|(_, n)| n.abs() > NO_PART)
            .map(move |(wheel, n)| (wheel, self.of_wheel(wheel).map(|it| it * along / n)))
    }

    /// Covariance of the body's way for a part 1 of n that one wheel made, each as likely as another.
    pub(super) fn of_slip(&self, n: [f64; MAX_CHANNELS]) -> Spread {
        let mut spread = NO_SPREAD;
        let count = n.iter().filter(|n| n.abs() > NO_PART).count();
        #[expect(clippy::cast_precision_loss, reason = "four at most")]
        let each = 1.0 / count.max(1) as f64;
        for (_, error) in self.suspects(n, 1.0) {
            add_outer(&mut spread, error, each);
        }
        spread
    }
}

/// A wheel with less than this of n has no part in it.
const NO_PART: f64 = 1e-3;

pub(super) fn sum_of_products(a: [f64; MAX_CHANNELS], b: [f64; MAX_CHANNELS]) -> f64 {
    let [a0, a1, a2, a3] = a;
    let [b0, b1, b2, b3] = b;
    (a0 * b0 + a1 * b1) + (a2 * b2 + a3 * b3)
}

fn dot([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> f64 {
    a * x + b * y + c * z
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn determinant([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    dot(*a, cross(*b, *c))
}

/// Of a symmetric matrix; divided by the determinant, its inverse.
fn cofactors([a, b, c]: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    [cross(*b, *c), cross(*c, *a), cross(*a, *b)]
}

/// n of four wheels: each entry is the determinant of the other wheels, with alternating sign.
fn unexplained(rows: &[[f64; 3]]) -> Option<[f64; MAX_CHANNELS]> {
    let &[a, b, c, d] = rows else { return None };
    let n = [
        determinant(&[b, c, d]),
        -determinant(&[a, c, d]),
        determinant(&[a, b, d]),
        -determinant(&[a, b, c]),
    ];
    let length = sum_of_products(n, n).sqrt();
    Some(n.map(|it| it / length))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn layouts() -> Vec<(Vec<[f64; 3]>, LeastSquares)> {
        let angles = |angles: &[f64]| -> Vec<[f64; 2]> {
            let wheel = |(place, angle): (usize, &f64)| {
                [angle.to_radians(), [0.2, 0.21, 0.22, 0.23][place]]
            };
            angles.iter().enumerate().map(wheel).collect()
        };
        let omni = |wheels: Vec<[f64; 2]>| {
            let row = |&[angle, d]: &[f64; 2]| [-angle.sin(), angle.cos(), d];
            let rows = wheels.iter().map(row).collect();
            (rows, LeastSquares::omni(&wheels, 0.0).unwrap())
        };
        let forward = |y: f64| [1.0, 0.0, -y];
        let k = 0.25 + 0.2;
        vec![
            (
                [0.3, -0.3, 0.3, -0.3].map(forward).into(),
                LeastSquares::four(0.6, 1.0, 0.0),
            ),
            (
                vec![
                    [1.0, -1.0, -k],
                    [1.0, 1.0, k],
                    [1.0, 1.0, -k],
                    [1.0, -1.0, k],
                ],
                LeastSquares::mecanum(0.25, 0.2, 0.0).unwrap(),
            ),
            omni(angles(&[60.0, 180.0, 300.0])),
            omni(angles(&[40.0, 130.0, 230.0, 320.0])),
        ]
    }

    proptest! {
        /// Whatever the wheels say, the speeds of the motion found and what is left over have nothing in common.
        #[test]
        fn what_is_left_over_no_motion_explains(s in proptest::array::uniform4(-3.0..3.0)) {
            for (rows, it) in layouts() {
                let mut s = s;
                s[rows.len()..].fill(0.0);
                let velocity = it.velocity(s);
                let left: Vec<_> = rows.iter().zip(s).map(|(row, s)| s - dot(*row, velocity)).collect();
                for column in 0..3 {
                    let along: f64 = rows.iter().zip(&left).map(|(row, left)| row[column] * left).sum();
                    prop_assert!(along.abs() < 1e-12, "{along}");
                }
                let length = left.iter().map(|it| it * it).sum::<f64>();
                let parts = it.redundant().map(|n| sum_of_products(n, s));
                let found = parts.map(|it| it * it).sum::<f64>();
                prop_assert!((length - found).abs() < 1e-12, "{length} {found}");
            }
        }

        /// A motion is found from the wheels that make it, and one wheel's slip explained by that wheel.
        #[test]
        fn a_motion_is_found_and_a_slip_explained(
            v in proptest::array::uniform3(-3.0..3.0), wheel in 0_usize..4, slip in 0.1..1.0,
        ) {
            for (rows, it) in layouts() {
                let v = if it.of_wheel(0)[1] == 0.0 { [v[0], 0.0, v[2]] } else { v };
                let mut s = [0.0; MAX_CHANNELS];
                s.iter_mut().zip(&rows).for_each(|(s, row)| *s = dot(*row, v));
                let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
                prop_assert!(near(it.velocity(s), v));
                let Some(speed) = s.get_mut(wheel).filter(|_| wheel < rows.len()) else { continue };
                *speed += slip;
                for n in it.redundant().filter(|n| n[wheel] != 0.0) {
                    let along = sum_of_products(n, s);
                    let (_, error) = it.suspects(n, along).find(|(which, _)| *which == wheel).unwrap();
                    let found = it.velocity(s);
                    let corrected = [0, 1, 2].map(|place| found[place] - error[place]);
                    prop_assert!(near(corrected, v), "{corrected:?} {v:?}");
                }
            }
        }
    }

    #[test]
    fn wheels_that_leave_a_direction_open_are_none() {
        let parallel = [[0.0, 0.2], [std::f64::consts::PI, 0.2], [0.0, 0.3]];
        assert_eq!(LeastSquares::omni(&parallel, 0.0), None);
        assert_eq!(LeastSquares::omni(&parallel[..2], 0.0), None);
    }

    #[test]
    fn noise_of_the_wheels_is_that_of_least_squares() {
        let it = LeastSquares::mecanum(0.3, 0.2, 0.01).unwrap();
        let spread = it.twist([1.0, -1.0, 1.0, -1.0], 0.1).spread;
        // R is 0.1 everywhere: 0.1 (Aᵀ A)⁻¹ = 0.1 / 4 [1, 1, 1 / (l + w)²].
        let expected = [0.025, 0.025, 0.1];
        for (row, expected) in expected.into_iter().enumerate() {
            for (column, entry) in spread[row].iter().enumerate() {
                let expected = if row == column { expected } else { 0.0 };
                assert!((entry - expected).abs() < 1e-12, "{spread:?}");
            }
        }
    }
}
