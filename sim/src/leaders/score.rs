//! How far off children were, and whether they knew.

use coloc_estimator::angle::wrap;
use coloc_estimator::{Belief, Pose};
use nalgebra::Vector3;

use super::run::Method;
use crate::metrics::statistics::mean_and_deviation;
use crate::random::{Draws, Noise, Purpose};

/// χ² with three degrees of freedom, 95 %.
const CHI2_3_95: f64 = 7.814_727_903_251_179;

/// Draws of runs, for the interval of a share.
const DRAWS: usize = 4000;

/// Of one child by one method.
#[derive(Clone, Debug, Default)]
struct Account {
    /// Sums over runs of the squared errors of each step.
    squares: Vec<[f64; 3]>,
    /// Of each run: how many NEES are outside, and their sum.
    runs: Vec<[f64; 2]>,
}

/// Of all children by all methods.
#[derive(Clone, Debug, Default)]
pub(crate) struct Score([[Account; 4]; 3]);

impl Score {
    /// Before a run of so many steps.
    pub(crate) fn of_run(steps: usize) -> Self {
        let empty = Account {
            squares: vec![[0.0; 3]; steps],
            runs: vec![[0.0; 2]],
        };
        Self([(); 3].map(|()| [(); 4].map(|()| empty.clone())))
    }

    pub(crate) fn add(
        &mut self,
        (method, child, step): (usize, usize, usize),
        belief: &Belief,
        truth: &Pose,
    ) {
        let error = belief.pose.to_vector() - truth.to_vector();
        let error = Vector3::new(error.x, error.y, wrap(error.z));
        let account = &mut self.0[method][child];
        for (square, it) in account.squares[step - 1].iter_mut().zip(error.iter()) {
            *square += it * it;
        }
        let inverse = belief.total().matrix().try_inverse();
        let nees = inverse.map_or(f64::INFINITY, |it| (error.transpose() * it * error).x);
        if let Some([outside, sum]) = account.runs.last_mut() {
            *outside += f64::from(u8::from(nees > CHI2_3_95));
            *sum += nees;
        }
    }

    /// With the runs of another.
    pub(crate) fn merged(mut self, other: Self) -> Self {
        let all = self.0.iter_mut().flatten();
        for (one, mut more) in all.zip(other.0.into_iter().flatten()) {
            if one.squares.is_empty() {
                *one = more;
                continue;
            }
            one.runs.append(&mut more.runs);
            for (sum, square) in one.squares.iter_mut().zip(&more.squares) {
                *sum = core::array::from_fn(|i| sum[i] + square[i]);
            }
        }
        self
    }

    fn account(&self, method: Method, child: usize) -> &Account {
        &self.0[method as usize][child]
    }

    /// Of x, y and φ: mean over time and deviation of the RMSE over runs.
    pub(crate) fn accuracy(&self, method: Method, child: usize) -> [[f64; 2]; 3] {
        let account = self.account(method, child);
        #[allow(clippy::cast_precision_loss)] // Some runs.
        let runs = account.runs.len() as f64;
        [0, 1, 2].map(|i| {
            let squares = account.squares.iter();
            let rmse: Vec<f64> = squares.map(|it| (it[i] / runs).sqrt()).collect();
            mean_and_deviation(&rmse)
        })
    }

    /// Share of NEES beyond the 95 % bound.
    pub(crate) fn outside(&self, method: Method, child: usize) -> f64 {
        self.mean(method, child, 0)
    }

    /// Mean NEES.
    pub(crate) fn nees(&self, method: Method, child: usize) -> f64 {
        self.mean(method, child, 1)
    }

    #[allow(clippy::cast_precision_loss)] // Some millions of samples.
    fn mean(&self, method: Method, child: usize, which: usize) -> f64 {
        let account = self.account(method, child);
        let samples = account.squares.len() * account.runs.len();
        let sum: f64 = account.runs.iter().map(|it| it[which]).sum();
        sum / samples as f64
    }

    /// Of the share outside: what 99 % of draws of as many runs come to.
    pub(crate) fn interval(&self, method: Method, child: usize) -> [f64; 2] {
        let account = self.account(method, child);
        let (noise, count) = (Noise::new(1, 0), account.runs.len());
        #[allow(clippy::cast_precision_loss)]
        let samples = (account.squares.len() * count) as f64;
        let draw = |step| {
            let mut draws = noise.draws(Purpose::Ordeal, step, 0, 0);
            let runs = (0..count).map(|_| account.runs[any(&mut draws, count)][0]);
            runs.sum::<f64>() / samples
        };
        let mut shares: Vec<f64> = (0..DRAWS).map(draw).collect();
        shares.sort_by(f64::total_cmp);
        [shares[DRAWS / 200], shares[DRAWS - 1 - DRAWS / 200]]
    }
}

/// Any number below `count`.
#[allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss
)] // Some runs.
fn any(draws: &mut Draws, count: usize) -> usize {
    (draws.uniform(0.0, count as f64) as usize).min(count - 1)
}
