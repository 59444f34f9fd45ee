//! What the demo came to: a line for each robot, and whether it met what is promised.

use std::collections::BTreeMap;
use std::path::PathBuf;

use coloc_shm_types::{Input, Reject};
use serde::Serialize;

use super::bars::{Bar, Expectation, bars};
use super::bystanders::Stall;
use super::record::{Latency, Record};
use super::robot_file::name;
use super::scene::{Help, Part};
use super::tale::Trial;
use crate::comparison::Accuracy;

/// Everything that the demo found out; `--json` prints it.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    pub(crate) verdict: Verdict,
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
    /// What each link knew of each other at the end: round trip, lost packets, clock.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) links: Vec<String>,
    /// What is left of the run's shared memory: files that should not be there.
    pub(crate) left_in_shared_memory: Vec<PathBuf>,
    /// For how long the machine did not serve threads that do nothing \[ms\].
    pub(crate) machine_stood_still_ms: f64,
    /// Why the run ended before its time, if something other than a person made it end.
    pub(crate) broke_down: Option<String>,
    /// The pictures that were drawn.
    pub(crate) pictures: Vec<PathBuf>,
}

/// What the run came to.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Verdict {
    /// Every bar was met.
    Passed,
    /// One was not.
    Failed,
    /// Somebody ended it early: nothing was decided.
    Interrupted,
}

impl Verdict {
    /// In front of what was `good`, or was not.
    fn word(self, good: bool) -> &'static str {
        match (self, good) {
            (Self::Interrupted, true) => "so far",
            (Self::Interrupted, false) => "MISSED",
            (_, true) => "PASS",
            (_, false) => "FAIL",
        }
    }

    fn whole_word(self) -> &'static str {
        match self {
            Self::Passed => "PASS",
            Self::Failed => "FAIL",
            Self::Interrupted => "INTERRUPTED",
        }
    }
}

/// What is known once everybody has ended.
pub(crate) struct Facts {
    pub(crate) robots: Vec<RobotSummary>,
    pub(crate) seconds: f64,
    pub(crate) world: String,
    pub(crate) bus: &'static str,
    pub(crate) bus_reason: String,
    pub(crate) left: Vec<PathBuf>,
    pub(crate) machine_stood_still_ms: f64,
    pub(crate) broke_down: Option<String>,
    /// What else is promised, of all of them.
    pub(crate) bars: Vec<Bar>,
    /// What the links say of one another.
    pub(crate) links: Vec<String>,
}

/// One robot's part.
#[derive(Debug, Serialize)]
pub(crate) struct RobotSummary {
    pub(crate) name: String,
    /// Its daemon spoke until the end.
    pub(crate) up_at_the_end: bool,
    /// How often its daemon was started.
    pub(crate) starts: usize,
    /// What it had to go by, besides its wheels.
    pub(crate) help: Help,
    /// What it is held to.
    pub(crate) expected: Option<Expectation>,
    /// What was promised of it, where something happens to it.
    pub(crate) trials: Vec<Trial>,
    /// Share of the time in which what others said changed its belief; nothing of a short run.
    pub(crate) told: Option<f64>,
    /// Against the truth; nothing if it was never heard.
    pub(crate) accuracy: Option<Accuracy>,
    /// Time mean of εᵀ P⁻¹ ε of the pose, nominal 3; nothing if it was never heard.
    pub(crate) nees: Option<f64>,
    /// Root of the time mean of the squared error of its wheels alone \[m, m, rad\].
    pub(crate) wheels_alone_rms_error: Option<[f64; 3]>,
    /// Deadlines by which the tick before was not published yet.
    pub(crate) deadlines_missed: u64,
    /// Deadlines by which the tick before had not even woken.
    pub(crate) deadlines_missed_by_more_than_a_period: u64,
    /// Those out of them that the machine missed: threads that do nothing were as late.
    pub(crate) deadlines_missed_by_the_machine: u64,
    /// Inputs that changed the belief, by kind.
    pub(crate) accepted: BTreeMap<&'static str, u64>,
    /// Inputs that did not, by kind and reason, where there were any.
    pub(crate) rejected: BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
    /// From wake-up to publication; nothing if it was never heard.
    pub(crate) latency_us: Option<Latency>,
}

impl RobotSummary {
    pub(crate) fn of(
        robot: usize,
        part: Part,
        record: &Record,
        up_at_the_end: bool,
        stalls: &[Stall],
    ) -> Self {
        let accepted = Input::ALL.map(|input| (input.name(), record.accepted(input)));
        let reasons = |input| {
            let reasons = Reject::ALL.iter();
            let counts = reasons.map(|&reason| (reason.name(), record.rejected(input, reason)));
            counts
                .filter(|(_, count)| *count > 0)
                .collect::<BTreeMap<_, _>>()
        };
        let rejected = Input::ALL.map(|input| (input.name(), reasons(input)));
        Self {
            name: name(robot + 1),
            up_at_the_end,
            starts: record.starts(),
            help: part.help,
            expected: part.expected,
            trials: part.tale.map_or_else(Vec::new, |tale| tale.trials(record)),
            told: record.told_share(),
            accuracy: record.accuracy(),
            nees: record.nees(),
            wheels_alone_rms_error: record.rms_error_of_wheels(),
            deadlines_missed: record.missed(),
            deadlines_missed_by_more_than_a_period: record.missed_by_more_than_a_period(),
            deadlines_missed_by_the_machine: record.missed_by_the_machine(stalls),
            accepted: accepted.into(),
            rejected: rejected
                .into_iter()
                .filter(|(_, reasons)| !reasons.is_empty())
                .collect(),
            latency_us: record.latency(),
        }
    }
}

/// Two lines of 80 columns.
fn headings() -> [String; 2] {
    [
        format!(
            "{:<14} {:>13} {:>13} {:>7} {:>5} {:>13} {:>9}",
            "robot", "error, rms", "wheels alone", "inside", "ticks", "inputs", "tick [µs]"
        ),
        format!(
            "{:<7} {:<6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>5} {:>7} {:>5} {:>9}",
            "", "helped", "[m]", "[rad]", "[m]", "[rad]", "3σ [%]", "late", "accept", "rej.", "p99"
        ),
    ]
}

impl Summary {
    /// Holds what was heard against what is promised.
    pub(crate) fn of(facts: Facts, interrupted: bool) -> Self {
        let robots: Vec<RobotSummary> = facts.robots;
        let mut bars = bars(&robots);
        bars.extend(facts.bars);
        let good = facts.left.is_empty()
            && facts.broke_down.is_none()
            && bars.iter().all(|bar| bar.broken_by.is_empty());
        let verdict = match (interrupted, good) {
            (true, _) => Verdict::Interrupted,
            (false, true) => Verdict::Passed,
            (false, false) => Verdict::Failed,
        };
        Self {
            verdict,
            seconds: facts.seconds,
            world: facts.world,
            bus: facts.bus,
            bus_reason: facts.bus_reason,
            robots,
            bars,
            links: facts.links,
            left_in_shared_memory: facts.left,
            machine_stood_still_ms: facts.machine_stood_still_ms,
            broke_down: facts.broke_down,
            pictures: Vec::new(),
        }
    }

    /// The table and the verdict, as a person reads them.
    pub(crate) fn lines(&self) -> Vec<String> {
        let word = |good| self.verdict.word(good);
        let mut lines: Vec<String> = headings().into();
        lines.extend(self.robots.iter().map(RobotSummary::line));
        lines.push(String::new());
        let bar = |bar: &Bar| bar.line(word(bar.broken_by.is_empty()));
        lines.extend(self.bars.iter().map(bar));
        lines.extend(self.machine());
        let left = self.left_in_shared_memory.len();
        lines.push(format!(
            "{}  nothing left in shared memory{}",
            word(left == 0),
            files(left)
        ));
        lines.extend(
            self.broke_down
                .iter()
                .map(|what| format!("{}  {what}", word(false))),
        );
        lines.push(format!(
            "{}  {}, {:.1} s, {}",
            self.verdict.whole_word(),
            robots(self.robots.len()),
            self.seconds,
            self.world
        ));
        lines
    }

    /// What the machine did, if deadlines were missed by that.
    fn machine(&self) -> Option<String> {
        let missed: u64 = (self.robots.iter())
            .map(|robot| robot.deadlines_missed_by_the_machine)
            .sum();
        (missed > 0).then(|| {
            format!(
                "note  the machine stood still for {:.0} ms in all, and {missed} deadlines were missed by that",
                self.machine_stood_still_ms
            )
        })
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
        self.broke_down.clone().or(broken).or(left)
    }
}

/// So many robots, in words.
pub(crate) fn robots(count: usize) -> String {
    format!("{count} robot{}", if count == 1 { "" } else { "s" })
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
            return format!("{:<7} was never heard while it drove", self.name);
        };
        let wheels = self.wheels_alone_rms_error.unwrap_or([f64::NAN; 3]);
        let [error, of_wheels] = [accuracy.rms_error, wheels].map(|[x, y, phi]| [x.hypot(y), phi]);
        let least_inside = accuracy.inside_3_sigma.into_iter().fold(1.0, f64::min);
        let accepted: u64 = self.accepted.values().sum();
        let rejected: u64 = self.rejected.values().flat_map(BTreeMap::values).sum();
        format!(
            "{:<7} {:<6} {:>6.3} {:>6.3} {:>6.3} {:>6.3} {:>7.1} {:>5} {accepted:>7} {rejected:>5} {:>9.0}",
            self.name,
            self.help.by(),
            error[0],
            error[1],
            of_wheels[0],
            of_wheels[1],
            100.0 * least_inside,
            self.deadlines_missed_by_more_than_a_period,
            self.latency_us.map_or(f64::NAN, |latency| latency.p99),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PART: Part = Part {
        help: Help::Nobody,
        expected: Some(Expectation {
            whose: "told nothing",
            error: Some([0.5; 3]),
            inside: 0.9,
            told: 0.5,
        }),
        tale: None,
    };

    fn facts(robots: usize) -> Facts {
        let heard = |robot| RobotSummary {
            accuracy: Some(Accuracy {
                estimates: 1500,
                inside_3_sigma: [1.0; 3],
                ..Accuracy::default()
            }),
            deadlines_missed: 123,
            deadlines_missed_by_more_than_a_period: 0,
            latency_us: Some(Latency::default()),
            ..RobotSummary::of(robot, PART, &Record::new(), true, &[])
        };
        Facts {
            robots: (0..robots).map(heard).collect(),
            seconds: 30.0,
            world: "synthetic world, seed 1".into(),
            bus: "local",
            bus_reason: String::new(),
            machine_stood_still_ms: 0.0,
            left: Vec::new(),
            broke_down: None,
            bars: Vec::new(),
            links: Vec::new(),
        }
    }

    #[test]
    fn a_large_team_fits_into_80_columns() {
        for line in Summary::of(facts(32), false).lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }

    #[test]
    fn columns_are_under_their_headings() {
        let summary = Summary::of(facts(1), false);
        let ends = |line: &str| {
            let chars: Vec<char> = line.chars().chain([' ']).collect();
            chars
                .windows(2)
                .enumerate()
                .filter(|(_, pair)| pair[0] != ' ' && pair[1] == ' ')
                .map(|(at, _)| at)
                .collect::<Vec<_>>()
        };
        let (headings, row) = (ends(&headings()[1]), ends(&summary.lines()[2]));
        assert!(
            row[1..].iter().all(|end| headings.contains(end)),
            "{headings:?} {row:?}"
        );
    }

    #[test]
    fn what_was_interrupted_never_passed() {
        let summary = Summary::of(facts(2), true);
        assert_eq!(summary.verdict, Verdict::Interrupted);
        let text = summary.lines().join("\n");
        assert!(
            text.contains("INTERRUPTED  2 robots") && !text.contains("PASS"),
            "{text}"
        );
        assert!(
            Summary::of(facts(1), false)
                .lines()
                .join("\n")
                .contains("PASS  1 robot,")
        );
    }

    #[test]
    fn what_broke_down_has_failed_and_says_so() {
        let broke_down = Some("the feed of sensors broke down".to_owned());
        let summary = Summary::of(
            Facts {
                broke_down: broke_down.clone(),
                ..facts(2)
            },
            false,
        );
        assert_eq!(
            (summary.verdict, summary.complaint()),
            (Verdict::Failed, broke_down)
        );
    }
}
