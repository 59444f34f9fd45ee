//! Prints the estimates of a robot as they come: `watch_estimates <robot> [<root> <prefix>]`.
use std::io::{ErrorKind, Write, stderr, stdout};
use std::{error::Error, ffi::OsString, path::Path, process::ExitCode};
use std::{sync::Arc, time::Duration};

use coloc_shm_types::{Estimate, RobotName, Space};
use signal_hook::{consts::SIGXFSZ, flag};

const USAGE: &str = "usage: watch_estimates <robot> [<root> <prefix>], where the robot's \
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
    let ended = match arguments[..] {
        ["-h" | "--help", ..] => say(&format!("{USAGE}\n")).map(drop),
        [robot] => watch(robot, None),
        [robot, root, prefix] => watch(robot, Some((root, prefix))),
        _ => return end(2, USAGE),
    };
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => end(1, &problem.to_string()),
    }
}

fn end(status: u8, why: &str) -> ExitCode {
    // Nobody is left to tell if standard error is closed.
    let _ = stderr().write_all(format!("watch_estimates: {why}\n").as_bytes());
    ExitCode::from(status)
}

/// Until whoever reads the lines has seen enough, or the robot cannot be heard here any more.
fn watch(robot: &str, place: Option<(&str, &str)>) -> Result<(), Box<dyn Error>> {
    let space = match place {
        Some((root, prefix)) => Space::open(Path::new(root), prefix, "watch_estimates")?,
        None => Space::open_default("watch_estimates")?,
    };
    let estimates = space.subscriber::<Estimate>(&RobotName::new(robot)?)?;
    let mut silent_for = Some(0);
    loop {
        if let Some(estimate) = estimates.wait(Duration::from_secs(1))? {
            silent_for = None;
            if !say(&line(&estimate))? {
                return Ok(());
            }
            continue;
        }
        space.check()?;
        silent_for = silent_for.map(|seconds| seconds + 1);
        if silent_for == Some(2) {
            let said =
                format!("watch_estimates: {robot} is silent so far: does its colocd run here?\n");
            let _ = stderr().write_all(said.as_bytes());
        }
    }
}

fn line(estimate: &Estimate) -> String {
    let [x, y, heading] = estimate.pose;
    let total = estimate.total();
    let [sx, sy] = [total[0].sqrt(), total[4].sqrt()];
    format!(
        "{} x {x:.3} ± {sx:.3} m, y {y:.3} ± {sy:.3} m, φ {heading:.3} rad\n",
        estimate.tick
    )
}

/// Whether anybody reads it.
fn say(text: &str) -> Result<bool, Box<dyn Error>> {
    match stdout().write_all(text.as_bytes()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(format!("cannot write to standard output: {error}").into()),
    }
}
