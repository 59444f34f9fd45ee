//! A robot that follows frames as they come, and tells the time by counting them.

use std::sync::Arc;

use coloc_daemon::event::Link;
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::Wake;
use coloc_drivers::can::BusSpec;
use coloc_shm_types::{Estimate, RobotName, Space};
use rustix::event::{PollFd, PollFlags, poll};

use super::bus::PATIENCE;
use super::{Clock, Stamps, config};

/// The estimates that `pairs` of encoder frames on `bus` lead to, from when `start` is called.
///
/// A pair has the stamp of its number, so whenever and however the frames come, estimates of one stamp are the same. Pairs that
/// are read together lead to one estimate.
pub fn follow(bus: &BusSpec, pairs: usize, start: impl FnOnce()) -> Vec<Estimate> {
    let directory = tempfile::tempdir().unwrap();
    let config = config(&directory.path().join("shm"), bus);
    let space = Space::open(&config.shm.root, &config.shm.prefix, "follow").unwrap();
    let published = space
        .subscriber(&RobotName::new("robot1").unwrap())
        .unwrap();
    let (clock, link) = (Clock::new(Stamps::Counted), Arc::new(Link::new()));
    let mut robot = Robot::open(&config, &space, Box::new(clock), link).unwrap();
    start();
    let mut estimates = Vec::new();
    while robot.account().status().can.frames < 2 * pairs as u64 {
        wait(&robot);
        if robot.wake(Wake::Frame) == Outcome::Ticked {
            estimates.push(published.receive().unwrap().expect("a tick publishes"));
        }
    }
    estimates
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
