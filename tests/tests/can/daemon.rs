//! The whole path: encoder frames on a real bus, through a real `colocd`, to a pose in shared memory.

use coloc_daemon::config::Trigger;
use coloc_shm_types::{Health, Input};
use std::f64::consts::FRAC_PI_2;

use super::robot::{METRES_PER_TICK, Robot, TRACK_M};
use super::support::Interface;
use super::wheels::Wheels;

/// One metre ahead, a quarter turn to the left on the spot, half a metre ahead.
fn drive(wheels: &mut Wheels) {
    let quarter_turn = (FRAC_PI_2 * TRACK_M / 2.0 / METRES_PER_TICK / 50.0).round();
    #[expect(clippy::cast_possible_truncation, reason = "471 ticks")]
    let quarter_turn = quarter_turn as i32;
    wheels.turn([0, 0], 5);
    wheels.turn([2000, 2000], 50);
    wheels.turn([-quarter_turn, quarter_turn], 50);
    wheels.turn([2000, 2000], 25);
    wheels.turn([0, 0], 10);
}

/// Ticks are whole, so the angle is that of 471 ticks a frame; everything else is exact.
fn expected() -> [f64; 3] {
    let phi = 2.0 * 50.0 * 471.0 * METRES_PER_TICK / TRACK_M;
    [1.0 + 0.5 * phi.cos(), 0.5 * phi.sin(), phi]
}

fn a_drive_ends_where_geometry_says(left: &'static str, right: &'static str, trigger: Trigger) {
    let (left, right) = (Interface::new(left), Interface::new(right));
    let robot = Robot::start(&left.spec(), &right.spec(), trigger);
    let mut wheels = Wheels::new(&left, &right);
    drive(&mut wheels);
    let there = |pose: &[f64; 3]| {
        pose.iter()
            .zip(expected())
            .all(|(is, should)| (is - should).abs() < 1e-9)
    };
    let estimate = robot.estimate_until("the end of the drive", |estimate| there(&estimate.pose));
    assert_eq!(estimate.health_of(Input::Odometry), Health::Ok);
    let timing = robot.timing_until("its time", |timing| timing.tick == estimate.tick);
    assert_eq!(timing.header.stamp_ns, estimate.header.stamp_ns);
    assert!((1..=timing.header.stamp_ns).contains(&timing.frame_stamp_ns));
    robot.end();
}

#[test]
fn both_wheels_on_one_bus() {
    a_drive_ends_where_geometry_says("vcan0", "vcan0", Trigger::Timer);
}

#[test]
fn each_wheel_on_its_own_bus_and_frames_as_the_trigger() {
    a_drive_ends_where_geometry_says("vcan0", "vcan1", Trigger::Encoder);
}
