//! The machine's clock is set while frames come. Only where the machine is ours: in the virtual one.

use coloc_daemon::config::Trigger;
use coloc_shm_types::{Estimate, Health, Input};
use rustix::time::{ClockId, Timespec, clock_gettime, clock_settime};

use super::robot::{METRES_PER_TICK, Robot};
use super::support::Interface;
use super::wheels::Wheels;

const SECOND_NS: i64 = 1_000_000_000;
const STEPS_MS: [i64; 10] = [
    1000, -1000, 3_600_000, -3_600_000, 119, -119, 20, -20, 1, -1,
];

#[test]
fn a_daemon_does_not_mind_the_clock_being_set() {
    if std::env::var("WITH_VCAN").is_ok_and(|how| how != "uml") {
        eprintln!(
            "SKIPPED: setting the clock of this machine; WITH_VCAN_FORCE=uml runs it in a virtual one"
        );
        return;
    }
    let interface = Interface::new("vcan0");
    let robot = Robot::start(&interface.spec(), &interface.spec(), Trigger::Timer);
    let mut wheels = Wheels::new(&interface, &interface);
    wheels.turn([1000, 1000], 25);
    robot.estimate_until("odometry", |estimate| {
        estimate.health_of(Input::Odometry) == Health::Ok
    });
    for millis in STEPS_MS {
        robot.estimates().for_each(drop);
        set_clock(millis);
        for _ in 0..25 {
            wheels.turn([1000, 1000], 1);
            for estimate in robot.estimates() {
                assert_undisturbed(&estimate, millis);
            }
        }
    }
    wheels.turn([0, 0], 10);
    let way_m =
        METRES_PER_TICK * 1000.0 * f64::from(25 * (1 + u32::try_from(STEPS_MS.len()).unwrap()) - 1);
    robot.estimate_until("the whole way", |estimate| {
        (estimate.pose[0] - way_m).abs() < 1e-6
    });
    robot.end();
}

/// Neither health nor velocity show it: 0.5 m/s, whose frames come within a few milliseconds of when they should.
fn assert_undisturbed(estimate: &Estimate, millis: i64) {
    assert_eq!(
        estimate.health_of(Input::Odometry),
        Health::Ok,
        "{millis:+} ms: {estimate:?}"
    );
    assert!(
        (0.05..5.0).contains(&estimate.velocity[0]),
        "{millis:+} ms: {estimate:?}"
    );
}

fn set_clock(millis: i64) {
    let now = clock_gettime(ClockId::Realtime);
    let now_ns = now.tv_sec * SECOND_NS + now.tv_nsec;
    let then_ns = now_ns + millis * 1_000_000;
    let then = Timespec {
        tv_sec: then_ns / SECOND_NS,
        tv_nsec: then_ns % SECOND_NS,
    };
    clock_settime(ClockId::Realtime, then).unwrap();
}
