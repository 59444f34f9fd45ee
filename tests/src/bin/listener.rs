//! The listener of the README, held equal to it by `tests/tests/readme.rs`.

use std::{error::Error, thread::sleep, time::Duration};

use coloc_shm_types::{Estimate, RobotName, Space};

fn main() -> Result<(), Box<dyn Error>> {
    let space = Space::open_default("listener")?;
    let estimates = space.subscriber::<Estimate>(&RobotName::new("robot1")?)?;
    loop {
        while let Some(estimate) = estimates.receive()? {
            println!("{:?} {:?}", estimate.pose, estimate.total);
        }
        sleep(Duration::from_millis(10));
    }
}
