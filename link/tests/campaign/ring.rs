//! A large team: nobody is connected to everybody, and a newer roster reaches all.
use std::collections::BTreeSet;
use std::time::Instant;

use crate::Extent;
use crate::support::{PATIENCE, roster};
use crate::talk::Talk;
use crate::team::{Robot, members, team};

/// Above it a team is large.
const SMALL: u16 = 16;
/// Who is killed.
const KILLED: usize = 9;
/// Its place in the figures of a link's status.
const CONNECTED: usize = 1;

/// Links in a ring, each with two neighbours; a newer roster, once with one of them dead.
pub(crate) fn ring(extent: Extent) {
    let count = extent.of(SMALL + 1, 24);
    let home = tempfile::tempdir().unwrap();
    let mut robots = team(home.path(), count);
    robots.iter_mut().for_each(Robot::start_link);
    let is_next = |from: u16, to: u16| [1, count - 1].contains(&((count + to - from) % count));
    let mut talk = Talk::new(&robots, is_next, extent.of(2.0, 10.0));
    talk.until_all_are_heard();
    talk.go_on(extent.of(0.5, 15.0));
    told_to_one(&robots, &mut talk, 2, None);
    robots[KILLED].link.as_mut().unwrap().kill();
    told_to_one(&robots, &mut talk, 3, Some(KILLED));
    let pairs: BTreeSet<_> = talk.heard.keys().copied().collect();
    assert!(
        pairs.iter().all(|(from, to)| is_next(*from, *to)),
        "who is no neighbour was told something"
    );
    let connected = robots.iter().enumerate();
    let connected = connected.filter(|(place, _)| *place != KILLED);
    let connected: Vec<f64> = connected.map(|(_, it)| it.figures()[CONNECTED]).collect();
    let mean = connected.iter().sum::<f64>() / f64::from(count - 1);
    let [least, most] =
        [f64::min, f64::max].map(|of| connected.iter().copied().reduce(of).unwrap());
    println!(
        "ring: {count} links, two neighbours each, one dead: {mean:.1} connections each, {least} to {most}; {} pairs heard one another, {} of them neighbours",
        pairs.len(),
        2 * count
    );
    println!("ring: of the first: {}", robots[0].last_words());
}

/// A newer roster is given to the first; until all others that run have it.
fn told_to_one(robots: &[Robot], talk: &mut Talk, version: u32, dead: Option<usize>) {
    let text = roster(version, members(robots));
    robots[0].goes_by(&text);
    let begin = Instant::now();
    let has = |robot: &Robot| {
        let file = robot.directory.join("fleet.toml");
        std::fs::read_to_string(file).is_ok_and(|it| it == text)
    };
    let mut missing: Vec<usize> = (0..robots.len()).filter(|it| Some(*it) != dead).collect();
    loop {
        talk.turn();
        missing.retain(|place| !has(&robots[*place]));
        if missing.is_empty() {
            break;
        }
        assert!(
            begin.elapsed() < PATIENCE,
            "roster {version} never reaches {missing:?}"
        );
    }
    println!(
        "ring: roster {version}, given to one of {}, {}: all have it after {:.2} s",
        robots.len(),
        dead.map_or("all alive", |_| "one dead"),
        begin.elapsed().as_secs_f64()
    );
}
