//! Feeds a robot the same satellite fix ten times a second: `feed_fixes <root> <prefix> <robot> <x> <y>`.
use std::{error::Error, path::Path, thread::sleep, time::Duration, time::SystemTime};

use coloc_shm_types::{Header, Position, RobotName, Space};

fn now_ns() -> Result<i64, Box<dyn Error>> {
    Ok(SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)?
        .as_nanos()
        .try_into()?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [root, prefix, robot, x, y] = arguments.as_slice() else {
        return Err(
            "usage: feed_fixes <root> <prefix> <robot> <x in m> <y in m>; clock `realtime`".into(),
        );
    };
    let position = [x.parse()?, y.parse()?];
    let space = Space::open(Path::new(root), prefix, "feed_fixes")?;
    let fixes = space.publisher::<Position>(&RobotName::new(robot)?)?;
    let session_ns = now_ns()?;
    for sequence in 0.. {
        let header = Header {
            stamp_ns: now_ns()?,
            session_ns,
            sequence,
        };
        let covariance = [0.01, 0.0, 0.0, 0.01]; // 0.1 m
        fixes.send(Position {
            header,
            quality: 2,
            position,
            covariance,
            ..Position::default()
        })?;
        sleep(Duration::from_millis(100));
    }
    Ok(())
}
