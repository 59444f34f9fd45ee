//! The whole program: encoder frames in, estimates out, and how it ends.

mod support;

use coloc_estimator::{Covariance2, Covariance3};
use coloc_shm_types::{Header, Health, Input, Position, Reject, Status, Timing};
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use support::{Daemon, Site};

const STRAIGHT_MPS: f64 = 0.5;
const PRECISE: &str = "[initial]\nsigma = [0.1, 0.1, 0.001]\n";

#[test]
fn frames_become_a_pose() {
    let site = Site::new("robot1", PRECISE);
    let mut daemon = site.start();
    let mut drive = site.drive();
    let (listener, timings) = (site.listen(), site.listen_to::<Timing>());
    drive.straight(100, STRAIGHT_MPS);
    drive.stand();
    let way_m = drive.way_m();
    let estimate = listener.until("the way driven", |estimate| {
        (estimate.pose[0] - way_m).abs() < 1e-3
    });
    assert!(
        estimate.pose[1].abs() < 1e-6 && estimate.pose[2].abs() < 1e-6,
        "{estimate:?}"
    );
    assert_eq!(estimate.header.source, 1);
    let timing = timings.until("its tick's time", |it| it.tick == estimate.tick);
    assert_eq!(timing.header.stamp_ns, estimate.header.stamp_ns);
    assert!((1..=timing.header.stamp_ns).contains(&timing.frame_stamp_ns));
    assert!(Covariance3::from_row_major(estimate.total()).is_ok());
    drop((listener, timings));
    daemon.terminate();
    site.assert_nothing_left();
}

#[test]
fn the_encoder_trigger_ticks_once_a_sample() {
    let site = Site::new(
        "robot1",
        &format!("{PRECISE}[tick]\ntrigger = \"encoder\"\nrate_hz = 10\n"),
    );
    let mut daemon = site.start();
    let mut drive = site.drive();
    let listener = site.listen();
    drive.straight(100, STRAIGHT_MPS);
    drive.stand();
    let way_m = drive.way_m();
    // At 10 Hz the timer alone would give a fifth of these ticks.
    let estimate = listener.until("the way driven", |estimate| {
        (estimate.pose[0] - way_m).abs() < 1e-3
    });
    assert!(
        (60..=160).contains(&estimate.tick),
        "{} ticks for 100 pairs of frames",
        estimate.tick
    );
    drop(listener);
    daemon.terminate();
    site.assert_nothing_left();
}

#[test]
fn health_follows_the_wheels() {
    let site = Site::new("robot1", PRECISE);
    let mut daemon = site.start();
    let (listener, timings) = (site.listen(), site.listen_to::<Timing>());
    listener.until("a first estimate", |estimate| {
        estimate.health_of(Input::Odometry) == Health::NeverSeen
    });
    site.drive().straight(10, STRAIGHT_MPS);
    listener.until("odometry", |estimate| {
        estimate.health_of(Input::Odometry) == Health::Ok
    });
    let stale = listener.until("silence", |estimate| {
        estimate.health_of(Input::Odometry) == Health::Stale
    });
    // Not a tick later than the threshold allows: 0.1 s of silence, a period of 20 ms, and no missed deadline between.
    let timing = timings.until("its tick's time", |it| it.tick == stale.tick);
    let silent_ns = timing.header.stamp_ns - timing.frame_stamp_ns;
    assert!(silent_ns > 100_000_000, "{silent_ns}");
    daemon.terminate();
}

#[test]
fn fixes_are_fused_and_bad_ones_counted() {
    let site = Site::new("robot1", "[initial]\nsigma = [1.0, 1.0, 0.001]\n");
    let mut daemon = site.start();
    let listener = site.listen();
    let fixes = site.space().publisher::<Position>(&site.robot()).unwrap();
    let first = listener.until("a first estimate", |_| true);
    let covariance = Covariance2::diagonal([0.01, 0.01]).unwrap().to_row_major();
    let mut fix = Position {
        quality: 4,
        position: [0.5, -0.5],
        covariance,
        ..Position::default()
    };
    fix.header = Header {
        source: 0,
        sequence: 0,
        ..first.header
    };
    fixes.send(fix).unwrap();
    listener.until("the fix", |estimate| {
        (estimate.pose[0] - 0.5).abs() < 0.05 && (estimate.pose[1] + 0.5).abs() < 0.05
    });
    fixes.send(fix).unwrap();
    fix.header.sequence = 1;
    fix.position = [f64::NAN, 0.0];
    fixes.send(fix).unwrap();
    let status = site.status_until("two rejects", |status| {
        status.rejected_total(Input::Position) == 2
    });
    let count = |status: &Status, reason| status.rejected_of(Input::Position, reason);
    assert_eq!(
        (
            count(&status, Reject::Replayed),
            count(&status, Reject::NotFinite)
        ),
        (1, 1)
    );
    assert_eq!(status.accepted_of(Input::Position), 1);
    drop((listener, fixes));
    daemon.terminate();
    site.assert_nothing_left();
}

/// Who is refused used to be said without saying who, and by how much.
#[test]
fn the_line_of_a_refused_fix_names_its_receiver_and_how_far_it_is_off() {
    let site = Site::new("robot1", PRECISE);
    let mut daemon = Daemon::spawn(site.run_command().stderr(Stdio::piped()));
    let listener = site.listen();
    let fixes = site.space().publisher::<Position>(&site.robot()).unwrap();
    let first = listener.until("a first estimate", |_| true);
    let header = Header {
        source: 3,
        sequence: 0,
        ..first.header
    };
    fixes
        .send(Position {
            header,
            quality: 4,
            position: [100.0, 0.0],
            covariance: [0.01, 0.0, 0.0, 0.01],
            ..Position::default()
        })
        .unwrap();
    let lines = BufReader::new(daemon.standard_error()).lines();
    let line = lines
        .map(Result::unwrap)
        .find(|line| line.contains("position rejected"));
    let line = line.expect("a line about it");
    let number = |name: &str| {
        let (_, rest) = line.split_once(&format!(" {name}="))?;
        rest.split_whitespace().next()?.parse::<f64>().ok()
    };
    assert_eq!(number("source"), Some(3.0), "{line}");
    let (d2, gate) = number("d2").zip(number("gate")).expect(&line);
    assert!(gate > 1.0 && d2 > 10_000.0 && d2 < 1_010_000.0, "{line}");
    daemon.terminate();
}

#[test]
fn no_two_robots_have_the_same_number() {
    let site = Site::new("robot1", PRECISE);
    let mut first = site.start();
    site.listen().until("the first", |_| true);
    let config = site
        .config()
        .replace("name = \"robot1\"", "name = \"robot2\"");
    std::fs::write(site.config_path(), config).unwrap();
    let (code, said) = site.try_run();
    assert_eq!(code, Some(5), "{said}");
    let first_pid = first.pid().to_string();
    for part in [
        "robot `robot2` has the number 1",
        "`robot1`",
        &first_pid,
        "give this robot another number",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    first.terminate();
}

#[test]
fn the_same_robot_is_not_run_twice() {
    let site = Site::new("robot1", PRECISE);
    let mut first = site.start();
    site.listen().until("the first", |_| true);
    let (code, said) = site.try_run();
    assert_eq!(code, Some(5));
    assert!(
        said.contains("robot1") && said.contains(&first.pid().to_string()),
        "{said}"
    );
    first.terminate();
}

#[test]
fn an_interrupt_ends_it_as_well() {
    let site = Site::new("robot1", PRECISE);
    let mut daemon = site.start();
    site.listen().until("a first estimate", |_| true);
    daemon.interrupt();
    site.assert_nothing_left();
}

#[test]
fn after_a_kill_it_goes_on_from_where_it_was() {
    let site = Site::new(
        "robot1",
        "[initial]\nsigma = [0.1, 0.1, 0.001]\nresume = true\n[telemetry]\nstate_hz = 50\n",
    );
    let mut daemon = site.start();
    let mut drive = site.drive();
    drive.straight(50, STRAIGHT_MPS);
    drive.stand();
    let way_m = drive.way_m();
    let before = site.listen().until("the way driven", |estimate| {
        (estimate.pose[0] - way_m).abs() < 1e-3
    });
    site.saved_until("the saved belief", |saved| {
        (saved.pose[0] - way_m).abs() < 1e-3
    });
    daemon.kill();
    let mut again = site.start();
    let after = site.listen().until("the next session", |estimate| {
        estimate.header.session != before.header.session
    });
    assert!(
        (after.pose[0] - way_m).abs() < 1e-3,
        "{} instead of {way_m}",
        after.pose[0]
    );
    assert!(after.total()[0] > before.total()[0], "grown by the gap");
    again.terminate();
    site.assert_nothing_left();
}

#[test]
fn a_wrong_configuration_opens_nothing() {
    let site = Site::new("robot1", "[tick]\nrate_hz = 0\n");
    let (code, said) = site.try_run();
    assert_eq!(code, Some(2));
    let line = 1 + site
        .config()
        .lines()
        .position(|line| line == "rate_hz = 0")
        .unwrap();
    assert!(
        said.contains(&format!(
            "robot.toml:{line}: tick.rate_hz = 0: must be a number, 1 to 1000 Hz"
        )),
        "{said}"
    );
    site.assert_nothing_left();
    assert!(!site.root().exists());
}

#[test]
fn a_refused_request_ends_it_only_where_it_is_required() {
    let realtime = "[realtime]\nscheduler = \"other\"\nlock_memory = false\ncpus = [1023]\n";
    let site = Site::new("robot1", &format!("{realtime}required = true\n"));
    let (code, said) = site.try_run();
    assert_eq!(code, Some(1));
    assert!(
        said.contains("realtime.cpus = [1023]") && said.contains("taskset"),
        "{said}"
    );
    site.assert_nothing_left();
    let site = Site::new("robot1", realtime);
    let mut daemon = site.start();
    site.listen().until("a first estimate", |_| true);
    daemon.terminate();
}
