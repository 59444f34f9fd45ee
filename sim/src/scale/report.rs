//! What a run came to.

use coloc_estimator::Pose;
use serde::Serialize;

use super::cells::Member;
use super::digest::Digest;
use super::field::Field;
use super::robot::{Robot, Tally};
use super::{Addressees, Block, RECEIVERS, ScaleConfig, TICKS, Words};
use crate::metrics::{NisTotals, Totals};

/// All robots together. The same seed gives the same bytes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScaleReport {
    /// How many.
    pub robots: usize,
    /// How many of them have a receiver.
    pub receivers: usize,
    /// Of 20 ms, of each.
    pub ticks: usize,
    /// The seed of all randomness.
    pub seed: u64,
    /// Length of a side of the field \[m\].
    pub field_m: f64,
    /// Others in range of a robot, mean over robots and exchanges.
    pub neighbours: f64,
    /// Messages heard.
    pub messages: u64,
    /// Messages lost.
    pub lost: u64,
    /// Share of them that did not pass the gate.
    pub gated_share: Option<f64>,
    /// RMS distance from the truth at the exchanges \[m\].
    pub rms_position_m: f64,
    /// RMS error of the heading \[rad\].
    pub rms_heading_rad: f64,
    /// Mean NEES, nominal 3.
    pub nees: f64,
    /// Share of samples above the 95 % quantile, nominal 0.05.
    pub outside: f64,
    /// Share of samples of robots that did not say that they know where they are.
    pub unsure: f64,
    /// Measurements that an estimator had no use for.
    pub refused: u64,
    /// Measurements for which others had to leave the history early.
    pub folded_early: u64,
    /// What a robot takes: its estimator, its history, its world, what it says \[bytes\].
    pub bytes_per_robot: usize,
    /// Of that its estimator with the history \[bytes\].
    pub estimator_bytes: usize,
    /// Of all beliefs at the end and all errors, to the last bit.
    pub digest: String,
}

impl ScaleReport {
    /// Ticks of all robots.
    #[must_use]
    pub fn robot_ticks(&self) -> u64 {
        self.robots as u64 * self.ticks as u64
    }
}

#[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
pub(super) fn report(
    config: &ScaleConfig,
    field: Field,
    blocks: &[Block],
    exchanges: usize,
) -> ScaleReport {
    let (mut totals, mut heard) = (Totals::default(), NisTotals::default());
    for block in blocks {
        totals.merge(&block.tally.totals);
        heard.merge(&block.tally.neighbours);
    }
    let sum = |of: fn(&Tally) -> u64| blocks.iter().map(|block| of(&block.tally)).sum::<u64>();
    let samples = (config.robots * exchanges) as f64;
    let [_, _, rms_heading_rad] = totals.rms();
    ScaleReport {
        robots: config.robots,
        receivers: config.robots.div_ceil(RECEIVERS),
        ticks: exchanges * TICKS,
        seed: config.seed,
        field_m: field.side_m,
        neighbours: sum(|tally| tally.in_range) as f64 / samples,
        messages: sum(|tally| tally.heard),
        lost: sum(|tally| tally.lost),
        gated_share: heard.gated_share(),
        rms_position_m: totals.rms_position(),
        rms_heading_rad,
        nees: totals.nees(),
        outside: totals.nees_outside(),
        unsure: sum(|tally| tally.unsure) as f64 / samples,
        refused: sum(|tally| tally.refused),
        folded_early: sum(|tally| tally.folded_early),
        bytes_per_robot: bytes_per_robot(),
        estimator_bytes: Robot::estimator_bytes(),
        digest: format!("{:016x}", digest(blocks, exchanges).value()),
    }
}

fn digest(blocks: &[Block], exchanges: usize) -> Digest {
    let mut digest = Digest::new();
    for block in blocks {
        for robot in &block.robots {
            digest.belief(&robot.belief(exchanges * TICKS));
        }
        digest.real(block.tally.totals.rms_position());
        digest.real(block.tally.totals.nees());
        digest.whole(block.tally.heard);
    }
    digest
}

fn bytes_per_robot() -> usize {
    let said = 2 * (size_of::<Addressees>() + size_of::<Words>());
    let here = size_of::<Pose>() + size_of::<Member>();
    size_of::<Robot>() + Robot::estimator_bytes() + said + here
}
