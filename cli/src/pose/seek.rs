//! Where the robot runs: it is told where it is now, so one that does not run is not waited for.

use super::{PoseArgs, PoseError};
use crate::place::{Found, Looked, Place, look, who_else};

/// The place that was named or is usual, else the only other one in which it runs.
pub(super) fn choose(args: &PoseArgs) -> Result<Place, PoseError> {
    let robot = &args.robot;
    let Looked { here, elsewhere } = look(&args.place);
    if let Some(found) = here.as_ref().ok().filter(|found| found.has(robot)) {
        return Ok(found.place.clone());
    }
    let there: Vec<&Found> = elsewhere.iter().filter(|found| found.has(robot)).collect();
    match there[..] {
        [] => {
            let here = here?;
            Err(PoseError::NotThere {
                robot: robot.clone(),
                place: here.place.to_string(),
                who_else: who_else(&here, &elsewhere),
            })
        }
        [found] => Ok(found.place.clone()),
        _ => {
            let places: Vec<String> = there.iter().map(|found| found.place.to_string()).collect();
            Err(PoseError::Several {
                robot: robot.clone(),
                places: places.join(" and in "),
            })
        }
    }
}
