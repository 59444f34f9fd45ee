//! Telling a robot where it is: a real daemon, and one that does not do its part.

use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, Reject, Subscriber};

use crate::program::{Coloc, Ended};
use crate::robot::{Daemon, Ground, Robot, name};

fn tell(words: &str, ground: &Ground, something: impl FnMut()) -> Ended {
    Coloc::start(words, &ground.root()).end(something)
}

/// The first estimate that is as it should be.
fn until(estimates: &Subscriber<Estimate>, there: impl Fn(&Estimate) -> bool) -> Estimate {
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        if let Some(estimate) = estimates.receive().unwrap().filter(&there) {
            return estimate;
        }
        assert!(Instant::now() < deadline);
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn is_at(estimate: &Estimate, pose: [f64; 3]) -> bool {
    let apart = estimate.pose.iter().zip(pose).map(|(a, b)| (a - b).abs());
    apart.fold(0.0, f64::max) < 1e-3
}

#[test]
fn a_robot_is_where_it_was_told() {
    let ground = Ground::new();
    let _daemon = Daemon::start(&ground, "real", 3);
    let space = ground.space();
    let estimates = space.subscriber::<Estimate>(&name("real")).unwrap();
    let ended = tell(
        "pose real 12.5 -3 90 --sigma 0.1 0.2 5 --degrees",
        &ground,
        || {},
    );
    assert_eq!((ended.status, ended.said.len()), (Some(0), 0), "{ended:?}");
    let [sentence] = ended.printed.as_slice() else {
        panic!("{ended:?}");
    };
    let begins = "real is at 12.50 m, -3.00 m, 90.0°; it had ";
    assert!(sentence.starts_with(begins), "{sentence}");
    let there = [12.5, -3.0, std::f64::consts::FRAC_PI_2];
    let first = until(&estimates, |estimate| is_at(estimate, there));
    let total = first.total();
    assert!(total[0] >= 0.01 && total[4] >= 0.04, "{total:?}");
    // And again, from there.
    let ended = tell("pose real -1 2 -0.5", &ground, || {});
    assert_eq!(ended.status, Some(0), "{ended:?}");
    until(&estimates, |estimate| is_at(estimate, [-1.0, 2.0, -0.5]));
}

#[test]
fn what_a_robot_refuses_it_says_why() {
    let ground = Ground::new();
    let _daemon = Daemon::start(&ground, "real", 3);
    let ended = tell("pose real 1e20 0 0", &ground, || {});
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(1), 0),
        "{ended:?}"
    );
    let why = format!("coloc: real has refused the pose: {}", Reject::NotFinite);
    assert_eq!(ended.said, [why]);
}

#[test]
fn what_is_no_pose_is_not_sent() {
    let ground = Ground::new();
    for words in [
        "pose real NaN 0 0",
        "pose real 0 0",
        "pose real 0 0 0 --sigma 0 1 1",
        "pose real 0 0 0 --sigma 1 1",
        "pose a/b 0 0 0",
    ] {
        let ended = tell(words, &ground, || {});
        assert_eq!(
            (ended.status, ended.printed.len()),
            (Some(2), 0),
            "{words}: {ended:?}"
        );
    }
    assert!(!ground.root().exists());
}

#[test]
fn of_a_robot_that_does_not_run_it_is_said_who_does() {
    let ground = Ground::new();
    let _robot = Robot::start(&ground, "robot1", 1);
    let ended = tell("pose robto1 1 2 3", &ground, || {});
    assert_eq!(ended.status, Some(1), "{ended:?}");
    let [said] = ended.said.as_slice() else {
        panic!("{ended:?}");
    };
    assert!(
        said.starts_with("coloc: robto1 does not run in ") && said.ends_with("who runs: robot1"),
        "{said}"
    );
}

#[test]
fn a_daemon_that_says_nothing_is_not_waited_for_for_long() {
    let ground = Ground::new();
    let mut robot = Robot::start(&ground, "r1", 1);
    // It has no counters, so that nobody could see what it takes.
    let ended = tell("pose r1 1 2 3", &ground, || robot.say());
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(
        ended.said[0].contains("r1 runs and says nothing"),
        "{ended:?}"
    );
}
