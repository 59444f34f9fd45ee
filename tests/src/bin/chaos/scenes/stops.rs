//! Whoever is stopped, in the middle of its start or of its life, holds nobody up, and goes on afterwards.

use std::ops::Range;
use std::thread::sleep;
use std::time::{Duration, Instant};

use rand::RngExt;
use rustix::process::Signal;

use crate::fault::{Outcome, fault};
use crate::fleet::{Answer, Fleet, Harm, OTHER, Started, VICTIM, Who};
use crate::parts::CountFrom;
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

use super::start::start_time;

/// How long somebody stands still \[ms\].
const STILL_MS: Range<u64> = 100..3000;
/// More than a start has.
const STOPS: u64 = 1600;

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    play_rounds(
        stage,
        tally,
        stage.one_in(15, 6),
        || {
            let mut fleet = Fleet::with_other(stage)?;
            Ok((start_time(&mut fleet)?, fleet))
        },
        |(start, fleet), round| match round.number % 3 {
            0 => in_life(fleet, round),
            1 => in_start(*start, fleet, round),
            _ => at_a_call(fleet, round),
        },
        |(_, fleet), tally| {
            tally.ends.extend(fleet.end()?);
            Ok(())
        },
    );
}

/// Stopped while it runs.
fn in_life(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    let who = Who::any(&mut round.chance);
    let mut victim = fleet.start(who, VICTIM);
    fleet.answers(&mut victim)?;
    sleep(Duration::from_millis(round.chance.random_range(0..100)));
    stand_still(fleet, &victim, round)?;
    goes_on(fleet, victim, round)
}

/// Stopped at any moment of its start.
fn in_start(start: Duration, fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    let who = Who::any(&mut round.chance);
    let victim = fleet.start(who, VICTIM);
    sleep(start.mul_f64(round.chance.random()));
    stand_still(fleet, &victim, round)?;
    goes_on(fleet, victim, round)
}

fn stand_still(fleet: &mut Fleet, victim: &Started, round: &mut Round<'_>) -> Outcome {
    let still = Duration::from_millis(round.chance.random_range(STILL_MS));
    victim.program.signal(Signal::STOP);
    let result = meanwhile(fleet, still, round);
    victim.program.signal(Signal::CONT);
    result
}

/// Held at a system call of its start: by the one that traces it, so that it is exact.
fn at_a_call(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    let who = Who::any(&mut round.chance);
    let still = Duration::from_millis(round.chance.random_range(STILL_MS));
    let stop = round.chance.random_range(200..STOPS);
    let mut victim = fleet.start_harmed(who, CountFrom::Start, Some(stop), Harm::Hold(still));
    sleep(Duration::from_millis(100)); // About when it comes to it.
    meanwhile(fleet, still, round)
        .map_err(|fault| fault.after(&format!("{who:?} held at stop {stop}")))?;
    let _ = fleet.answers_at_last(&mut victim)?;
    victim.program.kill()
}

/// While somebody stands still: the other robot ticks, and who comes is served or sent away.
fn meanwhile(fleet: &mut Fleet, still: Duration, round: &mut Round<'_>) -> Outcome {
    fleet.watch().take_book(OTHER);
    let begun = Instant::now();
    let mut newcomer = fleet.start_listener(OTHER);
    fleet.answers(&mut newcomer)?;
    round.tally.ends.push(newcomer.program.terminate()?);
    // This one asks for what the other may be in the middle of making.
    let mut newcomer = fleet.start(Who::Reader, VICTIM);
    if let Answer::Works = fleet.answers_or_refuses(&mut newcomer)? {
        round.tally.ends.push(newcomer.program.terminate()?);
    }
    sleep(still.saturating_sub(begun.elapsed()));
    fleet.other_goes_on().map(drop)
}

/// Answers, still or again, and ends when it is told to.
fn goes_on(fleet: &mut Fleet, mut victim: Started, round: &mut Round<'_>) -> Outcome {
    match victim.who {
        Who::Daemon if !fleet.ticks_now(VICTIM) => {
            fault!(
                "robot1 is not heard after it was stopped{}",
                victim.program.evidence()
            );
        }
        _ => victim.program.look()?,
    }
    round.tally.ends.push(victim.program.terminate()?);
    Ok(())
}
