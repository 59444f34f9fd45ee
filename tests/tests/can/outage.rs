//! A running daemon whose interface is switched off and on: health follows at the next tick, and nothing is restarted.

use coloc_daemon::config::Trigger;
use coloc_shm_types::{Estimate, Health, Input};

use super::robot::Robot;
use super::support::Interface;
use super::wheels::Wheels;

#[test]
fn health_flips_at_the_next_tick_and_the_way_is_whole_afterwards() {
    let interface = Interface::new("vcan2");
    let robot = Robot::start(&interface.spec(), &interface.spec(), Trigger::Timer);
    let mut wheels = Wheels::new(&interface, &interface);
    wheels.turn([1000, 1000], 25);
    let well = robot.estimate_until("odometry", |estimate| health(estimate) == Health::Ok);

    interface.set(&["down"]);
    // What was published up to now may be from before; the one after the next is not.
    let seen = robot
        .estimates()
        .last()
        .map_or(well.tick, |estimate| estimate.tick);
    let faulty = robot.estimate_until("the outage", |estimate| health(estimate) == Health::Faulty);
    assert!(faulty.tick <= seen + 2, "tick {} of {seen}", faulty.tick);
    for _ in 0..25 {
        let estimate = robot.estimate_until("a tick", |_| true);
        assert_eq!(health(&estimate), Health::Faulty, "{estimate:?}");
    }

    interface.set(&["up"]);
    wheels.reconnect(&interface, &interface);
    wheels.turn([0, 0], 10);
    let again = robot.estimate_until("odometry again", |estimate| health(estimate) == Health::Ok);
    assert_eq!(again.header.session, well.header.session, "the same daemon");
    assert_eq!(again.header.sequence, again.tick, "one publication a tick");
    let way_m = 0.24;
    robot.estimate_until("the whole way", |estimate| {
        (estimate.pose[0] - way_m).abs() < 1e-9
    });
    robot.end();
}

fn health(estimate: &Estimate) -> Health {
    estimate.health_of(Input::Odometry)
}
