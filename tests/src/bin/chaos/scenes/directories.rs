//! Directories of a running fleet are deleted, moved away and replaced.
//!
//! Who is inside notices: it heals what was lost, or ends with a status and a sentence. Nobody is run twice.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use coloc_daemon::config::Config;
use coloc_drivers::can::{BusSpec, Sender};
use coloc_drivers::encoder::{OdometryConfig, WheelFrames};
use rand::seq::IndexedRandom;

use crate::bars::Bar;
use crate::fault::{Outcome, fault};
use crate::fleet::{ANSWER, Fleet, Started, VICTIM, Who};
use crate::program::Program;
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

const ROOT: &str = "shm";
/// Below the fleet's directory.
const TARGETS: [&str; 6] = [
    ROOT,
    "shm/nodes",
    "shm/services",
    "shm/claims",
    "bus",
    "state",
];
/// Within which whoever is inside has noticed, and has done something about it.
const NOTICED: Bar = Bar(Duration::from_millis(1500));
/// Of ticks, and of frames.
const PERIOD: Duration = Duration::from_millis(20);
const METRES_PER_TICK: f64 = 1e-4;

fn settings(config: &mut Config, at: &Path) {
    let bus = BusSpec::Local {
        directory: at.join("bus"),
    };
    let odometry = OdometryConfig::differential(bus, 0.3, METRES_PER_TICK, 5.0);
    config.odometry = Some(odometry);
    config.telemetry.state_file = at.join(format!("state/{}.belief.toml", config.robot.name));
}

#[derive(Copy, Clone, Debug)]
enum Deed {
    Delete,
    MoveAway,
    Empty,
    File,
    Link,
}

const DEEDS: [Deed; 5] = [
    Deed::Delete,
    Deed::MoveAway,
    Deed::Empty,
    Deed::File,
    Deed::Link,
];

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    play_rounds(
        stage,
        tally,
        stage.one_in(10, 6),
        || Ok(()),
        |(), round| {
            let target = TARGETS[round.number as usize % TARGETS.len()];
            let deed = *DEEDS.choose(&mut round.chance).expect("there are some");
            robbed(stage, target, deed, round)
                .map_err(|fault| fault.after(&format!("{target}: {deed:?}")))
        },
        |(), _| Ok(()),
    );
}

fn robbed(stage: &Stage, target: &str, deed: Deed, round: &mut Round<'_>) -> Outcome {
    let fleet = Fleet::with_settings(stage, settings)?;
    fs::create_dir(fleet.directory.path().join("state")).unwrap();
    let mut fleet = fleet.joined_by_other()?;
    let mut robot = fleet.start(Who::Daemon, VICTIM);
    fleet.answers(&mut robot)?;
    let said_before = robot.program.said().len();
    deed.does(&fleet.directory.path().join(target));
    sleep(NOTICED.0);
    let speaks = |program: &Program| program.said().len() > said_before;
    if robot.program.ended().is_none()
        && !speaks(&robot.program)
        && !lost_nothing(target, fleet.directory.path(), &robot)?
        && !robot.program.ends_or(NOTICED.beyond(), speaks)
    {
        fault!("robot1 goes on and does not say anything");
    }
    let has_ended = !heard(&mut fleet, &mut robot, round)?;
    if has_ended && let (ROOT, Deed::File) = (target, deed) {
        is_refused_until_removed(&fleet)?;
    }
    second(&mut fleet, &mut robot, has_ended, round)?;
    if !has_ended {
        round.tally.ends.push(robot.program.terminate()?);
    }
    Ok(())
}

/// Whether all is as before, so that there is nothing to say.
fn lost_nothing(target: &str, directory: &Path, robot: &Started) -> Outcome<bool> {
    match target {
        // Nobody else can run, which is tried below.
        "shm/claims" => Ok(true),
        "state" => Ok(comes_back(&directory.join("state/robot1.belief.toml"))),
        "bus" => hears_the_wheels(&directory.join("bus"), robot).map(|()| true),
        _ => Ok(false),
    }
}

/// Saved once a second.
fn comes_back(file: &Path) -> bool {
    // A link still leads to the old one.
    let _ = fs::remove_file(file);
    let deadline = Instant::now() + ANSWER.patience();
    while !file.exists() && Instant::now() < deadline {
        sleep(PERIOD);
    }
    file.exists()
}

/// Whoever sends frames now is heard.
fn hears_the_wheels(bus: &Path, robot: &Started) -> Outcome {
    let mut frames = WheelFrames::new(METRES_PER_TICK);
    let spec = BusSpec::Local {
        directory: bus.into(),
    };
    let heard = || robot.program.said().contains("odometry: ");
    let deadline = Instant::now() + ANSWER.patience();
    while !heard() && Instant::now() < deadline {
        if let Ok(mut sender) = Sender::open(&spec) {
            for frame in frames.encode(0.0, 0.0) {
                let _ = sender.send(&frame);
            }
        }
        sleep(PERIOD);
    }
    if heard() {
        return Ok(());
    }
    fault!("robot1 says nothing, and does not hear its wheels any more")
}

/// What a person has put into the place of the root is not taken away; they are told to.
fn is_refused_until_removed(fleet: &Fleet) -> Outcome {
    let mut again = fleet.start(Who::Daemon, VICTIM);
    let status = again.program.wait(ANSWER.patience())?;
    let words = again.program.refused(status)?;
    if !words.contains("is not a directory: remove it") {
        fault!("it does not say what to do: {words}");
    }
    fs::remove_file(fleet.root()).unwrap();
    Ok(())
}

/// Who has healed is heard by who comes now, or has ended in good order.
fn heard(fleet: &mut Fleet, robot: &mut Started, round: &mut Round<'_>) -> Outcome<bool> {
    let mut listener = fleet.start_listener(VICTIM);
    let is_heard = |_: &Program| listener.program.line_if_any("ready", PERIOD).is_some();
    let settled = robot.program.ends_or(ANSWER.patience(), is_heard);
    if let Some(status) = robot.program.ended() {
        robot.program.refused(status)?;
        return Ok(false);
    }
    robot.program.no_panic()?;
    if !settled {
        fault!(
            "robot1 lives, and nobody who comes now hears it{}{}",
            robot.program.words(),
            listener.program.evidence()
        );
    }
    round.tally.ends.push(listener.program.terminate()?);
    Ok(true)
}

/// A second daemon of the same robot.
fn second(
    fleet: &mut Fleet,
    first: &mut Started,
    first_has_ended: bool,
    round: &mut Round<'_>,
) -> Outcome {
    let mut second = fleet.start(Who::Daemon, VICTIM);
    sleep(NOTICED.0);
    // Whoever is to be refused may take longer to find out.
    let ends = |_: &Program| first.program.ended().is_some();
    let _ = second.program.ends_or(NOTICED.beyond(), ends);
    match (second.program.ended(), first.program.ended().is_some()) {
        (None, false) => fault!("robot1 runs twice"),
        (Some(status), false) => second.program.refused(status).map(drop),
        (Some(status), true) => {
            let words = second.program.refused(status)?;
            if first_has_ended {
                fault!("robot1 does not start again: {words}");
            }
            Ok(())
        }
        (None, true) => {
            round.tally.ends.push(second.program.terminate()?);
            Ok(())
        }
    }
}

impl Deed {
    fn does(self, target: &Path) {
        let away = |to: &str| {
            let moved: PathBuf = target.with_extension(to);
            fs::rename(target, &moved).unwrap();
            moved
        };
        match self {
            Self::Delete => fs::remove_dir_all(target).unwrap(),
            Self::MoveAway => drop(away("away")),
            Self::Empty => {
                fs::remove_dir_all(target).unwrap();
                fs::create_dir(target).unwrap();
            }
            Self::File => {
                fs::remove_dir_all(target).unwrap();
                fs::write(target, "not a directory").unwrap();
            }
            Self::Link => symlink(away("linked"), target).unwrap(),
        }
    }
}
