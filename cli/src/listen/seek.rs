//! Finding the robot. Until it runs nothing is made: a directory that a waiting superuser made would shut the robot out.

use std::time::Duration;

use coloc_shm_types::RobotName;

use super::outlet;
use super::{ListenError, args::ListenArgs};
use crate::demo::interrupt::Interrupt;
use crate::output::{complain, takes_no_more};
use crate::place::{Found, Looked, Place, look};

/// Between two looks; a daemon takes longer from its claim to its first estimate.
const PAUSE: Duration = Duration::from_millis(50);

/// Where it runs, once it does; `None` if that is not waited for any more. Whether it was waited for.
pub(super) fn seek(
    args: &ListenArgs,
    interrupt: &Interrupt,
) -> Result<Option<(Place, bool)>, ListenError> {
    let mut waits = false;
    while !interrupt.is_there() && !takes_no_more() {
        let looked = look(&args.place);
        if let Some(place) = place_of(&args.robot, &looked) {
            return Ok(Some((place, waits)));
        }
        let here = looked.here?;
        if !std::mem::replace(&mut waits, true) {
            complain(&format!(
                "coloc: {} does not run here, waiting for it in {}; {}",
                args.robot,
                here.place,
                who_else(&here, &looked.elsewhere)
            ));
        }
        outlet::pause(PAUSE);
    }
    Ok(None)
}

/// Says so if it is not the usual place.
fn place_of(robot: &RobotName, looked: &Looked) -> Option<Place> {
    let runs = |found: &&Found| found.robots.iter().any(|one| one.robot == *robot);
    if let Some(found) = looked.here.as_ref().ok().filter(runs) {
        return Some(found.place.clone());
    }
    let found = looked.elsewhere.iter().find(runs)?;
    complain(&format!("coloc: {robot} runs in {}", found.place));
    Some(found.place.clone())
}

/// Who runs instead: it may have been misspelt.
fn who_else(here: &Found, elsewhere: &[Found]) -> String {
    let here = (!here.robots.is_empty()).then(|| here.names());
    let there = elsewhere
        .iter()
        .map(|found| format!("{} in {}", found.names(), found.place));
    let all: Vec<String> = here.into_iter().chain(there).collect();
    if all.is_empty() {
        return "nobody else runs".into();
    }
    format!("who runs: {}", all.join("; "))
}
