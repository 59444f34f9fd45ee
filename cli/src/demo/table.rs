//! The live table: every robot's pose, error, claim, inputs and latency on a line.

use std::time::Duration;

use coloc_shm_types::BeliefState;

use super::clock::world_time_s;
use super::record::Record;
use super::robot_file::name;
use super::watch::sigma;
use crate::comparison::{Comparison, Moment};
use crate::fitted::fitted;

/// A daemon that was silent for so long is not up.
const SILENCE: Duration = Duration::from_millis(500);

/// How one robot's daemon is doing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum State {
    /// It has not spoken yet.
    Starting(u32),
    /// It speaks.
    Up(u32),
    /// It runs and has not spoken for a while.
    Silent(u32),
    /// It is gone; this starts it again.
    Down(String),
}

impl State {
    /// `process` is who acts for the robot, if anybody does; `restart` is the command that starts it again.
    pub(crate) fn of(record: &Record, process: Option<u32>, restart: &str) -> Self {
        match (process, &record.latest) {
            (None, _) => Self::Down(restart.to_owned()),
            (Some(pid), None) => Self::Starting(pid),
            (Some(pid), Some((_, when))) if when.elapsed() > SILENCE => Self::Silent(pid),
            (Some(pid), Some(_)) => Self::Up(pid),
        }
    }

    /// The process that can be killed, or why there is none that speaks.
    fn cell(&self) -> String {
        match self {
            Self::Starting(_) => "starting".into(),
            Self::Up(pid) => pid.to_string(),
            Self::Silent(_) => "silent".into(),
            Self::Down(_) => "DOWN".into(),
        }
    }
}

/// How far the demo is.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Progress {
    pub(crate) time_s: f64,
    pub(crate) seconds: f64,
}

impl Progress {
    /// Before the world starts it is 0.
    pub(crate) fn at(now_ns: i64, start_ns: Option<i64>, seconds: f64) -> Self {
        let time_s = start_ns.map_or(0.0, |start_ns| world_time_s(now_ns, start_ns));
        Self {
            time_s: time_s.clamp(0.0, seconds),
            seconds,
        }
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 30.
    fn bar(self) -> String {
        let done = (self.time_s / self.seconds * 30.0) as usize;
        format!("{}{}", "█".repeat(done), "░".repeat(30 - done.min(30)))
    }
}

/// Two lines of 80 columns.
fn headings() -> [String; 2] {
    [
        format!(
            "{:>30} {:>17} {:>11} {:>13} {:>5}",
            "pose [m, m]", "place [m]", "head. [rad]", "inputs", "[µs]"
        ),
        format!(
            "{:<7} {:>8} {:>6} {:>6} {:>5} {:>5} {:>5} {:>5} {:>5} {:>7} {:>5} {:>5}",
            "robot",
            "process",
            "x",
            "y",
            "error",
            "3σ",
            "alone",
            "error",
            "3σ",
            "accept",
            "rej.",
            "max"
        ),
    ]
}

/// What the table sets beside the pose.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// What the wheels alone would make of it.
    Wheels,
    /// Whether the robot knows where it is.
    States,
}

fn headings_of_states() -> [String; 2] {
    [
        format!(
            "{:>42} {:>12} {:>11} {:>7} {:>4}",
            "pose [m, m]", "place [m]", "head. [rad]", "inputs", "[µs]"
        ),
        format!(
            "{:<7} {:>7} {:>12} {:>6} {:>6} {:>5} {:>6} {:>5} {:>5} {:>7} {:>4}",
            "robot", "process", "state", "x", "y", "error", "3σ", "error", "3σ", "accept", "max"
        ),
    ]
}

/// Lines of the table that are not robots: the progress, the headings, what is left out, what is down; and the cursor's.
const OTHER_LINES: usize = 6;

/// The whole table, redrawn as often as one likes: on a terminal of so many `rows`, as it cannot scroll. It has the same number
/// of lines each time.
pub(crate) fn lines(
    progress: Progress,
    records: &[Record],
    states: &[State],
    shown: Shown,
    rows: Option<usize>,
) -> Vec<String> {
    let mut lines = vec![format!(
        "{} {:5.1} of {:.1} s",
        progress.bar(),
        progress.time_s,
        progress.seconds
    )];
    lines.extend(match shown {
        Shown::Wheels => headings(),
        Shown::States => headings_of_states(),
    });
    let room = rows.map_or(usize::MAX, |rows| rows.saturating_sub(OTHER_LINES));
    let robots = records.iter().zip(states).enumerate().take(room);
    lines.extend(robots.map(|(robot, (record, state))| match shown {
        Shown::Wheels => row(robot, record, state),
        Shown::States => row_of_states(robot, record, state),
    }));
    lines.extend(left_out(states, room));
    let hint = Some(restart_hint(states)).filter(|hint| !hint.is_empty());
    lines.push(hint.unwrap_or_else(|| dissents(records)));
    lines
}

/// Who has no place on the terminal.
fn left_out(states: &[State], room: usize) -> Option<String> {
    let hidden = states.get(room..).filter(|hidden| !hidden.is_empty())?;
    let up = hidden
        .iter()
        .filter(|state| matches!(state, State::Up(_)))
        .count();
    let count = hidden.len();
    Some(format!(
        "and {count} more, {up} of them up: this terminal has no room for them"
    ))
}

fn row(robot: usize, record: &Record, state: &State) -> String {
    let start = format!("{:<7} {:>8}", name(robot + 1), state.cell());
    let Some((estimate, _)) = &record.latest else {
        return start;
    };
    let [x, y, _] = estimate.pose;
    let error = |of: fn(&Moment) -> Comparison| {
        let latest = record.moments.last();
        latest.map_or([f64::NAN; 3], |moment| of(moment).error())
    };
    let (own, of_wheels) = (error(|moment| moment.comparison), error(Moment::of_wheels));
    let [sigma_x, sigma_y, sigma_phi] = sigma(estimate);
    let [accepted, rejected] = record.totals();
    let latency_us = record.latency().map_or(f64::NAN, |latency| latency.max);
    format!(
        "{start} {x:>6.2} {y:>6.2} {:>5.3} {:>5.3} {:>5.3} {:>5.3} {:>5.3} {accepted:>7} {rejected:>5} {latency_us:>5.0}",
        own[0].hypot(own[1]),
        3.0 * sigma_x.hypot(sigma_y),
        of_wheels[0].hypot(of_wheels[1]),
        own[2].abs(),
        3.0 * sigma_phi,
    )
}

fn row_of_states(robot: usize, record: &Record, state: &State) -> String {
    let start = format!("{:<7} {:>7}", name(robot + 1), state.cell());
    let Some((estimate, _)) = &record.latest else {
        return start;
    };
    let [x, y, _] = estimate.pose;
    let latest = record.latest_comparison();
    let error = latest.map_or([f64::NAN; 3], |it| it.error());
    let [sigma_x, sigma_y, sigma_phi] = sigma(estimate);
    let latency_us = record.latency().map_or(f64::NAN, |latency| latency.max);
    let cells = [
        fitted(x, 6, 2),
        fitted(y, 6, 2),
        fitted(error[0].hypot(error[1]), 5, 3),
        fitted(3.0 * sigma_x.hypot(sigma_y), 6, 3),
        fitted(error[2].abs(), 5, 3),
        fitted(3.0 * sigma_phi, 5, 3),
        format!("{:>7}", record.totals()[0]),
        fitted(latency_us, 4, 0),
    ];
    format!(
        "{start} {:>12} {}",
        estimate.state().name(),
        cells.join(" ")
    )
}

/// Who stands against what a robot believes.
fn dissents(records: &[Record]) -> String {
    let of = |(robot, record): (usize, &Record)| {
        let who: Vec<_> = record
            .now_against()
            .map(|(input, source)| format!("{input} {source}"))
            .collect();
        (!who.is_empty()).then(|| format!("{}: {}", name(robot + 1), who.join(", ")))
    };
    let all: Vec<_> = records.iter().enumerate().filter_map(of).collect();
    if all.is_empty() {
        String::new()
    } else {
        format!("against the belief of {}", all.join("; "))
    }
}

/// Who does not know where it is, for logs.
fn not_ok(records: &[Record]) -> String {
    let of = |(robot, record): (usize, &Record)| {
        let state = record.latest.as_ref()?.0.state();
        (state != BeliefState::Ok).then(|| format!("; {} {state}", name(robot + 1)))
    };
    records.iter().enumerate().filter_map(of).collect()
}

/// A line in any case, so that the table's height does not change.
fn restart_hint(states: &[State]) -> String {
    let down = states
        .iter()
        .enumerate()
        .find_map(|(robot, state)| match state {
            State::Down(command) => Some(format!(
                "{} is down; start it again from another terminal: {command}",
                name(robot + 1)
            )),
            _ => None,
        });
    down.unwrap_or_default()
}

/// One line for logs: how far, who is up, how bad.
pub(crate) fn line(progress: Progress, records: &[Record], states: &[State]) -> String {
    let up = states
        .iter()
        .filter(|state| matches!(state, State::Up(_)))
        .count();
    let errors = records
        .iter()
        .filter_map(Record::latest_comparison)
        .map(|comparison| comparison.error());
    let worst = errors.fold([0.0_f64; 3], |worst, error| {
        std::array::from_fn(|i| worst[i].max(error[i].abs()))
    });
    let hint = restart_hint(states);
    let hint = if hint.is_empty() {
        hint
    } else {
        format!("; {hint}")
    };
    format!(
        "{:5.1} of {:.1} s: {up} of {} up, worst error {:.3} m, {:.3} m, {:.3} rad{}{hint}",
        progress.time_s,
        progress.seconds,
        states.len(),
        worst[0],
        worst[1],
        worst[2],
        not_ok(records),
    )
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use coloc_shm_types::{Estimate, Timing};

    use super::*;

    fn heard() -> Record {
        let mut record = Record::new();
        record.hear_estimate(
            &Estimate {
                pose: [1.0, -2.0, 3.0],
                ..Estimate::default()
            },
            None,
        );
        let timing = Timing {
            collect_ns: 42_000,
            ..Timing::default()
        };
        record.hear_timing(&timing, 20_000_000);
        record
    }

    #[test]
    fn the_table_keeps_its_height_and_columns_whatever_happens() {
        for shown in [Shown::Wheels, Shown::States] {
            assert_steady(shown);
        }
    }

    fn assert_steady(shown: Shown) {
        let records = [heard(), Record::new()];
        let up = [State::Up(1234), State::Starting(1235)];
        let down = [State::Down("coloc colocd run a.toml".into()), State::Up(99)];
        let progress = Progress {
            time_s: 3.0,
            seconds: 6.0,
        };
        let (before, after) = (
            lines(progress, &records, &up, shown, None),
            lines(progress, &records, &down, shown, None),
        );
        assert_eq!(before.len(), after.len());
        assert!(after.last().unwrap().contains("coloc colocd run a.toml"));
        let widths = before[..4].iter().map(|line| line.chars().count());
        assert!(widths.max() <= Some(80), "{before:#?}");
    }

    #[test]
    fn a_table_is_no_higher_than_the_terminal_and_says_who_is_left_out() {
        let records: Vec<Record> = (0..32).map(|_| heard()).collect();
        let mut states = vec![State::Up(1); 32];
        states[31] = State::Down("coloc colocd run robot32.toml".into());
        let progress = Progress {
            time_s: 3.0,
            seconds: 6.0,
        };
        let shown = |rows| lines(progress, &records, &states, Shown::Wheels, rows);
        let text = shown(Some(24)).join("\n");
        assert!(text.lines().count() < 24, "{text}");
        assert!(text.contains("and 14 more, 13 of them up") && text.contains("robot32 is down"));
        assert!(!shown(Some(60)).join("\n").contains("more"));
        assert!(shown(Some(2)).len() < OTHER_LINES);
    }

    #[test]
    fn a_daemon_is_up_while_it_speaks() {
        let mut record = heard();
        assert_eq!(State::of(&record, Some(7), "again"), State::Up(7));
        assert_eq!(
            State::of(&record, None, "again"),
            State::Down("again".into())
        );
        assert_eq!(
            State::of(&Record::new(), Some(7), "again"),
            State::Starting(7)
        );
        let long_ago = Instant::now()
            .checked_sub(2 * SILENCE)
            .expect("the machine is up for a second");
        record.latest = record.latest.map(|(estimate, _)| (estimate, long_ago));
        assert_eq!(State::of(&record, Some(7), "again"), State::Silent(7));
    }

    #[test]
    fn progress_never_leaves_its_bar() {
        for now_s in [-5, 0, 3, 99] {
            let progress = Progress::at(now_s * 1_000_000_000, Some(0), 6.0);
            assert_eq!(progress.bar().chars().count(), 30);
        }
    }
}
