//! Kills at the entry and at the exit of every system call of start, and of end.
//!
//! The number of a round is the number of the stop: two for each call, of all threads together.

use std::time::{Duration, Instant};

use rand::RngExt;
use rustix::process::Signal;

use crate::bars::Bar;
use crate::fault::{Fault, Outcome, fault};
use crate::fleet::{Fleet, Harm, Started, Who};
use crate::parts::CountFrom;
use crate::program::{END, signal_pid};
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

/// Within which a traced program comes to the call, or not at all.
const REACHED: Duration = Duration::from_secs(5);
/// Within which it does what comes next.
pub(super) const NEXT: Bar = Bar(Duration::from_secs(5));

pub(crate) fn daemon_start(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Daemon, CountFrom::Start, Harm::Kill);
}

pub(crate) fn reader_start(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Reader, CountFrom::Start, Harm::Kill);
}

pub(crate) fn feeder_start(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Feeder, CountFrom::Start, Harm::Kill);
}

pub(crate) fn daemon_end(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Daemon, CountFrom::Term, Harm::Kill);
}

/// SIGTERM instead of kill -9: it must end, at once.
pub(crate) fn term_in_start(stage: &Stage, tally: &mut Tally) {
    play(stage, tally, Who::Daemon, CountFrom::Start, Harm::Term);
}

fn play(stage: &Stage, tally: &mut Tally, who: Who, from: CountFrom, harm: Harm) {
    let stops = Fleet::with_other(stage).and_then(|mut fleet| count(&mut fleet, who, from));
    let mut missed = 0;
    play_stops(
        stage,
        tally,
        stops,
        || Fleet::with_other(stage),
        |fleet, round| {
            missed += u32::from(!harm_at(fleet, who, from, harm, round)?);
            Ok(())
        },
        |fleet, tally| {
            tally.figures.push(fleet.litter.figures());
            tally.ends.extend(fleet.end()?);
            Ok(())
        },
    );
    if missed > 0 {
        tally.figures.push(format!("{missed} not reached"));
    }
}

/// Rounds whose numbers are those of stops, of so many.
pub(super) fn play_stops<S>(
    stage: &Stage,
    tally: &mut Tally,
    stops: Outcome<u32>,
    set_up: impl Fn() -> Outcome<S>,
    round: impl FnMut(&mut S, &mut Round<'_>) -> Outcome,
    end: impl FnOnce(S, &mut Tally) -> Outcome,
) {
    match stops {
        Ok(stops) => {
            tally.figures.push(format!("of {stops} stops"));
            let numbers = chosen(stage, tally.scene, stops);
            play_rounds(stage, tally, numbers, set_up, round, end);
        }
        Err(fault) => tally.note(stage, 0, Err(fault)),
    }
}

/// All, or as many as there are kills, spread evenly.
fn chosen(stage: &Stage, scene: &str, stops: u32) -> Vec<u32> {
    if let Some(round) = stage.round {
        return vec![round];
    }
    let wanted = (stage.kills / 6).max(4);
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
    let mut traced = fleet.start_traced(who, from, None);
    let pid = pid(&traced)?;
    fleet.answers_at_last(&mut traced)?;
    signal_pid(pid, Signal::TERM);
    counted(&traced, from)
}

/// What the tracer of one that gets SIGTERM says.
pub(super) fn counted(traced: &Started, from: CountFrom) -> Outcome<u32> {
    let at_term = traced.program.line("term ", NEXT.patience())?;
    let line = match from {
        CountFrom::Start => at_term,
        CountFrom::Term => traced.program.line("ended after ", NEXT.patience())?,
    };
    let number = line.split(' ').next().unwrap_or_default();
    number
        .parse()
        .map_err(|_| Fault::new(format!("`{number}` is no number")))
}

pub(super) fn pid(traced: &Started) -> Outcome<u32> {
    let line = traced.program.line("pid ", NEXT.patience())?;
    line.parse()
        .map_err(|_| Fault::new(format!("`{line}` is no process")))
}

/// Whether it came to that stop.
fn harm_at(
    fleet: &mut Fleet,
    who: Who,
    from: CountFrom,
    harm: Harm,
    round: &mut Round<'_>,
) -> Outcome<bool> {
    let mut traced = fleet.start_harmed(who, from, Some(round.number.into()), harm);
    if from == CountFrom::Term {
        let pid = pid(&traced)?;
        fleet.answers_at_last(&mut traced)?;
        signal_pid(pid, Signal::TERM);
    }
    let at = harmed(&mut traced)?;
    let about = format!("{who:?}, {harm:?} at stop {}", at.as_deref().unwrap_or("?"));
    if matches!(harm, Harm::Term) && at.is_some() {
        let took = ended(&mut traced).map_err(|fault| fault.after(&about))?;
        round.tally.ends.push(took);
    }
    traced.program.wait(NEXT.patience())?;
    traced.program.no_panic()?;
    fleet
        .recovers(who, Duration::from_millis(50), round)
        .map_err(|fault| fault.after(&about))?;
    Ok(at.is_some())
}

/// Where it was harmed. A program of several threads does not take the same way each time: then it ends here.
pub(super) fn harmed(traced: &mut Started) -> Outcome<Option<String>> {
    let at = traced.program.line_if_any("harmed ", REACHED);
    if at.is_none() {
        traced.program.kill()?;
    }
    Ok(at)
}

/// After SIGTERM: in good order, and soon.
fn ended(traced: &mut Started) -> Outcome<Duration> {
    let begun = Instant::now();
    let line = traced.program.line("ended after ", NEXT.patience())?;
    let took = begun.elapsed();
    let words = traced.program.words();
    if !line.ends_with("status 0") && !line.ends_with("SIGTERM") {
        fault!("ended after {line}{words}");
    }
    END.hold(took, || format!("took {took:?} to end{words}"))?;
    Ok(took)
}
