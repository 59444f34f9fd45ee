//! Robots that do what they are told, but for noise: where they get to, and where filters believe that they are.

use coloc_estimator::{Belief, Covariance3, Motion, Pose};
use coloc_sim::random::{Draws, Noise, Purpose};

/// As the estimator's default.
pub(super) const DT_S: f64 = 0.02;

/// A drive without fixes.
#[derive(Copy, Clone, Debug)]
pub(super) struct Drive {
    pub(super) motion: Motion,
    pub(super) ticks: u32,
    /// σ at the start \[rad\].
    pub(super) heading: f64,
}

impl Drive {
    /// At the origin, looking along x.
    pub(super) fn beginning(&self) -> Belief {
        // A square is never negative.
        let covariance = Covariance3::diagonal([0.0, 0.0, self.heading * self.heading]);
        Belief::independent(Pose::default(), covariance.unwrap_or_default())
    }

    /// What a filter with the step `step` believes at the end.
    pub(super) fn believed(&self, step: impl Fn(&Belief, &Motion, f64) -> Belief) -> Belief {
        let beginning = self.beginning();
        (0..self.ticks).fold(beginning, |belief, _| step(&belief, &self.motion, DT_S))
    }

    /// Where so many robots are then.
    pub(super) fn ends(&self, robots: usize) -> Vec<(f64, f64)> {
        let noise = Noise::new(1, 0);
        let end = |robot| self.end(&mut noise.draws(Purpose::TrueWay, 0, robot, 0));
        (0..robots).map(end).collect()
    }

    fn end(&self, draws: &mut Draws) -> (f64, f64) {
        let told = self.motion.velocity();
        let sigma = self.motion.covariance().variances().map(f64::sqrt);
        let (mut x, mut y, mut heading) = (0.0, 0.0, self.heading * draws.normal());
        for _ in 0..self.ticks {
            let off: [f64; 3] = draws.normals();
            let [vx, vy, omega]: [f64; 3] =
                std::array::from_fn(|axis| told[axis] + sigma[axis] * off[axis]);
            let (sin, cos) = f64::sin_cos(heading + omega * DT_S / 2.0);
            x += DT_S * (cos * vx - sin * vy);
            y += DT_S * (sin * vx + cos * vy);
            heading += DT_S * omega;
        }
        (x, y)
    }
}

/// `[xx, xy, yy]`
pub(super) fn position_covariance(belief: &Belief) -> [f64; 3] {
    let p = belief.total().matrix();
    [p.m11, p.m12, p.m22]
}
