//! No odometry: whatever the cause, a line of the log says what is heard, what was wanted, and what was refused and why.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod support;

use coloc_drivers::can::{BusSpec, Frame, Sender, StandardId};
use coloc_drivers::encoder::{LEFT_ID, RIGHT_ID, encoder_frame};
use support::{Daemon, Site, wait_for};

struct Silent {
    site: Site,
    daemon: Daemon,
}

impl Silent {
    fn start(site: Site) -> Self {
        let daemon = site.start();
        Self { site, daemon }
    }

    /// A robot on a local bus, on which somebody listens already.
    fn on_local_bus() -> (Self, Sender) {
        let robot = Self::start(site());
        robot.site.drive();
        let directory = robot.site.path("bus");
        let sender = Sender::open(&BusSpec::Local { directory }).unwrap();
        (robot, sender)
    }

    /// Does `act` again and again until a line says why there is no odometry, with all of `parts`.
    fn says(mut self, parts: &[&str], mut act: impl FnMut()) {
        let log = self.site.path("log");
        let says = |line: &&str| {
            line.contains("WARN no odometry for ") && parts.iter().all(|part| line.contains(part))
        };
        wait_for(&format!("a line with {parts:?}"), || {
            act();
            let text = std::fs::read_to_string(&log).unwrap_or_default();
            if text.lines().any(|line| says(&line)) {
                Ok(())
            } else {
                Err(text)
            }
        });
        self.daemon.terminate();
    }
}

fn site() -> Site {
    Site::new("robot1", "[telemetry]\nlog_file = \"{at}/log\"\n")
}

fn send_all(sender: &mut Sender, frames: &[Frame]) {
    for frame in frames {
        sender.send(frame).unwrap();
    }
}

const WANTED: &str = "wanted and not heard: 0x100 (WheelLeft), 0x101 (WheelRight)";

#[test]
fn a_silent_bus() {
    let (robot, _sender) = Silent::on_local_bus();
    robot.says(&["/bus is up and brings no frame, ", WANTED], || {});
}

#[test]
fn a_bus_on_which_others_speak() {
    let (robot, mut sender) = Silent::on_local_bus();
    let foreign = Frame::data_frame(StandardId::new(0x200).unwrap(), &[1, 2]).unwrap();
    robot.says(&["/bus is up and brings 0x200 × ", WANTED], || {
        sender.send(&foreign).unwrap();
    });
}

#[test]
fn a_bus_directory_that_is_not_there() {
    let (robot, _sender) = Silent::on_local_bus();
    let directory = robot.site.path("bus");
    std::fs::remove_dir_all(&directory).unwrap();
    robot.says(
        &[
            "/bus is not there: its directory or our socket in it was removed, ",
            WANTED,
        ],
        || {},
    );
    assert!(!directory.exists(), "who listens in makes no place");
}

#[test]
fn an_alive_signal_that_stands_still() {
    let (robot, mut sender) = Silent::on_local_bus();
    let frames = [LEFT_ID, RIGHT_ID].map(|id| encoder_frame(id, 7, 3));
    let parts = [
        "brings 0x100 × ",
        "wanted and heard: 0x100 (WheelLeft) × ",
        "; refused: alive counter repeated × ",
    ];
    robot.says(&parts, || {
        send_all(&mut sender, &frames);
    });
}

#[test]
fn a_wrong_checksum() {
    let (robot, mut sender) = Silent::on_local_bus();
    let garbled = |id: StandardId| Frame::data_frame(id, &[1, 2, 3, 4, 5, 6]).unwrap();
    let frames = [garbled(LEFT_ID), garbled(RIGHT_ID)];
    robot.says(
        &[
            "wanted and heard: 0x100 (WheelLeft) × ",
            "; refused: wrong checksum × ",
        ],
        || {
            send_all(&mut sender, &frames);
        },
    );
}

#[test]
fn a_wheel_that_is_not_heard() {
    let (robot, mut sender) = Silent::on_local_bus();
    let mut ticks = 0;
    robot.says(
        &["wanted and not heard: 0x101 (WheelRight), wanted and heard: 0x100 (WheelLeft) × "],
        || {
            ticks += 1;
            let alive = u8::try_from(ticks % 16).unwrap();
            sender.send(&encoder_frame(LEFT_ID, ticks, alive)).unwrap();
        },
    );
}

/// With a bus of another kind.
fn site_on(bus: &str) -> Site {
    let site = site();
    let local = format!("local:{}", site.path("bus").display());
    std::fs::write(site.config_path(), site.config().replace(&local, bus)).unwrap();
    site
}

#[test]
fn a_log_that_has_ended() {
    let site = site_on("candump:run.log");
    std::fs::write(
        site.path("run.log"),
        "(1.000000) can0 100#000000000000\n(1.020000) can0 200#00\n",
    )
    .unwrap();
    Silent::start(site).says(
        &["/run.log has been played to its end and holds 0x100 × 1, 0x200 × 1, wanted"],
        || {},
    );
}

#[test]
fn a_log_without_what_is_wanted_is_refused_with_what_it_holds() {
    let site = site_on("candump:run.log");
    std::fs::write(
        site.path("run.log"),
        "(1.000000) can0 200#00\n(1.020000) can0 200#00\n",
    )
    .unwrap();
    let (code, said) = site.try_run();
    assert_eq!(code, Some(1));
    assert!(
        said.contains("/run.log holds no frame that is wanted (0x100, 0x101); it holds 0x200 × 2"),
        "{said}"
    );
}

#[test]
fn who_has_no_wheels_misses_none() {
    let site = site();
    let without = site.config().split_once("[odometry]").unwrap().0.to_owned();
    let realtime = "[realtime]\nscheduler = \"other\"\nlock_memory = false\n";
    std::fs::write(site.config_path(), without + realtime).unwrap();
    let mut daemon = site.start();
    // A line would have been due by then.
    site.listen()
        .until("three seconds of ticks", |estimate| estimate.tick > 150);
    daemon.terminate();
    let log = std::fs::read_to_string(site.path("log")).unwrap();
    assert!(!log.contains("no odometry"), "{log}");
}
