//! Robots that come and go.

use crate::program::Coloc;
use crate::robot::{Ground, Robot};

/// Lines that were printed so far and begin so.
fn sessions(printed: &[String]) -> Vec<&str> {
    let mut all: Vec<&str> = printed
        .iter()
        .skip(1)
        .filter_map(|line| line.split(',').next())
        .collect();
    all.dedup();
    all
}

#[test]
fn a_robot_that_comes_goes_and_comes_back_is_followed() {
    let ground = Ground::new();
    let mut coloc = Coloc::start("listen r1 --csv", &ground.root());
    coloc.wait_until_it_says("r1 does not run here, waiting for it in ", || {});
    assert!(!ground.root().exists(), "who waits makes nothing");
    let mut robot = Robot::start(&ground, "r1", 1);
    coloc.wait(|| robot.say(), |printed, _| printed.len() > 3);
    coloc.wait_until_it_says("coloc: r1 speaks", || robot.say());
    drop(robot);
    coloc.wait_until_it_says("coloc: r1 does not run any more", || {});
    let is_empty = || std::fs::read_dir(ground.root()).unwrap().count() == 0;
    coloc.wait(|| {}, |_, _| is_empty());
    let mut robot = Robot::start(&ground, "r1", 1);
    coloc.wait_until_it_says("coloc: r1 speaks again, started anew, after ", || {
        robot.say();
    });
    coloc.wait(|| robot.say(), |printed, _| sessions(printed).len() == 2);
    coloc.signal("INT");
    let ended = coloc.end(|| {});
    assert_eq!(ended.status, Some(130), "{ended:?}");
    assert_eq!(sessions(&ended.printed).len(), 2, "{ended:?}");
}

#[test]
fn a_daemon_that_stops_to_speak_is_told_from_one_that_is_gone() {
    let ground = Ground::new();
    let mut robot = Robot::start(&ground, "r1", 1);
    let mut coloc = Coloc::start("listen r1 --tum", &ground.root());
    coloc.wait(|| robot.say(), |printed, _| !printed.is_empty());
    let own = format!("r1 is silent, though process {} acts", std::process::id());
    coloc.wait_until_it_says(&own, || {});
    coloc.wait_until_it_says("coloc: r1 speaks again, after ", || robot.say());
    coloc.wait_until_it_says(&own, || {});
    drop(robot);
    coloc.wait_until_it_says("coloc: r1 does not run any more", || {});
    coloc.signal("TERM");
    assert_eq!(coloc.end(|| {}).status, Some(143));
}

#[test]
fn a_place_that_is_deleted_is_found_again() {
    let ground = Ground::new();
    let mut robot = Robot::start(&ground, "r1", 1);
    let mut coloc = Coloc::start("listen r1 --csv", &ground.root());
    coloc.wait(|| robot.say(), |printed, _| printed.len() > 1);
    std::fs::remove_dir_all(ground.root()).unwrap();
    coloc.wait_until_it_says("was deleted or exchanged: looking for r1 anew", || {});
    drop(robot);
    let mut robot = Robot::start(&ground, "r1", 1);
    coloc.wait(|| robot.say(), |printed, _| sessions(printed).len() == 2);
    coloc.signal("HUP");
    assert_eq!(coloc.end(|| {}).status, Some(129));
}

#[test]
fn of_a_name_that_nobody_has_it_is_said_who_runs() {
    let ground = Ground::new();
    let _robots = [("robot1", 1), ("robot2", 2)].map(|(name, id)| Robot::start(&ground, name, id));
    let mut coloc = Coloc::start("listen robto1", &ground.root());
    coloc.wait_until_it_says("; who runs: robot1, robot2", || {});
    coloc.signal("INT");
    let ended = coloc.end(|| {});
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(130), 0),
        "{ended:?}"
    );
}

#[test]
fn what_can_be_no_name_or_two_forms_is_not_understood() {
    let ground = Ground::new();
    for words in [
        "listen a/b",
        "listen r1 --json --csv",
        "listen r1 --every -1",
        "listen r1 --count 0",
        "listen",
    ] {
        let ended = Coloc::start(words, &ground.root()).end(|| {});
        assert_eq!(
            (ended.status, ended.printed.len()),
            (Some(2), 0),
            "{words}: {ended:?}"
        );
    }
}

/// As in the README's first page: the robots of a demo are in a place of their own.
#[test]
fn a_robot_is_found_where_it_runs_unless_that_is_in_several_places() {
    let name = format!("only-{}", std::process::id());
    let words = format!("listen {name} --json --count 2");
    let (one, other) = (Ground::new(), Ground::new());
    let mut robot = Robot::start(&one, &name, 1);
    let ended = Coloc::start_anywhere(&words).end(|| robot.say());
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(0), 2),
        "{ended:?}"
    );
    let said = format!("coloc: {name} runs in {}", one.root().display());
    assert_eq!(ended.said[0], said, "{ended:?}");
    let _second = Robot::start(&other, &name, 1);
    let ended = Coloc::start_anywhere(&words).end(|| {});
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(1), 0),
        "{ended:?}"
    );
    let names = |ground: &Ground| ended.said[0].contains(ground.root().to_str().unwrap());
    assert!(
        names(&one) && names(&other) && ended.said[0].contains("--root"),
        "{ended:?}"
    );
}
