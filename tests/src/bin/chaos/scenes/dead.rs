//! Whoever dies leaves files, and a power cut spoils them: the next start works, and says what it removed.

use std::thread::sleep;
use std::time::Duration;

use rand::RngExt;
use rand::seq::IndexedRandom;
use rustix::process::Signal;

use crate::fault::{Outcome, fault};
use crate::files::Entry;
use crate::fleet::{ANSWER, Fleet, OTHER, Started, VICTIM, Who};
use crate::harm::{spoil, unmake};
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

/// Everybody dies at once.
pub(crate) fn all(stage: &Stage, tally: &mut Tally) {
    play_rounds(
        stage,
        tally,
        stage.one_in(6, 6),
        || Fleet::new(stage),
        power_cut,
        |fleet, _| fleet.nothing_left(),
    );
}

/// One robot, its reader and its feeder die, and one of their files is as if they had just begun to make it; the other
/// robot lives.
pub(crate) fn some(stage: &Stage, tally: &mut Tally) {
    play_rounds(
        stage,
        tally,
        stage.one_in(6, 6),
        || Fleet::with_other(stage),
        half_a_power_cut,
        |fleet, tally| {
            tally.figures.push(fleet.litter.figures());
            tally.ends.extend(fleet.end()?);
            Ok(())
        },
    );
}

fn power_cut(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    let other = fleet.start(Who::Daemon, OTHER);
    sleep(moment(round));
    die_together(fleet, vec![other], round)?;
    let left = fleet.files_and_beliefs();
    let spoiled = left.iter().filter(|path| spoil(path, &mut round.chance));
    let spoiled = spoiled.count();
    if round.chance.random() {
        is_first(fleet, spoiled > 0, round)?;
    } else {
        fleet.start_witness()?;
    }
    let mut second = fleet.start(Who::Daemon, VICTIM);
    round.tally.restarts.push(fleet.answers(&mut second)?);
    round.tally.ends.push(second.program.terminate()?);
    fleet.end_witness()?;
    fleet.nothing_left()
}

/// The daemon that comes first must say what it found.
fn is_first(fleet: &mut Fleet, found: bool, round: &mut Round<'_>) -> Outcome {
    let mut first = fleet.start(Who::Daemon, OTHER);
    first.program.says("running", ANSWER.patience())?;
    fleet.start_witness()?;
    round.tally.restarts.push(fleet.answers(&mut first)?);
    if found && !first.program.said().contains("remov") {
        fault!(
            "robot2 did not say what it removed{}",
            first.program.words()
        );
    }
    round.tally.ends.push(first.program.terminate()?);
    Ok(())
}

fn half_a_power_cut(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    die_together(fleet, Vec::new(), round)?;
    let held = fleet.held();
    let of_the_dead = |entry: &Entry| !held.contains(&entry.inode) && !fleet.litter.is_kept(entry);
    let files: Vec<Entry> = fleet.files().into_iter().filter(of_the_dead).collect();
    let one = files.choose(&mut round.chance);
    let about = one.map_or_else(String::new, |entry| entry.path.display().to_string());
    if let Some(entry) = one {
        unmake(&entry.path, fleet.aside(entry), &mut round.chance);
    }
    fleet
        .recovers(Who::Daemon, Duration::from_millis(50), round)
        .map_err(|fault| fault.after(&about))
}

/// Some are running, some are just starting.
fn die_together(fleet: &mut Fleet, mut all: Vec<Started>, round: &mut Round<'_>) -> Outcome {
    all.extend(Who::ALL.map(|who| fleet.start(who, VICTIM)));
    sleep(moment(round));
    for one in &all {
        one.program.signal(Signal::KILL);
    }
    all.iter_mut().try_for_each(|one| one.program.kill())
}

fn moment(round: &mut Round<'_>) -> Duration {
    Duration::from_millis(round.chance.random_range(0..150))
}
