//! `coloc list`.

use coloc_shm_types::{Channel, Estimate, Message, Unfit};

use crate::program::{Coloc, Ended};
use crate::robot::{Daemon, Ground, Robot, name};

fn list(ground: &Ground, something: impl FnMut()) -> Ended {
    Coloc::start("list", &ground.root()).end(something)
}

#[test]
fn nobody_is_an_answer_that_says_where_it_looked_and_leaves_no_trace() {
    let ground = Ground::new();
    let ended = list(&ground, || {});
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(0), 0),
        "{ended:?}"
    );
    let [said] = ended.said.as_slice() else {
        panic!("{ended:?}");
    };
    let root = ground.root().display().to_string();
    assert!(
        said.contains(&root) && said.contains("colocd run"),
        "{said}"
    );
    assert!(!ground.root().exists());
}

#[test]
fn who_runs_is_listed_with_what_it_believes_and_nothing_stays_behind() {
    let ground = Ground::new();
    let mut robots = [("left", 2), ("right", 7)].map(|(name, id)| Robot::start(&ground, name, id));
    let before = ground.trace();
    let ended = list(&ground, || robots.iter_mut().for_each(Robot::say));
    assert_eq!(ended.status, Some(0), "{ended:?}");
    assert_eq!(ended.printed.len(), 3, "{ended:?}");
    for (line, (name, id)) in ended.printed[1..]
        .iter()
        .zip([("left", "2"), ("right", "7")])
    {
        let words: Vec<&str> = line.split_whitespace().collect();
        let pid = std::process::id().to_string();
        assert_eq!(words[..3], [name, id, &pid], "{line}");
        assert_eq!(words[5..7], ["ok", "ok"], "{line}");
        assert_eq!(words[8..], ["-1.250", "90.0"], "{line}");
    }
    assert!(ended.said.is_empty(), "{ended:?}");
    // Who speaks notices then that a listener has gone.
    robots.iter_mut().for_each(Robot::say);
    assert_eq!(ground.trace(), before);
}

#[test]
fn why_one_is_not_fit_to_drive_on_stands_below_the_list() {
    let ground = Ground::new();
    let mut robots = [("fit", 1), ("unfit", 2)].map(|(name, id)| Robot::start(&ground, name, id));
    robots[1].unfit = Some((Unfit::Position, 0.25));
    let ended = list(&ground, || robots.iter_mut().for_each(Robot::say));
    assert_eq!(ended.status, Some(0), "{ended:?}");
    let [_, fit, unfit, why] = ended.printed.as_slice() else {
        panic!("{ended:?}");
    };
    let belief = |line: &str| line.split_whitespace().nth(5).map(str::to_owned);
    assert_eq!(belief(fit).as_deref(), Some("ok"));
    assert_eq!(belief(unfit).as_deref(), Some("unfit"));
    let expected = "unfit is not fit to drive on: position 0.30 m > 0.25 m";
    assert_eq!(why, expected);
}

/// One has no channel yet, the other says nothing on its own.
#[test]
fn who_says_nothing_runs_all_the_same_and_no_channel_is_made_for_it() {
    let ground = Ground::new();
    let space = ground.space();
    let _claim = space.claim_robot(&name("a"), 1).unwrap();
    let _robot = Robot::start(&ground, "b", 2);
    let before = ground.trace();
    let ended = list(&ground, || {});
    assert_eq!(ended.status, Some(0), "{ended:?}");
    let words: Vec<_> = ended.printed[1..]
        .iter()
        .map(|line| line.split_whitespace().nth(5).unwrap())
        .collect();
    assert_eq!(words, ["starting", "silent"], "{ended:?}");
    assert_eq!(ground.trace(), before);
}

#[test]
fn where_no_listener_has_a_place_it_is_said_and_listed() {
    let ground = Ground::new();
    let space = ground.space();
    let _robot = Robot::start(&ground, "full", 1);
    let listen = |_| space.subscriber::<Estimate>(&name("full")).unwrap();
    let places = Channel::quality(Estimate::CHANNEL).subscribers;
    let _listeners: Vec<_> = (0..places).map(listen).collect();
    let ended = list(&ground, || {});
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(ended.printed[1].starts_with("full "), "{ended:?}");
    assert!(
        ended.said[0].contains("no place for another subscriber"),
        "{ended:?}"
    );
}

#[test]
fn a_daemon_is_listed_until_it_is_killed() {
    let ground = Ground::new();
    let mut daemon = Daemon::start(&ground, "real", 3);
    let listed = list(&ground, || {});
    daemon.kill();
    let process = daemon.id().to_string();
    let words: Vec<&str> = listed.printed[1].split_whitespace().take(3).collect();
    assert_eq!(words, ["real", "3", &process], "{listed:?}");
    assert!(
        ground.root().join("claims/real").exists(),
        "it could not clean up"
    );
    let ended = list(&ground, || {});
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(0), 0),
        "{ended:?}"
    );
    assert!(ended.said[0].contains("no robot runs in "), "{ended:?}");
}

#[test]
fn a_place_that_cannot_be_is_a_sentence() {
    let ground = Ground::new();
    let file = ground.file("file");
    std::fs::write(&file, "").unwrap();
    let long = format!("/{}", "x".repeat(200)).into();
    for (root, why) in [(&file, "is not a directory"), (&long, "at most 100 bytes")] {
        for command in ["list", "listen r1"] {
            let ended = Coloc::start(command, root).end(|| {});
            assert_eq!(
                (ended.status, ended.printed.len()),
                (Some(1), 0),
                "{ended:?}"
            );
            let is_sentence = ended.said.len() == 1 && ended.said[0].starts_with("coloc: ");
            assert!(is_sentence && ended.said[0].contains(why), "{ended:?}");
        }
    }
}
