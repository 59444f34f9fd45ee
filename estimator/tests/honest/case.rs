//! What all cases have in common: the state, what moves it, and how close is close enough.

use coloc_estimator::angle::wrap;
use coloc_estimator::honest::advance;
use coloc_estimator::{Belief, Covariance3, Increments, Motion, Pose, Propagation, propagate};
use serde::Deserialize;

#[path = "../state/mod.rs"]
mod state;

use state::in_common_axes;
pub(crate) use state::{Rows, Rows2, State, covariance, covariance2, parts, pose};

#[derive(Deserialize)]
#[serde(untagged)]
pub(crate) enum Noise {
    Two(Rows2),
    Three(Rows),
}

#[derive(Deserialize)]
pub(crate) struct Velocity {
    pub(crate) v: Vec<f64>,
    pub(crate) dt: f64,
    pub(crate) Q: Noise,
}

#[derive(Deserialize)]
pub(crate) struct Wheels {
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) base: f64,
    pub(crate) W: Rows2,
    pub(crate) slip: f64,
}

impl Velocity {
    pub(crate) fn motion(&self) -> Motion {
        match (self.v.as_slice(), &self.Q) {
            (&[v, omega], Noise::Two(q)) => Motion::Nonholonomic {
                velocity: [v, omega],
                noise: covariance2(q),
            },
            (&[x, y, omega], Noise::Three(q)) => Motion::Holonomic {
                velocity: [x, y, omega],
                noise: covariance(q),
            },
            _ => panic!("{} velocities with other noise", self.v.len()),
        }
    }

    pub(crate) fn increments(&self) -> Increments {
        let motion = self.motion();
        let noise = motion.covariance().scaled(self.dt * self.dt);
        Increments::arc(motion.velocity().map(|it| it * self.dt), &noise)
    }

    pub(crate) fn drive(&self, belief: &Belief) -> Belief {
        propagate(belief, &self.motion(), self.dt, Propagation::Honest)
    }
}

impl Wheels {
    pub(crate) fn increments(&self) -> Increments {
        let ways = [self.left, self.right];
        Increments::wheels(ways, self.base, &covariance2(&self.W), self.slip)
    }

    pub(crate) fn drive(&self, belief: &Belief) -> Belief {
        advance(belief, &self.increments()).belief
    }

    /// The velocity that drives so in `dt` seconds: the history is given nothing else.
    pub(crate) fn motion(&self, dt: f64) -> Motion {
        let [[ll, lr], [_, rr]] = self.W;
        let (xx, xp) = (0.25 * (ll + 2.0 * lr + rr), 0.5 * (rr - ll) / self.base);
        let pp = (ll - 2.0 * lr + rr) / (self.base * self.base);
        let held = [[xx, 0.0, xp], [0.0, self.slip, 0.0], [xp, 0.0, pp]];
        let (way, turn) = (self.left + self.right, self.right - self.left);
        Motion::Holonomic {
            velocity: [0.5 * way / dt, 0.0, turn / self.base / dt],
            noise: covariance(&held).scaled(1.0 / (dt * dt)),
        }
    }
}

/// How far from what is expected a result may be.
pub(crate) struct Tolerance {
    /// Of the pose, given its value and σ.
    pub(crate) pose: fn(value: f64, sigma: f64) -> f64,
    /// Of a covariance, of the σ concerned; and beside it.
    pub(crate) covariance: [f64; 2],
    /// Of the bend's norm; and beside it.
    pub(crate) bend: [f64; 2],
    /// A part's entries are judged by its own σ; else by those of the whole.
    pub(crate) by_own: bool,
}

impl Tolerance {
    pub(crate) fn check(&self, name: &str, found: &Belief, expected: &State) {
        let total = sum(&expected.P_i, &expected.P_d);
        self.check_pose(name, &found.pose, expected.x, sigma(&total));
        for (part, found, rows) in [
            ("P_i", &found.parts.independent, &expected.P_i),
            ("P_d", &found.parts.dependent, &expected.P_d),
        ] {
            let scale = sigma(if self.by_own { rows } else { &total });
            self.check_covariance(&format!("{name}: {part}"), found, rows, scale);
        }
        let norm = expected.K_H.iter().flatten().map(|it| it * it).sum::<f64>();
        let allowed = self.bend[0] * norm.sqrt() + self.bend[1];
        let pairs = in_common_axes(found).into_iter().zip(expected.K_H);
        for (a, b) in pairs.flat_map(|(a, b)| a.into_iter().zip(b)) {
            let error = (a - b).abs();
            assert!(
                error <= allowed,
                "{name}: K_H {a:e} is not {b:e}: {error:e} > {allowed:e}"
            );
        }
    }

    pub(crate) fn check_pose(&self, name: &str, found: &Pose, expected: [f64; 3], sigma: [f64; 3]) {
        let found = [found.x, found.y, found.phi];
        for i in 0..3 {
            let error = found[i] - expected[i];
            let error = if i == 2 { wrap(error) } else { error };
            let allowed = (self.pose)(expected[i], sigma[i]);
            assert!(
                error.abs() <= allowed,
                "{name}: x[{i}] off by {error:e}, {allowed:e} allowed"
            );
        }
    }

    pub(crate) fn check_covariance(
        &self,
        name: &str,
        found: &Covariance3,
        expected: &Rows,
        sigma: [f64; 3],
    ) {
        let [relative, beside] = self.covariance;
        let found = found.matrix();
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let error = (found[(i, j)] - expected[i][j]).abs();
            let allowed = relative * sigma[i] * sigma[j] + beside;
            assert!(
                error <= allowed,
                "{name}[{i}][{j}] off by {error:e}, {allowed:e} allowed"
            );
        }
    }
}

/// Of each coordinate.
pub(crate) fn sigma(rows: &Rows) -> [f64; 3] {
    std::array::from_fn(|i| rows[i][i].max(0.0).sqrt())
}

pub(crate) fn sum(a: &Rows, b: &Rows) -> Rows {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}
