//! Several robots: each on a bus of its own, or two on one.

use coloc_daemon::config::Trigger;

use super::robot::{METRES_PER_TICK, Robot};
use super::support::Interface;
use super::wheels::Wheels;

#[test]
fn five_robots_on_five_interfaces_each_follow_their_own_wheels() {
    let interfaces = ["vcan0", "vcan1", "vcan2", "vcan3", "vcan4"].map(Interface::new);
    let robots = interfaces
        .each_ref()
        .map(|interface| Robot::start(&interface.spec(), &interface.spec(), Trigger::Timer));
    let mut wheels = interfaces
        .each_ref()
        .map(|interface| Wheels::new(interface, interface));
    for moving in [0, 1, 0] {
        for _ in 0..50 {
            for (wheels, speed) in wheels.iter_mut().zip(1..) {
                wheels.turn([moving * speed * 200; 2], 1);
            }
        }
    }
    for (robot, speed) in robots.iter().zip(1..) {
        let way_m = METRES_PER_TICK * f64::from(50 * speed * 200);
        robot.estimate_until("its own way", |estimate| {
            (estimate.pose[0] - way_m).abs() < 1e-9
        });
    }
    robots.into_iter().for_each(Robot::end);
}

#[test]
fn two_robots_on_one_bus_hear_the_same() {
    let interface = Interface::new("vcan0");
    let robots = [Trigger::Timer, Trigger::Encoder]
        .map(|trigger| Robot::start(&interface.spec(), &interface.spec(), trigger));
    let mut wheels = Wheels::new(&interface, &interface);
    wheels.turn([0, 0], 5);
    wheels.turn([900, 1100], 100);
    wheels.turn([0, 0], 10);
    let standing = |ticks: i32| METRES_PER_TICK * f64::from(ticks) / super::robot::TRACK_M;
    let phi = standing(100 * 200);
    let poses = robots.each_ref().map(|robot| {
        robot
            .estimate_until("the curve", |estimate| {
                (estimate.pose[2] - phi).abs() < 1e-9
            })
            .pose
    });
    // Their ticks differ, and with them the moments to which the last velocity was extrapolated; the way does not.
    assert!(
        poses[0]
            .iter()
            .zip(poses[1])
            .all(|(a, b)| (a - b).abs() < 1e-6),
        "{poses:?}"
    );
    robots.into_iter().for_each(Robot::end);
}
