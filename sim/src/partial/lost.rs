//! The same teams, where those without a receiver do not know which way they look.
//!
//! Beyond 1 rad one Gaussian does not learn: a sighting is not linear in the heading. In the direction, `(c, s)` as two free numbers, it
//! is: what stands at z in the body's frame is at `p + [[z₀, −z₁], [z₁, z₀]] (c, s)ᵀ`, whatever the heading. So who is lost carries the linear
//! state of [`coloc_track`], itself being the neighbour and the world the observer, and learns by covariance intersection, all of what
//! it hears dependent. Once its heading is known to 0.35 rad it goes on as everybody else. An answer of a robot 3 m away and known to
//! a decimetre tells the heading at once.

use coloc_estimator::partial::{BodySighting, SplitPosition};
use coloc_estimator::{Belief, Covariance2, Covariance3, Parts, Pose};
use coloc_track::{Core, Increment, State};
use nalgebra::{Matrix2, Matrix2x4, Matrix3, Matrix4, Vector2, Vector4};

/// A heading known to this is one \[rad\].
const READY: f64 = 0.35;
/// χ² with two degrees of freedom, 99.9 %.
const GATE: f64 = coloc_track::CHI2_2_999;
/// Weights tried.
const WEIGHTS: u16 = 20;

/// Of who does not know which way it looks.
#[derive(Copy, Clone, Debug)]
pub(super) struct Lost(State);

/// The map from a direction to where `z` is: `[[z₀, −z₁], [z₁, z₀]]`.
fn lever([x, y]: [f64; 2]) -> Matrix2<f64> {
    Matrix2::new(x, -y, y, x)
}

/// `[I, L]`
fn rows(z: [f64; 2]) -> Matrix2x4<f64> {
    let mut rows = Matrix2x4::zeros();
    rows.fixed_view_mut::<2, 2>(0, 0).fill_with_identity();
    rows.fixed_view_mut::<2, 2>(0, 2).copy_from(&lever(z));
    rows
}

/// The noise of a sighting by a robot that may look anywhere.
fn turned_anyhow(sighting: &BodySighting) -> Matrix2<f64> {
    let all = sighting.white.matrix() + sighting.slow.matrix();
    Matrix2::identity() * all.symmetric_eigenvalues().max()
}

impl Lost {
    /// Near `pose`, looking anywhere.
    pub(super) fn near(pose: &Pose, variance: f64) -> Self {
        let mut state = State::default();
        state.mean[0] = pose.x;
        state.mean[1] = pose.y;
        for (place, variance) in [variance, variance, 0.5, 0.5].into_iter().enumerate() {
            state.covariance[(place, place)] = variance;
        }
        Self(state)
    }

    pub(super) fn pass(&mut self, own: &Increment) {
        let still = Increment::default();
        self.0.predict(&still, own, std::iter::empty(), 0.0);
    }

    fn moments(&self) -> (Vector4<f64>, Matrix4<f64>) {
        let mean = self.0.mean.fixed_rows::<4>(0).into_owned();
        (
            mean,
            self.0.covariance.fixed_view::<4, 4>(0, 0).into_owned(),
        )
    }

    fn place(&self, z: [f64; 2], noise: &Matrix2<f64>) -> SplitPosition {
        let (mean, covariance) = self.moments();
        let (rows, at) = (rows(z), rows(z) * mean);
        let all = rows * covariance * rows.transpose() + noise;
        SplitPosition {
            position: [at.x, at.y],
            independent: Covariance2::ZERO,
            dependent: Covariance2::new(all).unwrap_or_default(),
        }
    }

    /// Where what it sees must be.
    pub(super) fn tell(&self, sighting: &BodySighting) -> SplitPosition {
        self.place(sighting.at, &turned_anyhow(sighting))
    }

    /// Where it is.
    pub(super) fn answer(&self) -> SplitPosition {
        self.place([0.0; 2], &Matrix2::zeros())
    }

    /// What it is told of its place.
    pub(super) fn told(&mut self, said: &SplitPosition) {
        self.learn([0.0; 2], said, &Matrix2::zeros());
    }

    /// What it is answered by who it saw.
    pub(super) fn answered(&mut self, sighting: &BodySighting, answer: &SplitPosition) {
        self.learn(sighting.at, answer, &turned_anyhow(sighting));
    }

    fn learn(&mut self, z: [f64; 2], said: &SplitPosition, noise: &Matrix2<f64>) {
        let (mean, covariance) = self.moments();
        let rows = rows(z);
        let innovation = Vector2::from(said.position) - rows * mean;
        let noise = said.independent.matrix() + said.dependent.matrix() + noise;
        let fused = (1..WEIGHTS).filter_map(|weight| {
            let alpha = f64::from(weight) / f64::from(WEIGHTS);
            let (own, other) = (covariance / alpha, noise / (1.0 - alpha));
            let spread = rows * own * rows.transpose() + other;
            let gain = own * rows.transpose() * spread.try_inverse()?;
            let after = own - gain * spread * gain.transpose();
            let d2 = innovation.dot(&(spread.try_inverse()? * innovation));
            Some((after.trace(), d2, mean + gain * innovation, after))
        });
        let best = fused.min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, d2, mean, covariance)) = best
            && d2 <= GATE
        {
            self.0.mean.fixed_rows_mut::<4>(0).copy_from(&mean);
            let covariance = 0.5 * (covariance + covariance.transpose());
            self.0
                .covariance
                .fixed_view_mut::<4, 4>(0, 0)
                .copy_from(&covariance);
        }
    }

    /// The belief of who has found its heading.
    pub(super) fn found(&self) -> Option<Belief> {
        if !self.0.heading_of().is_ready(READY) {
            return None;
        }
        let mut state = self.0;
        state.convert();
        debug_assert_eq!(state.core, Core::Heading);
        let ([x, y, phi], covariance): (_, Matrix3<f64>) = state.relative_pose();
        let covariance = Covariance3::new(covariance).ok()?;
        Some(Belief::gaussian(
            Pose::new(x, y, phi),
            Parts::dependent(covariance),
        ))
    }
}
