//! Prints the estimates of a robot as they come: `watch_estimates <root> <prefix> <robot>`.
use std::{error::Error, path::Path, thread::sleep, time::Duration};

use coloc_shm_types::{Estimate, RobotName, Space};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [root, prefix, robot] = arguments.as_slice() else {
        return Err(
            "usage: watch_estimates <root> <prefix> <robot>, as in the robot's configuration"
                .into(),
        );
    };
    let space = Space::open(Path::new(root), prefix, "watch_estimates")?;
    let estimates = space.subscriber::<Estimate>(&RobotName::new(robot)?)?;
    loop {
        while let Some(estimate) = estimates.receive()? {
            let [x, y, heading] = estimate.pose;
            let [sx, sy] = [estimate.total[0].sqrt(), estimate.total[4].sqrt()];
            println!(
                "{} x {x:.3} ± {sx:.3} m, y {y:.3} ± {sy:.3} m, φ {heading:.3} rad",
                estimate.tick
            );
        }
        sleep(Duration::from_millis(10));
    }
}
