//! Finding the robot. Until it runs nothing is made: a directory that a waiting superuser made would shut the robot out.

use std::time::Duration;

use coloc_shm_types::{OpenError, RobotName};

use super::ListenError;
use super::args::ListenArgs;
use super::outlet;
use crate::demo::interrupt::Interrupt;
use crate::output::{complain, takes_no_more};
use crate::place::{Found, Looked, Place, look, who_else};

/// Between two looks; a daemon takes longer from its claim to its first estimate.
const PAUSE: Duration = Duration::from_millis(50);

/// The place that was named, else the usual one, else the only other one in which it runs now; and whether it runs.
pub(super) fn choose(args: &ListenArgs) -> Result<(Place, bool), ListenError> {
    let robot = &args.robot;
    let Looked { here, elsewhere } = look(&args.place);
    if let Some(found) = here.as_ref().ok().filter(|found| found.has(robot)) {
        return Ok((found.place.clone(), true));
    }
    let there: Vec<&Found> = elsewhere.iter().filter(|found| found.has(robot)).collect();
    match there[..] {
        [] => {
            let here = here?;
            complain(&format!(
                "coloc: {robot} does not run here, waiting for it in {}; {}",
                here.place,
                who_else(&here, &elsewhere)
            ));
            Ok((here.place, false))
        }
        [found] => {
            complain(&format!("coloc: {robot} runs in {}", found.place));
            Ok((found.place.clone(), true))
        }
        _ => Err(several(robot, &there)),
    }
}

fn several(robot: &RobotName, there: &[&Found]) -> ListenError {
    let places: Vec<String> = there.iter().map(|found| found.place.to_string()).collect();
    ListenError::Several {
        robot: robot.clone(),
        places: places.join(" and in "),
    }
}

/// Until it runs at `place`; `false` if that is not waited for any more.
pub(super) fn wait(
    place: &Place,
    robot: &RobotName,
    interrupt: &Interrupt,
) -> Result<bool, OpenError> {
    while !interrupt.is_there() && !takes_no_more() {
        if place.runs(robot)? {
            return Ok(true);
        }
        outlet::pause(PAUSE);
    }
    Ok(false)
}
