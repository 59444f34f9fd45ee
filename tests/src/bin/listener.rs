//! The listener of the README, held equal to it by `tests/tests/readme.rs`.

use std::convert::Infallible;
use std::io::{Write, stderr, stdout};
use std::{error::Error, process::ExitCode, thread::sleep, time::Duration};

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
        for _ in 0..100 {
            while let Some(estimate) = estimates.receive()? {
                writeln!(stdout(), "{:?} {:?}", estimate.pose, estimate.total())?;
            }
            sleep(Duration::from_millis(10));
        }
        space.check()?; // Where shared memory was deleted, a robot that starts again is not heard.
    }
}
