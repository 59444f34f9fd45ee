//! Prints the estimates of a robot as they come: `watch_estimates <robot> [<root> <prefix>]`.
use std::io::{ErrorKind, Write, stderr, stdout};
use std::{error::Error, path::Path, process::ExitCode, thread::sleep, time::Duration};

use coloc_shm_types::{Estimate, RobotName, Space};

fn main() -> ExitCode {
    let Err(error) = run() else {
        return ExitCode::SUCCESS;
    };
    // Nobody is left to tell if standard error is closed.
    let _ = stderr().write_all(format!("watch_estimates: {error}\n").as_bytes());
    ExitCode::FAILURE
}

/// Until whoever reads the lines has seen enough.
fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (robot, space) = match arguments.as_slice() {
        [robot] => (robot, Space::open_default("watch_estimates")?),
        [robot, root, prefix] => {
            let root = Path::new(root);
            (robot, Space::open(root, prefix, "watch_estimates")?)
        }
        _ => {
            return Err(
                "usage: watch_estimates <robot> [<root> <prefix>]: where the robot's \
                        configuration names them in [shm]"
                    .into(),
            );
        }
    };
    let estimates = space.subscriber::<Estimate>(&RobotName::new(robot)?)?;
    loop {
        while let Some(estimate) = estimates.receive()? {
            let [x, y, heading] = estimate.pose;
            let total = estimate.total();
            let [sx, sy] = [total[0].sqrt(), total[4].sqrt()];
            let line = format!(
                "{} x {x:.3} ± {sx:.3} m, y {y:.3} ± {sy:.3} m, φ {heading:.3} rad\n",
                estimate.tick
            );
            match stdout().write_all(line.as_bytes()) {
                Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(()),
                written => written?,
            }
        }
        sleep(Duration::from_millis(10));
    }
}
