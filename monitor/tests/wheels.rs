//! The wheels are read a second time: two readers of one bus make the same of its frames.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;
use std::time::{Duration, Instant};

use coloc_daemon::config::{Config, Robot};
use coloc_drivers::can::{BusSpec, Sender};
use coloc_drivers::encoder::{BaseConfig, OdometryConfig, WheelFrames, WheelOdometry};
use coloc_monitor::wheels::Wheels;
use coloc_shm_types::{Header, Odometry, OdometryKind, RobotName};

const METRES_PER_TICK: f64 = 1e-4;

fn config(odometry: OdometryConfig) -> Config {
    let name = RobotName::new("a").unwrap();
    Config {
        odometry: Some(odometry),
        ..Config::of(Robot { name, id: 1 })
    }
}

fn bus(directory: &Path) -> BusSpec {
    BusSpec::Local {
        directory: directory.join("bus"),
    }
}

fn drained(wheels: &mut Wheels) -> Vec<WheelOdometry> {
    let mut made = Vec::new();
    wheels.drain(&mut |it| made.push(*it));
    made
}

#[test]
fn both_readers_of_a_bus_make_the_same_of_it() {
    let home = tempfile::tempdir().unwrap();
    let bus = bus(home.path());
    let odometry = OdometryConfig::differential(bus.clone(), 0.5, METRES_PER_TICK, 2.0);
    let config = config(odometry);
    let [mut one, mut other] = [0, 1].map(|_| Wheels::open(&config).unwrap());
    let mut sender = Sender::open(&bus).unwrap();
    let mut frames = WheelFrames::new(METRES_PER_TICK);
    let (mut made, mut twin) = (Vec::new(), Vec::new());
    for turn in 0..5 {
        let way = 0.002 * f64::from(turn);
        for frame in frames.encode(way, 2.0 * way) {
            sender.send(&frame).unwrap();
        }
        made.extend(drained(&mut one));
        twin.extend(drained(&mut other));
        // A robot that drives so far takes that long at least.
        let sent = Instant::now();
        while sent.elapsed() < Duration::from_millis(5) {
            std::thread::yield_now();
        }
    }
    assert!(!made.is_empty());
    for it in &made {
        assert!(it.start_ns < it.stamp_ns && it.velocity[0] > 0.0 && it.velocity[2] > 0.0);
    }
    // Stamps are the kernel's, read as the inner clock to some microseconds.
    let stamps = |of: &[WheelOdometry]| of.iter().map(|it| it.stamp_ns).collect::<Vec<_>>();
    assert_eq!(made.len(), twin.len());
    for (a, b) in stamps(&made).into_iter().zip(stamps(&twin)) {
        assert!((a - b).abs() < 1_000_000, "{a} {b}");
    }
}

#[test]
fn a_base_is_heard_and_each_session_is_counted_from_its_own_first_word() {
    let mut odometry = OdometryConfig::of(2.0);
    odometry.base = Some(BaseConfig {
        track_m: Some(0.5),
        ..BaseConfig::default()
    });
    let mut wheels = Wheels::open(&config(odometry)).unwrap();
    let said = |session, ms: i64, left, right| Odometry {
        header: Header {
            stamp_ns: ms * 1_000_000,
            session,
            ..Header::default()
        },
        kind: OdometryKind::WheelDistances as u8,
        values: [left, right, 0.0, 0.0],
        ..Odometry::default()
    };
    assert_eq!(wheels.hear(&said(1, 0, 5.0, 5.0)), None);
    assert_eq!(wheels.hear(&said(2, 10, 90.0, 90.0)), None);
    let made = wheels.hear(&said(1, 20, 5.01, 5.01)).unwrap();
    assert!((made.velocity[0] - 0.5).abs() < 1e-6, "{made:?}");
    assert_eq!((made.start_ns, made.stamp_ns), (0, 20_000_000));
    // A word that is none makes nothing.
    let wrong = Odometry {
        kind: 99,
        ..said(1, 40, 5.02, 5.02)
    };
    assert_eq!(wheels.hear(&wrong), None);
}
