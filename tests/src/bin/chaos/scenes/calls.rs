//! Kills at the entry and at the exit of every system call of start, and of end.
//!
//! The number of a round is the number of the stop: two for each call, of all threads together.

use std::time::Duration;

use rand::RngExt;
use rustix::process::Signal;

use crate::fault::{Fault, Outcome};
use crate::fleet::{Fleet, Started, Who};
use crate::parts::CountFrom;
use crate::program::signal_pid;
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

/// Within which a traced program comes to the call.
const PATIENCE: Duration = Duration::from_secs(5);

pub(crate) fn daemon_start(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Daemon, CountFrom::Start);
}

pub(crate) fn reader_start(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Reader, CountFrom::Start);
}

pub(crate) fn feeder_start(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Feeder, CountFrom::Start);
}

pub(crate) fn daemon_end(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Daemon, CountFrom::Term);
}

fn play(stage: &Stage, tally: &mut Tally, who: Who, from: CountFrom) {
    let stops = Fleet::with_other(stage).and_then(|mut fleet| count(&mut fleet, who, from));
    let stops = match stops {
        Ok(stops) => stops,
        Err(fault) => return tally.note(stage, 0, Err(fault)),
    };
    let one = stage.round.map(|round| vec![round]);
    let mut missed = 0;
    play_rounds(
        stage,
        tally,
        one.unwrap_or_else(|| chosen(stage, tally.scene, stops)),
        || Fleet::with_other(stage),
        |fleet, round| {
            missed += u32::from(!kill_at(fleet, who, from, round)?);
            Ok(())
        },
        |fleet, tally| {
            tally.figures.push(fleet.litter.figures());
            tally.ends.extend(fleet.end()?);
            Ok(())
        },
    );
    let figures = format!("of {stops} stops, {missed} not reached");
    tally.figures.push(figures);
}

/// All, or as many as there are kills, spread evenly.
fn chosen(stage: &Stage, scene: &str, stops: u32) -> Vec<u32> {
    let wanted = (stage.kills / 4).max(4);
    if stage.every_call || wanted >= stops {
        return (1..=stops).collect();
    }
    let mut chance = stage.chance(scene, 0);
    (0..wanted)
        .map(|index| {
            let [first, next] = [index, index + 1].map(|index| 1 + stops * index / wanted);
            chance.random_range(first..next)
        })
        .collect()
}

/// How many stops there are until it answers, or from SIGTERM to its end.
fn count(fleet: &mut Fleet, who: Who, from: CountFrom) -> Outcome<u32> {
    let mut traced = fleet.start_traced(who, from, None, None);
    let pid = pid(&traced)?;
    fleet.answers_at_last(&mut traced)?;
    signal_pid(pid, Signal::TERM);
    let at_term = traced.program.line("term ", PATIENCE)?;
    let number = match from {
        CountFrom::Start => at_term,
        CountFrom::Term => first_word(&traced.program.line("ended after ", PATIENCE)?),
    };
    number
        .parse()
        .map_err(|_| Fault::new(format!("`{number}` is no number")))
}

fn first_word(line: &str) -> String {
    line.split(' ').next().unwrap_or_default().into()
}

pub(crate) fn pid(traced: &Started) -> Outcome<u32> {
    let line = traced.program.line("pid ", PATIENCE)?;
    line.parse()
        .map_err(|_| Fault::new(format!("`{line}` is no process")))
}

/// Whether it came to that stop.
fn kill_at(fleet: &mut Fleet, who: Who, from: CountFrom, round: &mut Round<'_>) -> Outcome<bool> {
    let mut traced = fleet.start_traced(who, from, Some(round.number.into()), None);
    if from == CountFrom::Term {
        let pid = pid(&traced)?;
        fleet.answers_at_last(&mut traced)?;
        signal_pid(pid, Signal::TERM);
    }
    // A program of several threads does not take the same way each time.
    let harmed = traced.program.line("harmed ", PATIENCE);
    if harmed.is_err() {
        traced.program.kill()?;
    }
    traced.program.wait(PATIENCE)?;
    traced.program.no_panic()?;
    let start = Duration::from_millis(50);
    let about = harmed.as_deref().unwrap_or("not reached");
    fleet
        .recovers(who, start, round)
        .map_err(|fault| fault.after(&format!("{who:?} killed at stop {about}")))?;
    Ok(harmed.is_ok())
}
