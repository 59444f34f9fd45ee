//! A program that sends each robot a fix, fifty times a second: says `ready` after the first.

use std::error::Error;
use std::thread::sleep;
use std::time::Duration;

use coloc_shm_types::{Header, Position, RobotName, Space};
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
    let session_ns = realtime_ns();
    for sequence in 0.. {
        for port in &ports {
            // A robot that was just killed is no failure.
            let _ = port.send(fix(session_ns, sequence));
        }
        if sequence == 0 {
            print_line("ready");
        }
        sleep(PERIOD);
    }
    Ok(())
}

/// Of a robot at the origin.
fn fix(session_ns: i64, sequence: u64) -> Position {
    Position {
        header: Header {
            stamp_ns: realtime_ns(),
            session_ns,
            sequence,
        },
        quality: 4,
        covariance: [1e-2, 0.0, 0.0, 1e-2],
        ..Position::default()
    }
}
