//! What the demo came to: a line for each robot, and whether it met what is promised.

use std::collections::BTreeMap;
use std::path::PathBuf;

use coloc_shm_types::{Input, Reject};
use serde::Serialize;

use super::bars::{Bar, word};
use super::record::{Latency, Record};
use super::robot_file::name;
use crate::comparison::Accuracy;

/// Everything that the demo found out; `--json` prints it.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    /// Every bar was met.
    pub(crate) passed: bool,
    /// How long the robots drove \[s\].
    pub(crate) seconds: f64,
    /// What they drove in.
    pub(crate) world: String,
    /// `vcan` or `local`.
    pub(crate) bus: &'static str,
    /// Why that.
    pub(crate) bus_reason: String,
    /// In their order.
    pub(crate) robots: Vec<RobotSummary>,
    /// What is promised, and how it came out.
    pub(crate) bars: Vec<Bar>,
    /// What is left of the run's shared memory: files that should not be there.
    pub(crate) left_in_shared_memory: Vec<PathBuf>,
    /// The pictures.
    pub(crate) pictures: Vec<PathBuf>,
}

/// One robot's part.
#[derive(Debug, Serialize)]
pub(crate) struct RobotSummary {
    pub(crate) name: String,
    /// Its daemon spoke until the end.
    pub(crate) up_at_the_end: bool,
    /// How often its daemon was started.
    pub(crate) starts: usize,
    /// Against the truth; nothing if it was never heard.
    pub(crate) accuracy: Option<Accuracy>,
    /// Deadlines by which the tick before was not published yet.
    pub(crate) deadlines_missed: u64,
    /// Deadlines by which the tick before had not even woken.
    pub(crate) deadlines_missed_by_more_than_a_period: u64,
    /// Inputs that changed the belief, by kind.
    pub(crate) accepted: BTreeMap<&'static str, u64>,
    /// Inputs that did not, by kind and reason, where there were any.
    pub(crate) rejected: BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
    /// From wake-up to publication.
    pub(crate) latency_us: Latency,
}

impl RobotSummary {
    pub(crate) fn of(robot: usize, record: &Record, up_at_the_end: bool) -> Self {
        let accepted = Input::ALL.map(|input| (input.name(), record.accepted(input)));
        let reasons = |input| {
            let counts = Reject::ALL.map(|reason| (reason.name(), record.rejected(input, reason)));
            counts
                .into_iter()
                .filter(|(_, count)| *count > 0)
                .collect::<BTreeMap<_, _>>()
        };
        let rejected = Input::ALL.map(|input| (input.name(), reasons(input)));
        Self {
            name: name(robot + 1),
            up_at_the_end,
            starts: record.starts(),
            accuracy: Accuracy::of(&record.comparisons),
            deadlines_missed: record.missed(),
            deadlines_missed_by_more_than_a_period: record.missed_by_more_than_a_period(),
            accepted: accepted.into(),
            rejected: rejected
                .into_iter()
                .filter(|(_, reasons)| !reasons.is_empty())
                .collect(),
            latency_us: record.latency(),
        }
    }
}

const HEADER: [&str; 2] = [
    "               mean |error|             inside 3σ [%]          deadlines missed        inputs        tick [µs]",
    "robot     x [m]  y [m] φ [rad] |     x      y      φ |  at all  by a period | accepted rejected |   p50    p99    max",
];

impl Summary {
    /// The table and the verdict, as a person reads them.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = HEADER.map(str::to_owned).into();
        lines.extend(self.robots.iter().map(RobotSummary::line));
        lines.push(String::new());
        lines.extend(self.bars.iter().map(Bar::line));
        let left = self.left_in_shared_memory.len();
        lines.push(format!(
            "{}  nothing left in shared memory{}",
            word(left == 0),
            files(left)
        ));
        lines.push(format!(
            "{}  {} robots, {:.1} s, {}",
            word(self.passed),
            self.robots.len(),
            self.seconds,
            self.world
        ));
        lines
    }

    /// Why it did not pass, in one line.
    pub(crate) fn complaint(&self) -> Option<String> {
        let broken = self.bars.iter().find_map(|bar| {
            bar.broken_by
                .first()
                .map(|who| format!("not met: {} ({who})", bar.promise))
        });
        let left = self
            .left_in_shared_memory
            .first()
            .map(|file| format!("{} was left behind", file.display()));
        broken.or(left)
    }
}

fn files(left: usize) -> String {
    if left == 0 {
        String::new()
    } else {
        format!(": {left} files")
    }
}

impl RobotSummary {
    fn line(&self) -> String {
        let Some(accuracy) = &self.accuracy else {
            return format!("{:<8} was never heard", self.name);
        };
        let ([x, y, phi], inside) = (
            accuracy.mean_abs_error,
            accuracy.inside_3_sigma.map(|share| 100.0 * share),
        );
        let accepted: u64 = self.accepted.values().sum();
        let rejected: u64 = self.rejected.values().flat_map(BTreeMap::values).sum();
        format!(
            "{:<8} {x:>6.3} {y:>6.3} {phi:>7.4} | {:>5.1}  {:>5.1}  {:>5.1} | {:>7}  {:>11} | {accepted:>8} {rejected:>8} | {:>5.0} {:>6.0} {:>6.0}",
            self.name,
            inside[0],
            inside[1],
            inside[2],
            self.deadlines_missed,
            self.deadlines_missed_by_more_than_a_period,
            self.latency_us.p50,
            self.latency_us.p99,
            self.latency_us.max,
        )
    }
}
