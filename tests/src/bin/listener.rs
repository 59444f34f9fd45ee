//! The listener of the README, held equal to it by `tests/tests/readme.rs`.

use std::convert::Infallible;
use std::io::{Write, stderr, stdout};
use std::{error::Error, process::ExitCode, time::Duration};

use coloc_shm_types::{Estimate, RobotName, Space};

fn main() -> ExitCode {
    let Err(error) = listen();
    let _ = writeln!(stderr(), "listener: {error}");
    ExitCode::FAILURE
}

fn listen() -> Result<Infallible, Box<dyn Error>> {
    let space = Space::open_default("listener")?;
    let estimates = space.subscriber::<Estimate>(&RobotName::new("robot1")?)?;
    loop {
        match estimates.wait(Duration::from_secs(1))? {
            Some(estimate) => writeln!(stdout(), "{:?} {:?}", estimate.pose, estimate.total())?,
            // Where shared memory was deleted, a robot that starts again is not heard.
            None => space.check()?,
        }
    }
}
