//! A team of [`Node`]s, and what is sent at an update.

use super::measurement::Measurement;
use super::node::{Node, Split, Update, is_zero, triangle};
use super::{Matrix, root, solve_lower, symmetric};

/// What came of an update.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Everybody in the cluster has changed.
    Applied,
    /// d² was above the gate; nothing has changed.
    Gated,
    /// A robot of the cluster could not be reached; nothing has changed.
    Aborted,
    /// S has no inverse; nothing has changed.
    Singular,
}

/// What came of an update, and who took part.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// What.
    pub verdict: Verdict,
    /// Normalised innovation squared; `None` where it was not known.
    pub d2: Option<f64>,
    /// The cluster, ascending.
    pub participants: Vec<usize>,
}

/// How an update is made.
#[derive(Copy, Clone, Debug)]
pub struct Terms<'a> {
    /// χ² of its dimension.
    pub gate: f64,
    /// Only the robot that measured changes: the others' gain is zero \[B7\].
    pub silent: bool,
    /// Who cannot be reached.
    pub unreachable: &'a [usize],
}

impl Default for Terms<'_> {
    fn default() -> Self {
        Self {
            gate: f64::INFINITY,
            silent: false,
            unreachable: &[],
        }
    }
}

/// What was sent, and what would have been, in numbers of eight bytes \[B12\].
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Messages.
    pub messages: usize,
    /// Numbers in them.
    pub numbers: usize,
    /// Numbers that the form with replicated Π would have sent.
    pub pi_numbers: usize,
    /// Updates that were applied.
    pub updates: usize,
}

/// The team.
#[derive(Clone, Debug)]
pub struct Team {
    /// Its robots.
    pub nodes: Vec<Node>,
    split: Split,
    /// To which cluster each belongs: its lowest member.
    cluster: Vec<usize>,
    traffic: Traffic,
}

impl Team {
    /// Of robots that have never met.
    #[must_use]
    pub fn new(robots: Vec<(Vec<f64>, Matrix)>, split: Split) -> Self {
        let size = robots.len();
        let node = |(state, covariance)| Node::new(state, covariance, size);
        Self {
            nodes: robots.into_iter().map(node).collect(),
            split,
            cluster: (0..size).collect(),
            traffic: Traffic::default(),
        }
    }

    /// What was sent so far.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// `P_lm`.
    #[must_use]
    pub fn cross(&self, l: usize, m: usize) -> Matrix {
        if l == m {
            return self.nodes[l].covariance.clone();
        }
        &self.nodes[l].factors[m] * self.nodes[m].factors[l].transpose()
    }

    /// Sets `P_lm`, l < m: robots that met before.
    pub fn set_cross(&mut self, l: usize, m: usize, x: Matrix) {
        if is_zero(&x) {
            return;
        }
        let (low, high) = self.split.of(x);
        self.nodes[l].factors[m] = low;
        self.nodes[m].factors[l] = high;
        self.merge(&[l, m]);
    }

    fn merge(&mut self, robots: &[usize]) {
        let of: Vec<usize> = robots.iter().map(|&it| self.cluster[it]).collect();
        let lowest = of.iter().min().copied().unwrap_or_default();
        for cluster in &mut self.cluster {
            if of.contains(cluster) {
                *cluster = lowest;
            }
        }
    }

    fn participants(&self, measured: &[usize], silent: bool) -> Vec<usize> {
        if silent {
            return measured.to_vec();
        }
        let of: Vec<usize> = measured.iter().map(|&it| self.cluster[it]).collect();
        (0..self.nodes.len())
            .filter(|it| of.contains(&self.cluster[*it]))
            .collect()
    }

    /// One update in three rounds of messages.
    pub fn update(&mut self, measurement: &Measurement, terms: &Terms<'_>) -> Report {
        let measured: Vec<usize> = measurement.jacobians.iter().map(|(it, _)| *it).collect();
        let participants = self.participants(&measured, terms.silent);
        let report = |verdict, d2| Report {
            verdict,
            d2,
            participants: participants.clone(),
        };
        if participants.iter().any(|it| terms.unreachable.contains(it)) {
            return report(Verdict::Aborted, None);
        }
        let offered = self.first_round(measurement, &measured);
        let s = self.innovation(measurement);
        let Some(root) = root(&s) else {
            return report(Verdict::Singular, None);
        };
        let whitened = solve_lower(&root, &measurement.residual);
        let d2 = whitened.norm_squared();
        if d2.is_nan() || d2 > terms.gate {
            return report(Verdict::Gated, Some(d2));
        }
        self.traffic.messages += offered.0;
        self.traffic.numbers += offered.1;
        if terms.silent {
            self.silent(measurement, &root, &whitened);
        } else {
            self.count_pi_form(measurement, participants.len());
            self.second_and_third_round(measurement, &measured, &participants, (root, whitened));
            self.merge(&measured);
        }
        self.traffic.updates += 1;
        report(Verdict::Applied, Some(d2))
    }

    /// Those that measure or are measured tell one another what they are; messages and numbers. The measurement goes along once.
    fn first_round(&self, measurement: &Measurement, measured: &[usize]) -> (usize, usize) {
        let (mut messages, mut numbers) = (0, 0);
        for &robot in measured {
            let others: Vec<usize> = measured.iter().copied().filter(|it| *it != robot).collect();
            if !others.is_empty() {
                messages += others.len();
                numbers += others.len() * self.nodes[robot].offer(&others[..1]).numbers();
            }
        }
        if messages > 0 {
            numbers += measurement.dimension() + triangle(measurement.dimension());
        }
        (messages, numbers)
    }

    /// `S = R + Σ H_a P_ab H_bᵀ`.
    fn innovation(&self, measurement: &Measurement) -> Matrix {
        let mut s = measurement.noise.clone();
        for (a, first) in &measurement.jacobians {
            for (b, second) in &measurement.jacobians {
                s += first * self.cross(*a, *b) * second.transpose();
            }
        }
        symmetric(&s)
    }

    fn second_and_third_round(
        &mut self,
        measurement: &Measurement,
        measured: &[usize],
        participants: &[usize],
        (root, whitened): (Matrix, Matrix),
    ) {
        let mut gains = Vec::with_capacity(participants.len());
        for &robot in participants {
            let parts = measurement
                .jacobians
                .iter()
                .map(|(a, h)| (*a, h.clone(), self.nodes[*a].factors[robot].clone()))
                .collect();
            let update = Update {
                root: root.clone(),
                whitened: whitened.clone(),
                parts,
            };
            if !measured.contains(&robot) {
                self.traffic.messages += measured.len();
                self.traffic.numbers += update.numbers();
            }
            gains.push(self.nodes[robot].gain(robot, &update));
        }
        for (i, &l) in participants.iter().enumerate() {
            for (j, &m) in participants.iter().enumerate().skip(i + 1) {
                let told = [
                    self.nodes[l].factor(m, &gains[i]),
                    self.nodes[m].factor(l, &gains[j]),
                ];
                self.traffic.messages += 2;
                self.traffic.numbers += told[0].numbers() + told[1].numbers();
                let [first, second] = told;
                let x = first.factor * second.factor.transpose();
                let x = x - first.gain * second.gain.transpose();
                (self.nodes[l].factors[m], self.nodes[m].factors[l]) = self.split.of(x);
            }
        }
        for (&robot, gain) in participants.iter().zip(&gains) {
            self.nodes[robot].correct(gain, &whitened);
        }
    }

    /// `A_al ← (I − K_a H_a) A_al`: nobody else changes, nobody is told.
    fn silent(&mut self, measurement: &Measurement, root: &Matrix, whitened: &Matrix) {
        for (robot, h) in &measurement.jacobians {
            let update = Update {
                root: root.clone(),
                whitened: whitened.clone(),
                parts: vec![(*robot, h.clone(), Matrix::zeros(0, 0))],
            };
            let node = &mut self.nodes[*robot];
            let gain = node.gain(*robot, &update);
            // K H = G L⁻¹ H
            let less = &gain * solve_lower(root, h);
            let left = Matrix::identity(h.ncols(), h.ncols()) - less;
            node.correct(&gain, whitened);
            for factor in node.factors.iter_mut().filter(|it| !is_zero(it)) {
                *factor = &left * &*factor;
            }
        }
    }

    fn count_pi_form(&mut self, measurement: &Measurement, participants: usize) {
        let m = measurement.dimension();
        let t = triangle(m);
        self.traffic.pi_numbers += match (measurement.jacobians.len(), participants) {
            (1, 1) => 0,
            (1, _) => 6 * m + t + m,
            _ => (24 + m + t) + (12 * m + t + m),
        };
    }
}
