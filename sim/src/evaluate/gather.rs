//! Adds the runs of one method together, always in the order of their numbers: floating sums depend on it.

use std::collections::BTreeMap;
use std::time::Duration;

use super::config::EvalConfig;
use super::run::{Outcome, RobotOutcome};
use crate::method::Sent;
use crate::metrics::{NisTotals, StepTotals, Totals};

/// The runs of one method so far.
#[derive(Debug)]
pub(super) struct Gather {
    next: u16,
    /// Finished before an earlier one.
    waiting: BTreeMap<u16, Outcome>,
    pub(super) robots: Vec<RobotGather>,
    pub(super) sent: Sent,
    pub(super) time: Duration,
    every: usize,
}

/// The runs of one robot so far.
#[derive(Clone, Debug, Default)]
pub(super) struct RobotGather {
    pub(super) steps: Vec<StepTotals>,
    pub(super) totals: Totals,
    /// Of each run.
    pub(super) runs: Vec<Totals>,
    pub(super) neighbours: NisTotals,
    pub(super) fixes: NisTotals,
    /// Errors of the first run, decimated.
    pub(super) first_run: Vec<Option<[f64; 3]>>,
}

impl Gather {
    pub(super) fn new(config: &EvalConfig) -> Self {
        Self {
            next: 0,
            waiting: BTreeMap::new(),
            robots: vec![RobotGather::default(); config.robots()],
            sent: Sent::default(),
            time: Duration::ZERO,
            every: stride(config),
        }
    }

    pub(super) fn add(&mut self, run: u16, outcome: Outcome) {
        self.waiting.insert(run, outcome);
        while let Some(outcome) = self.waiting.remove(&self.next) {
            self.sent.messages += outcome.sent.messages;
            self.sent.bytes += outcome.sent.bytes;
            self.time += outcome.time;
            for (robot, outcome) in self.robots.iter_mut().zip(&outcome.robots) {
                robot.add(outcome, self.every);
            }
            self.next += 1;
        }
    }
}

impl RobotGather {
    fn add(&mut self, outcome: &RobotOutcome, every: usize) {
        self.steps
            .resize(outcome.samples.len(), StepTotals::default());
        for (step, sample) in self.steps.iter_mut().zip(&outcome.samples) {
            if let Some(sample) = sample {
                step.add(sample);
            }
        }
        if self.runs.is_empty() {
            let errors = outcome.samples.iter().step_by(every);
            self.first_run = errors
                .map(|sample| sample.as_ref().map(|sample| sample.error))
                .collect();
        }
        self.runs.push(outcome.totals);
        self.totals.merge(&outcome.totals);
        self.neighbours.merge(&outcome.neighbours);
        self.fixes.merge(&outcome.fixes);
    }
}

/// Steps from one plotted point to the next.
pub(super) fn stride(config: &EvalConfig) -> usize {
    (config.steps() / config.plot_points.max(1)).max(1)
}
