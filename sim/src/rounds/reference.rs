//! The joint filter of the whole team in one dense matrix, in Joseph's form, from what a [`Crew`] wrote down: whoever took no part in a round
//! has a gain of zero there, as all but its own robot have at a silent fix.
//!
//! ```text
//! x̂ += K r ;  P ← (I − K H) P (I − K H)ᵀ + K R Kᵀ    with the rows of K of those outside set to zero
//! ```
//!
//! It knows nothing of Ψ, of histories and of messages, and it is told every round at its slot: what a robot shares has to be what this
//! filter has for it, to rounding.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use coloc_rounds::model::{Kind, drive, predict};
use coloc_rounds::{Share, Standing};
use nalgebra::{Matrix3, Vector3};

use super::crew::{Crew, Logged};
use crate::dkf::{Matrix, root, solve_lower, symmetric};
use crate::method::FilterSettings;

/// How far a crew was from the joint filter.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Distance {
    /// Beliefs that were compared: of robots whose last round is the one that the team has for them.
    pub compared: u64,
    /// Beliefs that were not.
    pub apart: u64,
    /// Rounds of the line that was followed.
    pub rounds: u64,
    /// Of them, those with a block bound.
    pub bounds: u64,
    /// Farthest \[m, m, rad\].
    pub farthest: [f64; 3],
    /// Of P, in units of the standard deviations.
    pub covariance: f64,
}

/// The filter.
#[derive(Clone, Debug)]
pub struct Reference {
    poses: Vec<Pose>,
    covariance: Matrix,
}

impl Reference {
    /// Of robots that share nothing.
    #[must_use]
    pub fn new(robots: &[(Pose, Matrix3<f64>)]) -> Self {
        let size = 3 * robots.len();
        let mut covariance = Matrix::zeros(size, size);
        for (robot, (_, p)) in robots.iter().enumerate() {
            put(&mut covariance, [robot, robot], p);
        }
        Self {
            poses: robots.iter().map(|(pose, _)| *pose).collect(),
            covariance,
        }
    }

    /// Where a robot is believed to be, and P.
    #[must_use]
    pub fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        (self.poses[robot], self.block(robot, robot))
    }

    fn block(&self, l: usize, m: usize) -> Matrix3<f64> {
        self.covariance
            .fixed_view::<3, 3>(3 * l, 3 * m)
            .into_owned()
    }

    /// A step of every robot.
    pub(super) fn drive(&mut self, logged: &Logged, dt_s: f64) {
        let size = 3 * self.poses.len();
        let (mut phi, mut noise) = (Matrix::identity(size, size), Matrix::zeros(size, size));
        for (robot, motion) in logged.motions.iter().enumerate() {
            let step = drive(&self.poses[robot], motion, dt_s);
            self.poses[robot] = step.pose;
            put(&mut phi, [robot, robot], &step.jacobian);
            put(&mut noise, [robot, robot], &step.noise);
        }
        self.covariance = symmetric(&(&phi * &self.covariance * phi.transpose() + noise));
    }

    /// A measurement from which only `taking` learn.
    pub fn measure(
        &mut self,
        kind: Kind,
        [a, b]: [usize; 2],
        y: [f64; 3],
        noise: &Matrix3<f64>,
        (gate, taking): (f64, &[usize]),
    ) -> bool {
        let (rows, size) = (kind.dimension(), 3 * self.poses.len());
        let expected = predict(kind, &self.poses[a], &self.poses[b]);
        let mut h = Matrix::zeros(rows, size);
        let mut part = |robot: usize, of: &Matrix3<f64>| {
            let mut place = h.view_mut((0, 3 * robot), (rows, 3));
            place.copy_from(&of.rows(0, rows));
        };
        part(a, &expected.first);
        if kind.is_of_two() {
            part(b, &expected.second);
        }
        let r = Matrix::from_fn(rows, rows, |i, j| noise[(i, j)]);
        let residual = expected.residual(y);
        let residual = Matrix::from_fn(rows, 1, |i, _| residual[i]);
        let seen = &h * &self.covariance;
        let s = symmetric(&(&seen * h.transpose() + &r));
        let Some(root) = root(&s) else {
            return false;
        };
        let whitened = solve_lower(&root, &residual);
        if whitened.norm_squared() > gate {
            return false;
        }
        let whitened_rows = solve_lower(&root, &seen);
        let unit = solve_lower(&root, &Matrix::identity(rows, rows));
        let gain = whitened_rows.transpose() * unit;
        let takes = |row: usize| taking.contains(&(row / 3));
        let gain = Matrix::from_fn(size, rows, |i, j| if takes(i) { gain[(i, j)] } else { 0.0 });
        let step = &gain * residual;
        for (robot, pose) in self.poses.iter_mut().enumerate() {
            let by = |i: usize| step[3 * robot + i];
            *pose = Pose::new(pose.x + by(0), pose.y + by(1), pose.phi + by(2));
        }
        let left = Matrix::identity(size, size) - &gain * h;
        let kept = &left * &self.covariance * left.transpose();
        let added = &gain * r * gain.transpose();
        self.covariance = symmetric(&(kept + added));
        true
    }

    /// `robots` share nothing that is known any more: their P and everything of the others times `factor`; who is `absent` owes it.
    fn bound(&mut self, robots: &[usize], factor: f64, owed: &mut [f64], absent: &[usize]) {
        let size = self.poses.len();
        let pairs = (0..size).flat_map(|l| (0..size).map(move |m| (l, m)));
        for (l, m) in pairs {
            let by = if l == m && absent.contains(&l) {
                1.0
            } else if l != m && (robots.contains(&l) || robots.contains(&m)) {
                0.0
            } else {
                factor
            };
            let block = self.block(l, m) * by;
            put(&mut self.covariance, [l, m], &block);
        }
        for robot in absent {
            owed[*robot] *= factor;
        }
    }

    fn pay(&mut self, robot: usize, owed: &mut f64) {
        let block = self.block(robot, robot) * *owed;
        put(&mut self.covariance, [robot, robot], &block);
        *owed = 1.0;
    }
}

fn put(matrix: &mut Matrix, [l, m]: [usize; 2], block: &Matrix3<f64>) {
    let mut place = matrix.fixed_view_mut::<3, 3>(3 * l, 3 * m);
    place.copy_from(block);
}

/// How far what `crew` shared is from the joint filter that began at `initial`.
#[must_use]
pub fn distance(
    crew: &Crew,
    settings: &FilterSettings,
    initial: &[(Pose, Matrix3<f64>)],
    gates: [f64; 3],
) -> Distance {
    let robots = initial.len();
    let mut reference = Reference::new(initial);
    let mut distance = Distance::default();
    let line = crew.line();
    let mut last: Vec<Option<u64>> = vec![Some(0); robots];
    let mut owed = vec![1.0; robots];
    for logged in &crew.log {
        reference.drive(logged, settings.dt_s);
        for fix in &logged.fixes {
            let [x, y] = fix.position;
            let a = settings.fix.matrix();
            let noise = Matrix3::new(a.m11, a.m12, 0.0, a.m21, a.m22, 0.0, 0.0, 0.0, 0.0);
            let alone = (settings.product.position_gate, &[fix.robot][..]);
            let robots = [fix.robot; 2];
            reference.measure(Kind::Position, robots, [x, y, 0.0], &noise, alone);
        }
        for share in &logged.shares {
            distance.compare(&reference, share, last[share.robot]);
        }
        let Some(slot) = logged.shares.first().map(|share| share.shared.slot) else {
            continue;
        };
        let Some(round) = line.iter().find(|round| round.slot == slot) else {
            continue;
        };
        distance.rounds += 1;
        let took: Vec<usize> = (0..robots)
            .filter(|it| round.last(*it) == Some(slot))
            .collect();
        let absent: Vec<usize> = (0..robots).filter(|it| !took.contains(it)).collect();
        let joins: Vec<usize> = took
            .iter()
            .copied()
            .filter(|it| matches!(logged.shares[*it].shared.standing, Standing::Joining(_)))
            .collect();
        // A robot that joins may have refused or lost what the team has for it: what it says counts, and what it owed is of before.
        for &robot in &joins {
            let shared = &logged.shares[robot].shared;
            reference.poses[robot] = shared.pose;
            put(
                &mut reference.covariance,
                [robot, robot],
                &shared.covariance,
            );
            owed[robot] = 1.0;
        }
        for &robot in &took {
            let mut debt = owed[robot];
            reference.pay(robot, &mut debt);
            owed[robot] = debt;
        }
        if !joins.is_empty() {
            distance.bounds += 1;
            let others = (0..robots).any(|it| last[it].is_some() && !joins.contains(&it));
            #[allow(clippy::cast_precision_loss)] // A team is small.
            let factor = (joins.len() + usize::from(others)) as f64;
            reference.bound(&joins, factor, &mut owed, &absent);
        }
        for &robot in &took {
            for sighting in &logged.shares[robot].sightings {
                let is_between = took.contains(&sighting.observed);
                if sighting.kind.is_of_two() && is_between {
                    let gate = gates[sighting.kind.dimension() - 1];
                    let pair = [robot, sighting.observed];
                    let of = (gate, &took[..]);
                    reference.measure(sighting.kind, pair, sighting.y, &sighting.noise, of);
                }
            }
        }
        for (robot, last) in last.iter_mut().enumerate() {
            *last = round.last(robot);
        }
    }
    distance
}

impl Distance {
    fn compare(&mut self, reference: &Reference, share: &Share, last: Option<u64>) {
        let shared = &share.shared;
        let is_with_the_team = match shared.standing {
            Standing::Since(slot) => last == Some(slot),
            Standing::Joining(_) => false,
        };
        if !is_with_the_team {
            self.apart += 1;
            return;
        }
        self.compared += 1;
        let (pose, covariance) = reference.estimate(share.robot);
        let off = Vector3::new(
            shared.pose.x - pose.x,
            shared.pose.y - pose.y,
            wrap(shared.pose.phi - pose.phi),
        );
        let sigma = covariance.diagonal().map(f64::sqrt);
        for i in 0..3 {
            self.farthest[i] = self.farthest[i].max(off[i].abs());
            for j in 0..3 {
                let error = (shared.covariance[(i, j)] - covariance[(i, j)]).abs();
                self.covariance = self.covariance.max(error / (sigma[i] * sigma[j]));
            }
        }
    }
}
