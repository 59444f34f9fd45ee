//! Feeds a robot the same satellite fix ten times a second: `feed_fixes <robot> <x> <y> [<root> <prefix>]`.
use std::io::{Write, stderr};
use std::{error::Error, path::Path, process::ExitCode};
use std::{thread::sleep, time::Duration, time::SystemTime};

use coloc_shm_types::{Clock, Position, RobotName, Sender, Space};

fn now_ns() -> Result<i64, Box<dyn Error>> {
    Ok(SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)?
        .as_nanos()
        .try_into()?)
}

fn main() -> ExitCode {
    let Err(error) = run() else {
        return ExitCode::SUCCESS;
    };
    // Nobody is left to tell if standard error is closed.
    let _ = stderr().write_all(format!("feed_fixes: {error}\n").as_bytes());
    ExitCode::FAILURE
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let ([robot, x, y] | [robot, x, y, _, _]) = arguments.as_slice() else {
        return Err(
            "usage: feed_fixes <robot> <x in m> <y in m> [<root> <prefix>], where the robot's \
                    configuration names them in [shm]"
                .into(),
        );
    };
    let metres = |text: &String| {
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("`{text}` is no number of metres"))
    };
    let position = [metres(x)?, metres(y)?];
    let space = match arguments.as_slice() {
        [_, _, _, root, prefix] => Space::open(Path::new(root), prefix, "feed_fixes")?,
        _ => Space::open_default("feed_fixes")?,
    };
    let fixes = space.publisher::<Position>(&RobotName::new(robot)?)?;
    let mut sender = Sender::start(0, Clock::Realtime)?;
    loop {
        let header = sender.header(now_ns()?);
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
}
