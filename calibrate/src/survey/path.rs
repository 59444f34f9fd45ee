//! The nodes of a path, and what the wheels say of the way from each to the next.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::Leg;

/// Where nothing came of the wheels: variance of the way and of the turn, of each second \[m²/s, m²/s, rad²/s\].
const MISSING: [f64; 3] = [0.1, 0.1, 0.007];

/// No way is better known than this \[m², m², rad²\]: a robot that cannot slip sideways does, by a tenth of a millimetre.
const LEAST: [f64; 3] = [1e-8, 1e-8, 1e-10];

/// Stamps as near as this are of one node \[s\].
const TOGETHER_S: f64 = 1e-3;

/// Times of the nodes: where anything was measured.
pub(super) fn times(mut stamps: Vec<f64>) -> Vec<f64> {
    stamps.sort_by(f64::total_cmp);
    stamps.dedup_by(|later, earlier| *later - *earlier < TOGETHER_S);
    stamps
}

/// The node of a stamp: the latest one that is not after it.
pub(super) fn node_of(times: &[f64], stamp_s: f64) -> usize {
    times.partition_point(|it| *it <= stamp_s).saturating_sub(1)
}

/// The way from a node to the next one, in the frame of the first.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Increment {
    pub(super) way: Vector2<f64>,
    pub(super) turn: f64,
    pub(super) covariance: Matrix3<f64>,
}

impl Increment {
    fn none() -> Self {
        Self {
            way: Vector2::zeros(),
            turn: 0.0,
            covariance: Matrix3::from_diagonal(&LEAST.into()),
        }
    }

    /// The same and then `dt_s` of `velocity`, whose noise has these variances after a second.
    fn and(&self, velocity: [f64; 3], per_s: &Matrix3<f64>, dt_s: f64) -> Self {
        let [ahead, left, turn] = velocity.map(|it| it * dt_s);
        let half = 0.5 * turn;
        let shorter = if half.abs() < 1e-6 {
            1.0
        } else {
            half.sin() / half
        };
        let chord = rotation(self.turn + half) * Vector2::new(ahead, left) * shorter;
        let mut along = Matrix3::identity();
        (along[(0, 2)], along[(1, 2)]) = (-chord.y, chord.x);
        let mut turned = Matrix3::identity();
        turned
            .fixed_view_mut::<2, 2>(0, 0)
            .copy_from(&rotation(self.turn + half));
        Self {
            way: self.way + chord,
            turn: self.turn + turn,
            covariance: along * self.covariance * along.transpose()
                + turned * (per_s * dt_s) * turned.transpose(),
        }
    }
}

/// To the left by `angle`.
pub(super) fn rotation(angle: f64) -> Matrix2<f64> {
    let (sin, cos) = angle.sin_cos();
    Matrix2::new(cos, -sin, sin, cos)
}

/// From every node to the next one, one less than there are nodes; `legs` by their begin.
pub(super) fn increments(times: &[f64], legs: &[Leg]) -> Vec<Increment> {
    let missing = Matrix3::from_diagonal(&MISSING.into());
    let mut first = 0;
    let between = times.windows(2).map(|pair| {
        let [begin_s, end_s] = [pair[0], pair[1]];
        first += legs[first..]
            .iter()
            .take_while(|it| it.end_s <= begin_s)
            .count();
        let (mut whole, mut now_s) = (Increment::none(), begin_s);
        for leg in legs[first..].iter().take_while(|it| it.start_s < end_s) {
            let (start_s, stop_s) = (leg.start_s.max(now_s), leg.end_s.min(end_s));
            if stop_s > start_s {
                whole = whole.and([0.0; 3], &missing, start_s - now_s);
                whole = whole.and(leg.velocity, &leg.noise_per_s, stop_s - start_s);
                now_s = stop_s;
            }
        }
        whole.and([0.0; 3], &missing, end_s - now_s)
    });
    between.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leg(start_s: f64, end_s: f64) -> Leg {
        Leg {
            start_s,
            end_s,
            velocity: [1.0, 0.0, std::f64::consts::FRAC_PI_2],
            noise_per_s: Matrix3::from_diagonal(&[0.01, 0.0, 0.02].into()),
        }
    }

    #[test]
    fn legs_add_up_to_an_arc_and_a_gap_to_doubt() {
        let legs: Vec<Leg> = (0..10)
            .map(|it| leg(0.1 * f64::from(it), 0.1 * f64::from(it + 1)))
            .collect();
        let [whole, gap] = increments(&[0.0, 1.0, 2.0], &legs)[..] else {
            panic!("two");
        };
        let radius = std::f64::consts::FRAC_2_PI;
        assert!(
            (whole.way - Vector2::new(radius, radius)).norm() < 1e-9,
            "{whole:?}"
        );
        assert!((whole.turn - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        assert!((whole.covariance[(2, 2)] - 0.02).abs() < 1e-6);
        assert!((gap.covariance[(0, 0)] - 0.1).abs() < 1e-6 && gap.way.norm() < 1e-12);
    }

    #[test]
    fn a_stamp_belongs_to_the_node_before_it() {
        let times = times(vec![3.0, 1.0, 1.0005, 2.0]);
        assert_eq!(times.len(), 3);
        assert_eq!([1.0005, 2.0, 2.5].map(|it| node_of(&times, it)), [0, 1, 1]);
    }
}
