//! Everybody dies at once, and files are damaged, as a power cut does: the next start works, and says what it removed.

use std::fs::{self, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rustix::process::Signal;

use crate::fault::{Outcome, fault};
use crate::fleet::{Fleet, OTHER, VICTIM, Who};
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    play_rounds(
        stage,
        tally,
        stage.one_in(6, 6),
        || Fleet::new(stage),
        power_cut,
        |fleet, _| fleet.nothing_left(),
    );
}

fn power_cut(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    die_together(fleet, round)?;
    let harmed = fleet
        .files_and_beliefs()
        .iter()
        .filter(|path| harm(path, &mut round.chance))
        .count();
    if round.chance.random() {
        // The daemon is the first to come, and must say what it found.
        let mut first = fleet.start(Who::Daemon, OTHER);
        fleet.start_witness()?;
        round.tally.restarts.push(fleet.answers(&mut first)?);
        if harmed > 0 && !first.program.said().contains("remov") {
            fault!(
                "robot2 did not say what it removed{}",
                first.program.words()
            );
        }
        round.tally.ends.push(first.program.terminate()?);
    } else {
        fleet.start_witness()?;
    }
    let mut second = fleet.start(Who::Daemon, VICTIM);
    round.tally.restarts.push(fleet.answers(&mut second)?);
    round.tally.ends.push(second.program.terminate()?);
    fleet.end_witness()?;
    fleet.nothing_left()
}

/// Some were running, some were just starting.
fn die_together(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    let mut all = vec![fleet.start(Who::Daemon, OTHER)];
    sleep(Duration::from_millis(round.chance.random_range(0..150)));
    all.extend(Who::ALL.map(|who| fleet.start(who, VICTIM)));
    sleep(Duration::from_millis(round.chance.random_range(0..150)));
    for one in &all {
        one.program.signal(Signal::KILL);
    }
    all.iter_mut().try_for_each(|one| one.program.kill())
}

/// Truncates, empties, overwrites or removes it, or leaves it; whether it did something.
fn harm(path: &Path, chance: &mut ChaCha8Rng) -> bool {
    let Ok(metadata) = fs::metadata(path) else {
        return false;
    };
    let length = metadata.len();
    let file = || OpenOptions::new().write(true).open(path);
    // What cannot be opened because of its mode is damaged all the same: root can.
    let result = match chance.random_range(0..10) {
        0..3 => file().and_then(|file| file.set_len(chance.random_range(0..=length))),
        3 => file().and_then(|file| file.set_len(0)),
        4 => file().and_then(|file| file.write_all_at(&zeros(length), 0)),
        5 => {
            let mut noise = zeros(length);
            chance.fill(&mut noise[..]);
            file().and_then(|file| file.write_all_at(&noise, 0))
        }
        6 => fs::remove_file(path),
        _ => return false,
    };
    result.is_ok()
}

/// A power cut spoils the first pages of a file as well as all of it.
fn zeros(length: u64) -> Vec<u8> {
    vec![0; usize::try_from(length.min(1 << 20)).unwrap()]
}
