//! Kills at every system call of a start and of an end with nobody else alive: then everything is cleaned up, and is to be
//! cleaned up by the next one if this one dies over it.

use std::thread::sleep;
use std::time::Duration;

use rustix::process::Signal;

use super::calls::{NEXT, counted, harmed, pid, play_stops};
use crate::fault::Outcome;
use crate::fleet::{Fleet, OTHER, Started, VICTIM, Who};
use crate::parts::CountFrom;
use crate::program::signal_pid;
use crate::rounds::Round;
use crate::stage::Stage;
use crate::tally::Tally;

/// More than a start takes.
const STARTED: Duration = Duration::from_millis(300);

pub(crate) fn start(stage: &Stage, tally: &mut Tally) {
    let stops = Fleet::new(stage).and_then(|mut fleet| {
        leave_files(&mut fleet)?;
        let traced = fleet.start_traced(Who::Daemon, CountFrom::Start, None);
        let pid = pid(&traced)?;
        sleep(STARTED);
        signal_pid(pid, Signal::TERM);
        counted(&traced, CountFrom::Start)
    });
    play_stops(
        stage,
        tally,
        stops,
        || Fleet::new(stage),
        |fleet, round| {
            leave_files(fleet)?;
            let at = Some(round.number.into());
            let traced = fleet.start_traced(Who::Daemon, CountFrom::Start, at);
            comes_back(fleet, traced, round)
        },
        |fleet, _| fleet.nothing_left(),
    );
}

pub(crate) fn end(stage: &Stage, tally: &mut Tally) {
    let stops = Fleet::new(stage).and_then(|mut fleet| {
        let traced = last(&mut fleet, None)?;
        counted(&traced, CountFrom::Term)
    });
    play_stops(
        stage,
        tally,
        stops,
        || Fleet::new(stage),
        |fleet, round| {
            let traced = last(fleet, Some(round.number.into()))?;
            comes_back(fleet, traced, round)
        },
        |fleet, _| fleet.nothing_left(),
    );
}

/// Of a robot that was killed.
fn leave_files(fleet: &mut Fleet) -> Outcome {
    let mut dead = fleet.start(Who::Daemon, OTHER);
    sleep(STARTED / 4);
    dead.program.kill()
}

/// Gets SIGTERM, and is alone then: the witness has been killed.
fn last(fleet: &mut Fleet, at: Option<u64>) -> Outcome<Started> {
    fleet.start_witness()?;
    let mut traced = fleet.start_traced(Who::Daemon, CountFrom::Term, at);
    let pid = pid(&traced)?;
    fleet.answers_at_last(&mut traced)?;
    fleet.end_witness()?;
    signal_pid(pid, Signal::TERM);
    Ok(traced)
}

fn comes_back(fleet: &mut Fleet, mut traced: Started, round: &mut Round<'_>) -> Outcome {
    let at = harmed(&mut traced)?.unwrap_or_default();
    traced.program.wait(NEXT.patience())?;
    let result = answers_and_leaves(fleet, round);
    result.map_err(|fault| fault.after(&format!("killed at stop {at}")))
}

fn answers_and_leaves(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    fleet.start_witness()?;
    let mut again = fleet.start(Who::Daemon, VICTIM);
    round.tally.restarts.push(fleet.answers(&mut again)?);
    round.tally.ends.push(again.program.terminate()?);
    fleet.end_witness()?;
    fleet.nothing_left()
}
