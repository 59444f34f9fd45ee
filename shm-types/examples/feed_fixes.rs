//! Feeds a robot the same satellite fix ten times a second: `feed_fixes <robot> <x> <y> [<root> <prefix>]`.
use std::io::{ErrorKind, Write, stderr, stdout};
use std::{convert::Infallible, error::Error, ffi::OsString, path::Path, process::ExitCode};
use std::{sync::Arc, thread::sleep, time::Duration, time::SystemTime};

use coloc_shm_types::{Clock, Position, RobotName, Sender, Space};
use signal_hook::{consts::SIGXFSZ, flag};

const USAGE: &str = "usage: feed_fixes <robot> <x in m> <y in m> [<root> <prefix>], where the robot's \
                     configuration names them in [shm]";

fn main() -> ExitCode {
    // Handled, it lets a write beyond a limit (`ulimit -f`) fail, as on a full disk.
    let _ = flag::register(SIGXFSZ, Arc::default());
    let arguments = std::env::args_os().skip(1).map(OsString::into_string);
    let arguments: Vec<String> = match arguments.collect() {
        Ok(arguments) => arguments,
        Err(odd) => return end(2, &format!("`{}` is not UTF-8", odd.display())),
    };
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (robot, x, y, place) = match arguments[..] {
        ["-h" | "--help", ..] => return help(),
        [robot, x, y] => (robot, x, y, None),
        [robot, x, y, root, prefix] => (robot, x, y, Some((root, prefix))),
        _ => return end(2, USAGE),
    };
    let position = match (metres(x), metres(y)) {
        (Ok(x), Ok(y)) => [x, y],
        (Err(problem), _) | (_, Err(problem)) => return end(2, &problem),
    };
    let Err(problem) = feed(robot, position, place);
    end(1, &problem.to_string())
}

fn help() -> ExitCode {
    match stdout().write_all(format!("{USAGE}\n").as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            end(1, &format!("cannot write to standard output: {error}"))
        }
        _ => ExitCode::SUCCESS,
    }
}

fn end(status: u8, why: &str) -> ExitCode {
    // Nobody is left to tell if standard error is closed.
    let _ = stderr().write_all(format!("feed_fixes: {why}\n").as_bytes());
    ExitCode::from(status)
}

fn metres(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("`{text}` is no number of metres"))
}

/// Until the robot cannot hear it any more.
fn feed(
    robot: &str,
    position: [f64; 2],
    place: Option<(&str, &str)>,
) -> Result<Infallible, Box<dyn Error>> {
    let space = match place {
        Some((root, prefix)) => Space::open(Path::new(root), prefix, "feed_fixes")?,
        None => Space::open_default("feed_fixes")?,
    };
    let fixes = space.publisher::<Position>(&RobotName::new(robot)?)?;
    let mut sender = Sender::start(0, Clock::Realtime)?;
    loop {
        for _ in 0..10 {
            fixes.send(Position {
                header: sender.header(now_ns()?),
                quality: 2,
                position,
                covariance: [0.01, 0.0, 0.0, 0.01], // 0.1 m
                ..Position::default()
            })?;
            sleep(Duration::from_millis(100));
        }
        space.check()?;
    }
}

fn now_ns() -> Result<i64, Box<dyn Error>> {
    Ok(SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)?
        .as_nanos()
        .try_into()?)
}
