//! A line of the list. With names of up to ten letters it has 80 columns.

use std::time::{Duration, SystemTime};

use coloc_shm_types::{Estimate, Input, Running};

use super::hear::Word;
use crate::fitted::fitted;
use crate::listen::belief;

const NONE: &str = "–";

/// Of the column with the names.
pub(super) fn name_width(robots: &[Running]) -> usize {
    let longest = robots.iter().map(|one| one.robot.as_str().len()).max();
    longest.unwrap_or(0).max("robot".len())
}

pub(super) fn heading(width: usize) -> String {
    line(
        ["robot", "id", "process", "up", "belief", "odometry"],
        &["x [m]", "y [m]", "φ [°]"].map(String::from),
        width,
    )
}

pub(super) fn row(robot: &Running, word: &Word, width: usize) -> String {
    let (id, process) = match robot.who {
        Some((id, process)) => (id.to_string(), process.to_string()),
        None => (NONE.into(), NONE.into()),
    };
    let up = robot.since.and_then(age).map_or(NONE.into(), rough);
    let (belief, odometry, pose) = heard(word);
    let words = [robot.robot.as_str(), &id, &process, &up, belief, odometry];
    line(words, &pose, width)
}

fn line(words: [&str; 6], pose: &[String; 3], width: usize) -> String {
    let [robot, id, process, up, belief, odometry] = words;
    let [x, y, heading] = pose;
    format!(
        "{robot:<width$} {id:>5} {process:>7} {up:>7}  {belief:<12} {odometry:<10} {x:>7} {y:>7} {heading:>6}"
    )
}

fn heard(word: &Word) -> (&'static str, &'static str, [String; 3]) {
    let none = || [NONE; 3].map(String::from);
    match word {
        Word::Estimate(estimate) => (
            belief(estimate),
            estimate.health_of(Input::Odometry).name(),
            pose(estimate),
        ),
        Word::Starting => ("starting", NONE, none()),
        Word::Silent => ("silent", NONE, none()),
        Word::Refused(_) => (NONE, NONE, none()),
    }
}

fn pose(estimate: &Estimate) -> [String; 3] {
    let [x, y, heading] = estimate.pose;
    [
        fitted(x, 7, 3),
        fitted(y, 7, 3),
        fitted(heading.to_degrees(), 6, 1),
    ]
}

fn age(since: SystemTime) -> Option<Duration> {
    since.elapsed().ok()
}

/// In the largest unit of which there are two.
fn rough(age: Duration) -> String {
    let seconds = age.as_secs();
    let units = [(86_400, "d"), (3_600, "h"), (60, "min"), (1, "s")];
    let (length, unit) = units
        .into_iter()
        .find(|(length, _)| seconds >= 2 * length)
        .unwrap_or((1, "s"));
    format!("{} {unit}", seconds / length)
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::RobotName;

    use super::*;

    fn running(name: &str) -> Running {
        Running {
            robot: RobotName::new(name).unwrap(),
            who: Some((65535, 4_194_304)),
            since: Some(SystemTime::now()),
        }
    }

    #[test]
    fn the_longest_words_fit_into_80_columns() {
        let estimate = Estimate {
            pose: [-1.0e9, 123.456, -3.13],
            state: 2,
            ..Estimate::default()
        };
        let robots = [running("robot12345")];
        let width = name_width(&robots);
        let row = row(&robots[0], &Word::Estimate(estimate.into()), width);
        assert_eq!(row.chars().count(), 80, "{row}");
        assert_eq!(heading(width).chars().count(), 80);
        assert!(
            row.ends_with("contradicted never_seen    -1e9 123.456 -179.3"),
            "{row}"
        );
    }

    #[test]
    fn who_is_not_heard_is_listed_all_the_same() {
        let robot = Running {
            who: None,
            since: None,
            ..running("r")
        };
        let row = row(&robot, &Word::Silent, 5);
        let words: Vec<&str> = row.split_whitespace().collect();
        assert_eq!(words, ["r", "–", "–", "–", "silent", "–", "–", "–", "–"]);
    }

    #[test]
    fn ages_are_said_roughly() {
        let said = [0, 119, 120, 7_199, 7_200, 172_800].map(|s| rough(Duration::from_secs(s)));
        assert_eq!(said, ["0 s", "119 s", "2 min", "119 min", "2 h", "2 d"]);
    }
}
