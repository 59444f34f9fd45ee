//! The live table: every robot's pose, error, claim, inputs and latency on a line.

use std::time::Duration;

use super::clock::world_time_s;
use super::record::Record;
use super::robot_file::name;
use super::watch::sigma;
use crate::comparison::Comparison;

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

    fn cells(&self) -> (String, &'static str) {
        match self {
            Self::Starting(pid) => (pid.to_string(), "starting"),
            Self::Up(pid) => (pid.to_string(), "up"),
            Self::Silent(pid) => (pid.to_string(), "silent"),
            Self::Down(_) => ("-".into(), "DOWN"),
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

const HEADER: [&str; 2] = [
    "                          pose [m, m, rad]       error to the truth            claimed 3σ          inputs            tick [µs]",
    "robot        pid state         x      y      φ |      x      y      φ |      x      y      φ | accepted rejected |   now    max",
];

/// The whole table, redrawn as often as one likes. It has the same number of lines each time.
pub(crate) fn lines(progress: Progress, records: &[Record], states: &[State]) -> Vec<String> {
    let mut lines = vec![format!(
        "{} {:5.1} of {:.1} s",
        progress.bar(),
        progress.time_s,
        progress.seconds
    )];
    lines.extend(HEADER.map(str::to_owned));
    lines.extend(
        records
            .iter()
            .zip(states)
            .enumerate()
            .map(|(robot, (record, state))| row(robot, record, state)),
    );
    lines.push(restart_hint(states));
    lines
}

#[allow(clippy::cast_precision_loss)] // Nanoseconds of a tick.
fn row(robot: usize, record: &Record, state: &State) -> String {
    let (pid, word) = state.cells();
    let start = format!("{:<8} {pid:>7} {word:<8}", name(robot + 1));
    let Some((estimate, _)) = &record.latest else {
        return start;
    };
    let error = record
        .comparisons
        .last()
        .map_or([f64::NAN; 3], Comparison::error);
    let [accepted, rejected] = record.totals();
    format!(
        "{start} {} | {} | {} | {accepted:>8} {rejected:>8} | {:>5.0} {:>6.0}",
        triple(estimate.pose, 2),
        triple(error, 3),
        triple(sigma(estimate).map(|sigma| 3.0 * sigma), 3),
        estimate.latency_ns as f64 / 1e3,
        record.latency().max,
    )
}

fn triple([x, y, phi]: [f64; 3], digits: usize) -> String {
    format!("{x:>6.digits$} {y:>6.digits$} {phi:>6.digits$}")
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
        .filter_map(|record| record.comparisons.last())
        .map(Comparison::error);
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
        "{:5.1} of {:.1} s: {up} of {} up, worst error {:.3} m, {:.3} m, {:.3} rad{hint}",
        progress.time_s,
        progress.seconds,
        states.len(),
        worst[0],
        worst[1],
        worst[2],
    )
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use coloc_shm_types::Estimate;

    use super::*;

    fn heard() -> Record {
        let mut record = Record::new();
        record.hear_estimate(
            &Estimate {
                pose: [1.0, -2.0, 3.0],
                latency_ns: 42_000,
                ..Estimate::default()
            },
            None,
            20_000_000,
        );
        record
    }

    #[test]
    fn the_table_keeps_its_height_and_columns_whatever_happens() {
        let records = [heard(), Record::new()];
        let up = [State::Up(1234), State::Starting(1235)];
        let down = [State::Down("coloc colocd run a.toml".into()), State::Up(99)];
        let progress = Progress {
            time_s: 3.0,
            seconds: 6.0,
        };
        let (before, after) = (
            lines(progress, &records, &up),
            lines(progress, &records, &down),
        );
        assert_eq!(before.len(), after.len());
        assert!(after.last().unwrap().contains("coloc colocd run a.toml"));
        let bars = |line: &str| {
            line.char_indices()
                .filter(|(_, c)| *c == '|')
                .map(|(at, _)| line[..at].chars().count())
                .collect::<Vec<_>>()
        };
        assert_eq!(bars(HEADER[1]), bars(&before[3]));
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
