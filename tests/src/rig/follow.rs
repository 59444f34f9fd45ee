//! A robot that follows frames as they come, its clock moving by a period with each pair of them.

use std::sync::Arc;

use coloc_daemon::event::Link;
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::Wake;
use coloc_drivers::can::BusSpec;
use coloc_shm_types::{Estimate, RobotName, Space};
use rustix::event::{PollFd, PollFlags, poll};

use super::bus::PATIENCE;
use super::{Clock, PERIOD_NS, Stamps, config};

/// The estimates that `pairs` of encoder frames on `bus` lead to, from when `start` is called.
///
/// The stamps are those of the rig's clock, so whenever and however the frames come they are the same; `None` if
/// frames of two pairs came at once, which have no stamps of their own then.
pub fn follow(bus: &BusSpec, pairs: usize, start: impl FnOnce()) -> Option<Vec<Estimate>> {
    let directory = tempfile::tempdir().unwrap();
    let config = config(&directory.path().join("shm"), bus);
    let space = Space::open(&config.shm.root, &config.shm.prefix, "follow").unwrap();
    let published = space
        .subscriber(&RobotName::new("robot1").unwrap())
        .unwrap();
    let (clock, link) = (Clock::new(Stamps::Unbelievable), Arc::new(Link::new()));
    let mut robot = Robot::open(&config, &space, Box::new(clock.clone()), link).unwrap();
    start();
    let (mut estimates, mut whole) = (Vec::new(), 0);
    while whole < 2 * pairs as u64 {
        wait(&robot);
        if robot.wake(Wake::Frame) == Outcome::Ticked {
            estimates.push(published.receive().unwrap().expect("a tick publishes"));
        }
        match robot.account().status.can.frames.checked_sub(whole) {
            Some(0 | 1) => {}
            Some(2) => {
                clock.run(PERIOD_NS);
                whole += 2;
            }
            _ => return None,
        }
    }
    Some(estimates)
}

fn wait(robot: &Robot) {
    let mut buses: Vec<_> = robot
        .collect()
        .buses()
        .map(|bus| PollFd::from_borrowed_fd(bus, PollFlags::IN))
        .collect();
    assert_ne!(
        poll(&mut buses, Some(&PATIENCE)).unwrap(),
        0,
        "no frame came"
    );
}
