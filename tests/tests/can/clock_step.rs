//! The machine's clock is set while frames come. Only where the machine is ours: in the virtual one.

use coloc_shm_types::{Estimate, Health, Input};
use rustix::time::{ClockId, Timespec, clock_gettime, clock_settime};

use super::robot::{METRES_PER_TICK, Robot};
use super::support::Interface;
use super::wheels::Wheels;

#[test]
fn a_daemon_does_not_mind_the_clock_being_set() {
    if std::env::var("WITH_VCAN").is_ok_and(|how| how != "uml") {
        eprintln!(
            "SKIPPED: setting the clock of this machine; WITH_VCAN_FORCE=uml runs it in a virtual one"
        );
        return;
    }
    let interface = Interface::new("vcan0");
    let robot = Robot::start(&interface.spec(), &interface.spec(), "timer");
    let mut wheels = Wheels::new(&interface, &interface);
    wheels.turn([1000, 1000], 25);
    robot.estimate_until("odometry", |estimate| {
        estimate.health_of(Input::Odometry) == Health::Ok
    });
    for seconds in [1, -1, 3600, -3600] {
        robot.estimates().for_each(drop);
        set_clock(seconds);
        for _ in 0..25 {
            wheels.turn([1000, 1000], 1);
            for estimate in robot.estimates() {
                assert_undisturbed(&estimate, seconds);
            }
        }
    }
    wheels.turn([0, 0], 10);
    let way_m = METRES_PER_TICK * 1000.0 * f64::from(25 * 5 - 1);
    // A step ends the history at the last tick. How the speed changed from the frame before that to the next is lost, and
    // on a busy machine frames come so irregularly that each time it is a millimetre.
    robot.estimate_until("the whole way", |estimate| {
        (estimate.pose[0] - way_m).abs() < 5e-3
    });
    robot.end();
}

/// Neither health nor velocity show it: 0.5 m/s, whose frames come within a few milliseconds of when they should.
fn assert_undisturbed(estimate: &Estimate, seconds: i64) {
    assert_eq!(
        estimate.health_of(Input::Odometry),
        Health::Ok,
        "{seconds:+} s: {estimate:?}"
    );
    assert!(
        (0.05..5.0).contains(&estimate.velocity[0]),
        "{seconds:+} s: {estimate:?}"
    );
}

fn set_clock(seconds: i64) {
    let now = clock_gettime(ClockId::Realtime);
    let then = Timespec {
        tv_sec: now.tv_sec + seconds,
        ..now
    };
    clock_settime(ClockId::Realtime, then).unwrap();
}
