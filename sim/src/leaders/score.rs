//! How far off children were, and whether they knew.

use coloc_estimator::angle::wrap;
use coloc_estimator::{Belief, Pose};
use nalgebra::Vector3;

use super::robot::Method;
use crate::metrics::statistics::mean_and_deviation;
use crate::random::{Draws, Noise, Purpose};

/// χ² with three degrees of freedom, 95 %.
const CHI2_3_95: f64 = 7.814_727_903_251_179;

/// Draws of runs, for the interval of a share.
const DRAWS: usize = 4000;

/// Samples of a d².
#[derive(Copy, Clone, Debug, Default)]
struct Tally {
    /// Beyond the 95 % bound.
    outside: f64,
    sum: f64,
    count: f64,
}

impl Tally {
    fn add(&mut self, d2: f64) {
        self.outside += f64::from(u8::from(d2 > CHI2_3_95));
        self.sum += d2;
        self.count += 1.0;
    }

    fn plus(self, other: &Self) -> Self {
        Self {
            outside: self.outside + other.outside,
            sum: self.sum + other.sum,
            count: self.count + other.count,
        }
    }
}

/// Of one child by one method.
#[derive(Clone, Debug, Default)]
struct Account {
    /// Sums over runs of the squared errors of each step; nothing where nobody knows the truth.
    squares: Vec<Option<[f64; 3]>>,
    /// NEES of each run.
    runs: Vec<Tally>,
    /// NIS by leader, of all runs.
    innovations: Vec<Tally>,
}

/// Of all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Score {
    by_method: [Vec<Account>; 4],
    leaders: Vec<Tally>,
}

pub(super) fn error(belief: &Belief, truth: &Pose) -> Vector3<f64> {
    let error = belief.pose.to_vector() - truth.to_vector();
    Vector3::new(error.x, error.y, wrap(error.z))
}

pub(super) fn nees(belief: &Belief, error: &Vector3<f64>) -> f64 {
    let inverse = belief.total().matrix().try_inverse();
    inverse.map_or(f64::INFINITY, |it| (error.transpose() * it * error).x)
}

impl Score {
    /// Before a run of so many steps, with so many children and leaders.
    pub(crate) fn of_run(steps: usize, [children, leaders]: [usize; 2]) -> Self {
        let empty = Account {
            squares: vec![None; steps],
            runs: vec![Tally::default()],
            innovations: vec![Tally::default(); leaders],
        };
        Self {
            by_method: [(); 4].map(|()| vec![empty.clone(); children]),
            leaders: vec![Tally::default(); leaders],
        }
    }

    pub(crate) fn add(
        &mut self,
        method: Method,
        child: usize,
        step: usize,
        (belief, truth): (&Belief, &Pose),
    ) {
        let error = error(belief, truth);
        let account = &mut self.by_method[method as usize][child];
        let squares = error.map(|it| it * it).into();
        account.squares[step - 1] = Some(squares);
        if let Some(tally) = account.runs.last_mut() {
            tally.add(nees(belief, &error));
        }
    }

    pub(crate) fn leader(&mut self, leader: usize, (belief, truth): (&Belief, &Pose)) {
        self.leaders[leader].add(nees(belief, &error(belief, truth)));
    }

    pub(crate) fn innovation(&mut self, method: Method, child: usize, leader: usize, d2: f64) {
        self.by_method[method as usize][child].innovations[leader].add(d2);
    }

    /// With the runs of another.
    pub(crate) fn merged(mut self, other: Self) -> Self {
        if self.leaders.is_empty() {
            return other;
        }
        let all = self.by_method.iter_mut().flatten();
        for (one, mut more) in all.zip(other.by_method.into_iter().flatten()) {
            one.runs.append(&mut more.runs);
            add_up(&mut one.innovations, &more.innovations);
            for (sum, square) in one.squares.iter_mut().zip(&more.squares) {
                let both = sum.zip(*square);
                *sum = both.map(|(a, b)| core::array::from_fn(|i| a[i] + b[i]));
            }
        }
        add_up(&mut self.leaders, &other.leaders);
        self
    }

    fn account(&self, method: Method, child: usize) -> &Account {
        &self.by_method[method as usize][child]
    }

    /// Of x, y and φ, in steps that `counts`: mean over time and deviation of the RMSE over runs.
    pub(crate) fn accuracy(
        &self,
        method: Method,
        child: usize,
        counts: impl Fn(usize) -> bool,
    ) -> [[f64; 2]; 3] {
        let account = self.account(method, child);
        #[allow(clippy::cast_precision_loss)] // Some runs.
        let runs = account.runs.len() as f64;
        [0, 1, 2].map(|i| {
            let squares = (1..)
                .zip(&account.squares)
                .filter(|(step, _)| counts(*step));
            let squares = squares.filter_map(|(_, it)| *it);
            let rmse: Vec<f64> = squares.map(|it| (it[i] / runs).sqrt()).collect();
            mean_and_deviation(&rmse)
        })
    }

    /// Share of NEES beyond the 95 % bound.
    pub(crate) fn outside(&self, method: Method, child: usize) -> f64 {
        let all = total(&self.account(method, child).runs);
        all.outside / all.count
    }

    /// Mean NEES.
    pub(crate) fn nees(&self, method: Method, child: usize) -> f64 {
        let all = total(&self.account(method, child).runs);
        all.sum / all.count
    }

    /// Share of NIS beyond the 95 % bound, of what one leader said.
    pub(crate) fn nis(&self, method: Method, child: usize, leader: usize) -> f64 {
        let tally = self.account(method, child).innovations[leader];
        tally.outside / tally.count
    }

    /// Share of a leader's own NEES beyond the 95 % bound.
    pub(crate) fn leader_outside(&self, leader: usize) -> f64 {
        self.leaders[leader].outside / self.leaders[leader].count
    }

    /// Of the share outside: what 99 % of draws of as many runs come to.
    pub(crate) fn interval(&self, method: Method, child: usize) -> [f64; 2] {
        let runs = &self.account(method, child).runs;
        let noise = Noise::new(1, 0);
        let draw = |step| {
            let mut draws = noise.draws(Purpose::Ordeal, step, 0, 0);
            let drawn: Vec<_> = runs
                .iter()
                .map(|_| runs[any(&mut draws, runs.len())])
                .collect();
            let all = total(&drawn);
            all.outside / all.count
        };
        let mut shares: Vec<f64> = (0..DRAWS).map(draw).collect();
        shares.sort_by(f64::total_cmp);
        [shares[DRAWS / 200], shares[DRAWS - 1 - DRAWS / 200]]
    }
}

fn total(tallies: &[Tally]) -> Tally {
    let sum = |all: Tally, it: &Tally| all.plus(it);
    tallies.iter().fold(Tally::default(), sum)
}

fn add_up(sums: &mut [Tally], more: &[Tally]) {
    for (sum, it) in sums.iter_mut().zip(more) {
        *sum = sum.plus(it);
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
