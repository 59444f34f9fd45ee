//! Shared memory is full: before a start, in the middle of it, and when somebody joins who runs.

use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use rand::RngExt;
use rand::seq::IndexedRandom;

use crate::fault::{Outcome, fault};
use crate::files::SHARED_MEMORY;
use crate::filler::{Crowd, Filler};
use crate::fleet::{Answer, Fleet, OTHER, Started, VICTIM, Who};
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

/// What is left, at most: more than everybody needs \[bytes\].
const ROOM: u64 = 6 << 20;

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    if !stage.is_alone {
        return tally.skip("full shared memory: `unshare --mount` is not allowed here");
    }
    let mut refusals = Vec::new();
    play_rounds(
        stage,
        tally,
        stage.one_in(10, 8),
        || Fleet::with_other(stage),
        |fleet, round| {
            let left = left(round);
            let crowded = round.number % 8 == 7;
            let answer = match round.number % 3 {
                _ if crowded => crowded_out(fleet, round),
                0 => before(fleet, left, round),
                1 => within(fleet, left, round),
                _ => later(fleet, left, round),
            };
            let about = if crowded {
                "few files"
            } else {
                &format!("{left} bytes left")
            };
            if let Answer::Refuses(words) = answer.map_err(|fault| fault.after(about))? {
                refusals.push(words);
            }
            recovered(fleet, round).map_err(|fault| fault.after("with room again"))
        },
        |fleet, tally| {
            tally.ends.extend(fleet.end()?);
            Ok(())
        },
    );
    tally.refusals(&refusals);
}

/// Round numbers are as likely as any other.
fn left(round: &mut Round<'_>) -> u64 {
    let any = round.chance.random_range(0..ROOM);
    *[0, 4096, 65536, 1 << 20, 4 << 20, any, any, any]
        .choose(&mut round.chance)
        .expect("there are some")
}

fn fill(left: u64) -> Filler {
    Filler::leaving(Path::new(SHARED_MEMORY), left)
}

/// Full when it comes.
fn before(fleet: &mut Fleet, left: u64, round: &mut Round<'_>) -> Outcome<Answer> {
    let who = Who::any(&mut round.chance);
    let _full = fill(left);
    let mut newcomer = fleet.start(who, VICTIM);
    let answer = fleet.answers_or_refuses(&mut newcomer)?;
    fleet.other_goes_on()?;
    leave(newcomer, &answer, round)?;
    Ok(answer)
}

/// It becomes full while it starts.
fn within(fleet: &mut Fleet, left: u64, round: &mut Round<'_>) -> Outcome<Answer> {
    let who = Who::any(&mut round.chance);
    let _nearly = fill(ROOM);
    let mut newcomer = fleet.start(who, VICTIM);
    sleep(Duration::from_micros(round.chance.random_range(0..60_000)));
    let rest = Path::new(SHARED_MEMORY).join("rest");
    std::fs::create_dir_all(&rest).unwrap();
    let _full = Filler::leaving(&rest, left);
    let answer = fleet.answers_or_refuses(&mut newcomer)?;
    fleet.other_goes_on()?;
    leave(newcomer, &answer, round)?;
    Ok(answer)
}

/// There is room, but not for another file, or not for many.
fn crowded_out(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome<Answer> {
    let left = round.chance.random_range(0..40);
    let crowd = Crowd::leaving(Path::new(SHARED_MEMORY), left);
    let mut newcomer = fleet.start(Who::any(&mut round.chance), VICTIM);
    let answer = fleet.answers_or_refuses(&mut newcomer)?;
    fleet.other_goes_on()?;
    leave(newcomer, &answer, round)?;
    drop(crowd);
    Ok(answer)
}

/// It becomes full while two robots run; then somebody joins.
fn later(fleet: &mut Fleet, left: u64, round: &mut Round<'_>) -> Outcome<Answer> {
    let mut robot = fleet.start(Who::Daemon, VICTIM);
    fleet.answers(&mut robot)?;
    let full = fill(left);
    let who = [Who::Reader, Who::Feeder][round.chance.random_range(0..2)];
    let mut newcomer = fleet.start(who, VICTIM);
    let answer = fleet.answers_or_refuses(&mut newcomer)?;
    leave(newcomer, &answer, round)?;
    robot.program.look()?;
    if !fleet.ticks_now(VICTIM) {
        fault!("robot1 does not tick any more{}", robot.program.evidence());
    }
    fleet.other_goes_on()?;
    drop(full);
    round.tally.ends.push(robot.program.terminate()?);
    Ok(answer)
}

fn leave(mut newcomer: Started, answer: &Answer, round: &mut Round<'_>) -> Outcome {
    if matches!(answer, Answer::Works) {
        round.tally.ends.push(newcomer.program.terminate()?);
    }
    Ok(())
}

/// With room again, everything works.
fn recovered(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    let _ = std::fs::remove_dir_all(Path::new(SHARED_MEMORY).join("rest"));
    let mut listener = fleet.start_listener(OTHER);
    fleet.answers(&mut listener)?;
    round.tally.ends.push(listener.program.terminate()?);
    fleet.recovers(Who::Daemon, Duration::from_millis(50), round)
}
