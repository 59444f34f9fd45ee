//! What a daemon said of its decisions, beside what was decided when its recording was played again.

use std::collections::BTreeMap;

use coloc_estimator::{Decision, Kind, Source};

use crate::replay::PlayedTick;

/// Every decision stands in the log, as often as it was taken, and no other does. (The log adds up lines of one kind.)
pub(crate) fn assert_said(played: &[PlayedTick], log: &str, robot: usize) {
    let mut decided = BTreeMap::new();
    for decision in played.iter().flat_map(|tick| &tick.decided) {
        *decided.entry(words(decision)).or_insert(0) += 1;
    }
    let mut said = BTreeMap::new();
    for line in log.lines() {
        if let Some(word) = word_in(line) {
            *said.entry(word).or_insert(0) += count_in(line);
        }
    }
    println!("robot {robot} decided {decided:?}");
    assert_eq!(said, decided, "robot {robot}:\n{log}");
}

/// How a line about it begins, or what it has in it.
fn words(decision: &Decision) -> String {
    let who = name(decision.source());
    match decision {
        Decision::Followed { distance_m, .. } if distance_m.is_nan() => {
            format!("has found itself by {who}")
        }
        Decision::Followed { distance_m, .. } => {
            format!("{who} is followed: the robot is {distance_m:.1} m")
        }
        Decision::Anew { .. } => format!("what {who} says does not move"),
        Decision::Dropped { .. }
        | Decision::Widened { .. }
        | Decision::SecondChance { .. }
        | Decision::Set { .. } => panic!("nobody stands, has a gap, or is told: {decision:?}"),
    }
}

/// Robots are numbered from 0 in the fleet, from 1 by daemons.
fn name(source: Source) -> String {
    match source.kind {
        Kind::Neighbour => format!("neighbour {}", source.number + 1),
        Kind::Fix => format!("position {}", source.number),
        other => panic!("{other:?} decides nothing"),
    }
}

fn word_in(line: &str) -> Option<String> {
    let from = |begin: usize, end: usize| Some(line.get(begin..end)?.to_owned());
    if let Some(at) = line.find("has found itself by ") {
        let rest = line[at..].split(' ').take(6);
        return Some(rest.collect::<Vec<_>>().join(" "));
    }
    if let Some(at) = line.find(" is followed: the robot is ") {
        let begin = line[..at].rfind(' ').and_then(|it| line[..it].rfind(' '))? + 1;
        let end = at + line[at..].find(" m ")? + 2;
        return from(begin, end);
    }
    let end = line.find(" says does not move")? + " says does not move".len();
    from(line.find("what ")?, end)
}

/// Of lines that were added up.
fn count_in(line: &str) -> usize {
    let count = line.split_once(" count=").map(|(_, rest)| rest);
    let number = count.and_then(|rest| rest.split(' ').next());
    number.map_or(1, |number| number.parse().unwrap())
}
