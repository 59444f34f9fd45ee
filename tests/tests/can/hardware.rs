//! The tests that a robot builder runs on their own interface and wiring: `tests/hil/run --interface can0`.

use coloc_daemon::config::{Config, Realtime, Trigger};
use coloc_drivers::can::{BusSpec, Sender};
use coloc_tests::faults::{Place, play_all};
use coloc_tests::rig::Line;

use super::robot::{Robot, configuration};
use super::wheels::Wheels;

fn line() -> Line {
    let variable = |name| std::env::var(name).expect("tests/hil/run --interface sets it");
    Line::Hardware {
        receiver: variable("COLOC_HIL_INTERFACE"),
        sender: variable("COLOC_HIL_PEER"),
    }
}

#[test]
fn every_fault_that_can_be_made_on_hardware_is_as_the_table_says() {
    play_all(
        |fault| matches!(fault.place, Place::Anywhere | Place::Interface),
        |_| line(),
    );
}

/// The section of a `robot.toml` that was given, or the defaults.
fn realtime() -> Realtime {
    let section = std::env::var("COLOC_HIL_REALTIME").unwrap_or_default();
    let file: toml::Table = section.parse().unwrap();
    let given = file.get("realtime").cloned();
    given.map_or_else(Realtime::default, |it| it.try_into().unwrap())
}

/// A minute at 50 Hz. Times are shown, not judged: what is good depends on the machine (see `tests/hil/README.md`).
#[test]
fn no_frame_is_lost_in_a_minute_and_this_is_how_long_they_take() {
    const PAIRS: u32 = 3000;
    let spec = line().spec().to_string();
    let robot = Robot::configured(|root| Config {
        realtime: realtime(),
        ..configuration(&spec, &spec, Trigger::Encoder, root)
    });
    let open = |bus: &BusSpec| Sender::open(bus).unwrap();
    let bus = line().sending_spec();
    let mut wheels = Wheels::between([open(&bus), open(&bus)]);
    let mut times_us = Vec::new();
    for _ in 0..PAIRS {
        wheels.turn([1000, 1000], 1);
        let with_frames = robot.timings().filter(|timing| timing.latency_ns > 0);
        times_us.extend(with_frames.map(|timing| timing.latency_ns / 1000));
    }
    times_us.sort_unstable();
    let at = |share: f64| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a place in the list"
        )]
        let place = (times_us.len() as f64 * share) as usize;
        times_us.get(place).or(times_us.last()).unwrap()
    };
    eprintln!(
        "from the frame's arrival to the published pose: p50 {} us, p99 {} us, p99.9 {} us, worst {} us ({} poses)",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0),
        times_us.len()
    );
    let all = u64::from(2 * PAIRS);
    let status = robot.status_until("an account of all frames", |status| {
        status.can.frames >= all
    });
    eprintln!(
        "{} frames, {} missing, {} dropped, {} deadlines missed",
        status.can.frames, status.can.alive_skips, status.can.rx_overflows, status.deadline_misses
    );
    assert_eq!((status.can.alive_skips, status.can.rx_overflows), (0, 0));
    robot.end();
}
