//! A program that sends each robot a fix, fifty times a second: says `ready` after the first.

use std::error::Error;
use std::thread::sleep;
use std::time::Duration;

use coloc_shm_types::{Clock, Header, Position, RobotName, Sender, Space};
use coloc_tests::output::print_line;
use coloc_tests::surroundings::realtime_ns;

use super::Place;

const PERIOD: Duration = Duration::from_millis(20);

pub(crate) fn feed(place: &Place) -> Result<(), Box<dyn Error>> {
    let space = Space::open(&place.root, &place.prefix, "feeder")?;
    let ports = place
        .robots
        .iter()
        .map(|robot| Ok(space.publisher(&RobotName::new(robot)?)?))
        .collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    let mut sender = Sender::start(0, Clock::Realtime)?;
    for turn in 0_u64.. {
        let header = sender.header(realtime_ns());
        for port in &ports {
            // A robot that was just killed is no failure.
            let _ = port.send(fix(header));
        }
        if turn == 0 {
            print_line("ready");
        }
        sleep(PERIOD);
    }
    Ok(())
}

/// Of a robot at the origin.
fn fix(header: Header) -> Position {
    Position {
        header,
        quality: 4,
        covariance: [1e-2, 0.0, 0.0, 1e-2],
        ..Position::default()
    }
}
