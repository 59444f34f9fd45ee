//! A daemon that is stopped for a while beside a twin that is not: what the kernel held for it is taken in whole.

use std::time::Duration;

use coloc_daemon::config::Trigger;
use coloc_shm_types::{Health, Input};

use super::robot::Robot;
use super::support::Interface;
use super::wheels::Wheels;

/// Three seconds at 50 Hz: more samples than the estimator takes at once, more frames than one drain brings.
#[test]
fn after_a_stop_of_three_seconds_it_believes_what_its_twin_does() {
    compare_twins(Duration::from_millis(20), 150, 10);
}

/// As many frames as come in a minute: more than one tick has time for.
#[test]
fn after_a_minutes_frames_it_believes_what_its_twin_does() {
    compare_twins(Duration::from_millis(2), 3000, 1);
}

/// Turns are `scale` encoder ticks for each millimetre of a slalom.
fn compare_twins(period: Duration, pairs: u32, scale: i32) {
    let interface = Interface::new("vcan3");
    let [twin, stopped] = [0; 2].map(|_| {
        let robot = Robot::start(&interface.spec(), &interface.spec(), Trigger::Timer);
        robot.estimate_until("the first tick", |_| true);
        robot
    });
    let mut wheels = Wheels::new(&interface, &interface).every(period);
    wheels.turn([0, 0], 20);
    stopped.pause();
    for pair in 0..pairs {
        let turn = if (pair / 25).is_multiple_of(2) {
            30
        } else {
            -30
        };
        wheels.turn([scale * (100 - turn), scale * (100 + turn)], 1);
    }
    stopped.go_on();
    wheels.turn([0, 0], 50);
    let (left_m, right_m) = wheels.ways_m();
    let way_m = f64::midpoint(left_m, right_m);
    let end = [&twin, &stopped].map(|robot| {
        // Who has much to catch up with is stale meanwhile.
        let frames = u64::from(2 * (20 + pairs + 50));
        let status = robot.status_until("an account of all frames", |status| {
            status.can.frames >= frames
        });
        assert_eq!(status.can.rx_overflows, 0, "{status:?}");
        robot.estimates().for_each(drop);
        robot.estimate_until("rest", |estimate| {
            estimate.health_of(Input::Odometry) == Health::Stale
        })
    });
    for axis in 0..3 {
        let (twin, stopped) = (end[0].pose[axis], end[1].pose[axis]);
        assert!((twin - stopped).abs() < 1e-9, "{twin} and {stopped}");
    }
    assert!(
        end[0].pose[0] > 0.5 * way_m,
        "{:?} of {way_m} m",
        end[0].pose
    );
    for robot in [twin, stopped] {
        robot.end();
    }
}
