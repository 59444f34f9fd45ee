//! The disk is full that has the space's root, logs, recordings and beliefs.

use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use coloc_daemon::config::{Config, LogLevel};
use rand::RngExt;
use rand::seq::IndexedRandom;

use crate::alone::{mount_memory, unmount};
use crate::fault::{Outcome, fault};
use crate::filler::Filler;
use crate::fleet::{Answer, Fleet, Started, VICTIM, Who};
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

const DISK_KIB: u64 = 4096;
/// What is left, at most \[bytes\].
const ROOM: u64 = 1 << 16;

/// Log and recording are on the disk too.
fn settings(config: &mut Config, at: &Path) {
    let name = config.robot.name.clone();
    config.telemetry.log = LogLevel::Debug;
    config.telemetry.log_file = at.join(format!("{name}.log"));
    config.telemetry.record = at.join(format!("{name}.record"));
}

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    if !stage.is_alone {
        return tally.skip("a full disk: `unshare --mount` is not allowed here");
    }
    let mut refusals = Vec::new();
    play_rounds(
        stage,
        tally,
        stage.one_in(15, 4),
        || Ok(()),
        |(), round| {
            let disk = Disk::new(stage)?;
            refusals.extend(disk.fills_up(round)?);
            Ok(())
        },
        |(), _| Ok(()),
    );
    tally.refusals(&refusals);
}

/// A fleet on a small disk of its own.
struct Disk(Option<Fleet>);

impl Disk {
    fn new(stage: &Stage) -> Outcome<Self> {
        let fleet = Fleet::with_settings(stage, settings)?;
        mount_memory(fleet.directory.path(), DISK_KIB);
        Ok(Self(Some(fleet.joined_by_other()?)))
    }

    /// What was said by whoever did not start.
    fn fills_up(mut self, round: &mut Round<'_>) -> Outcome<Option<String>> {
        let mut fleet = self.0.take().expect("just made");
        let place = fleet.directory.path().to_owned();
        let result = fills_up(&mut fleet, round);
        let result = result.and_then(|said| {
            round.tally.ends.extend(fleet.end()?);
            Ok(said)
        });
        unmount(&place);
        result
    }
}

fn fills_up(fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome<Option<String>> {
    let left = *[0, 4096, round.chance.random_range(0..ROOM)]
        .choose(&mut round.chance)
        .expect("there are some");
    let who = Who::any(&mut round.chance);
    let runs_before = round.chance.random::<bool>();
    let mut robot = runs_before.then(|| fleet.start(Who::Daemon, VICTIM));
    if let Some(robot) = &mut robot {
        fleet.answers(robot)?;
    }
    let who = if runs_before && who == Who::Daemon {
        Who::Reader
    } else {
        who
    };
    let full = Filler::leaving(fleet.directory.path(), left);
    let mut newcomer = fleet.start(who, VICTIM);
    let answer = fleet.answers_or_refuses(&mut newcomer)?;
    sleep(Duration::from_millis(300)); // Logs and recordings meet the end of the disk.
    fleet.other_goes_on()?;
    if let Some(robot) = &mut robot {
        ticks(fleet, robot)?;
    }
    if matches!(answer, Answer::Works) {
        round.tally.ends.push(newcomer.program.terminate()?);
    }
    if round.chance.random()
        && let Some(mut robot) = robot.take()
    {
        round.tally.ends.push(robot.program.terminate()?); // While it is full.
    }
    drop(full);
    if let Some(mut robot) = robot {
        ticks(fleet, &mut robot)?;
        round.tally.ends.push(robot.program.terminate()?);
    }
    let mut again = fleet.start(Who::Daemon, VICTIM);
    round.tally.restarts.push(fleet.answers(&mut again)?);
    round.tally.ends.push(again.program.terminate()?);
    Ok(match answer {
        Answer::Works => None,
        Answer::Refuses(words) => Some(words),
    })
}

fn ticks(fleet: &Fleet, robot: &mut Started) -> Outcome {
    robot.program.look()?;
    robot.program.no_panic()?;
    if fleet.ticks_now(VICTIM) {
        return Ok(());
    }
    fault!("robot1 does not tick any more{}", robot.program.evidence())
}
