//! Says fifty times a second what a base does that drives steadily: `drive_base <robot> <speed> <turn rate> [<root> <prefix>]`.
use std::io::{ErrorKind, Write, stderr, stdout};
use std::{convert::Infallible, error::Error, ffi::OsString, path::Path, process::ExitCode};
use std::{sync::Arc, thread::sleep, time::Duration};

use coloc_shm_types::{Clock, Odometry, OdometryKind, RobotName, Sender, Space};
use rustix::time::{ClockId, clock_gettime};
use signal_hook::{consts::SIGXFSZ, flag};

const USAGE: &str = "usage: drive_base <robot> <speed in m/s> <turn rate in rad/s> [<root> <prefix>], where the \
                     robot's configuration has [odometry.base], and names them in [shm]";

fn main() -> ExitCode {
    // Handled, it lets a write beyond a limit (`ulimit -f`) fail, as on a full disk.
    let _ = flag::register(SIGXFSZ, Arc::default());
    let arguments = std::env::args_os().skip(1).map(OsString::into_string);
    let arguments: Vec<String> = match arguments.collect() {
        Ok(arguments) => arguments,
        Err(odd) => return end(2, &format!("`{}` is not UTF-8", odd.display())),
    };
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (robot, speed, turn_rate, place) = match arguments[..] {
        ["-h" | "--help", ..] => return help(),
        [robot, speed, turn_rate] => (robot, speed, turn_rate, None),
        [robot, speed, turn_rate, root, prefix] => (robot, speed, turn_rate, Some((root, prefix))),
        _ => return end(2, USAGE),
    };
    let [speed, turn_rate] = match (number(speed), number(turn_rate)) {
        (Ok(speed), Ok(turn_rate)) => [speed, turn_rate],
        (Err(problem), _) | (_, Err(problem)) => return end(2, &problem),
    };
    let Err(problem) = drive(robot, [speed, 0.0, turn_rate, 0.0], place);
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
    let _ = stderr().write_all(format!("drive_base: {why}\n").as_bytes());
    ExitCode::from(status)
}

fn number(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("`{text}` is no number"))
}

/// Until the robot cannot hear it any more. Each message says how it moved since the one before.
fn drive(
    robot: &str,
    values: [f64; 4],
    place: Option<(&str, &str)>,
) -> Result<Infallible, Box<dyn Error>> {
    let space = match place {
        Some((root, prefix)) => Space::open(Path::new(root), prefix, "drive_base")?,
        None => Space::open_default("drive_base")?,
    };
    let odometry = space.publisher::<Odometry>(&RobotName::new(robot)?)?;
    // Nobody sets this clock: a driver on the robot's own computer does best with it.
    let mut sender = Sender::start(0, Clock::Boottime)?;
    loop {
        for _ in 0..50 {
            odometry.send(Odometry {
                header: sender.header(now_ns()?),
                kind: OdometryKind::Twist as u8,
                values,
                // Its noise is as configured in [motion]: a base that knows better says so in `covariance`.
                ..Odometry::default()
            })?;
            sleep(Duration::from_millis(20));
        }
        space.check()?;
    }
}

fn now_ns() -> Result<i64, Box<dyn Error>> {
    let now = clock_gettime(ClockId::Boottime);
    Ok(Duration::try_from(now)?.as_nanos().try_into()?)
}
