//! Nobody reads what a daemon says, or it has nowhere to write: it goes on, and ends when it is told to.

use std::fs::{self, File, OpenOptions};
use std::io::pipe;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

use coloc_daemon::config::{LogLevel, Telemetry};

use crate::fault::{Outcome, fault};
use crate::fleet::{Answer, Fleet, Started, VICTIM, Who};
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

/// How long it is watched.
const WATCHED: Duration = Duration::from_millis(500);

/// What is wrong with an output.
#[derive(Copy, Clone, Debug)]
enum Output {
    /// Standard error.
    StalledPipe,
    ClosedPipe,
    FullDevice,
    /// A file of the configuration, and a path that begins in the fleet's directory.
    Setting(Written, &'static str),
}

/// What a daemon writes.
#[derive(Copy, Clone, Debug)]
enum Written {
    Log,
    Record,
    State,
}

impl Written {
    fn path(self, telemetry: &mut Telemetry) -> &mut PathBuf {
        match self {
            Self::Log => &mut telemetry.log_file,
            Self::Record => &mut telemetry.record,
            Self::State => &mut telemetry.state_file,
        }
    }
}

const OUTPUTS: [Output; 14] = [
    Output::StalledPipe,
    Output::ClosedPipe,
    Output::FullDevice,
    Output::Setting(Written::Log, "/dev/full"),
    Output::Setting(Written::Log, "pipe"),
    Output::Setting(Written::Log, "missing/file"),
    Output::Setting(Written::Log, "."),
    Output::Setting(Written::Record, "/dev/full"),
    Output::Setting(Written::Record, "pipe"),
    Output::Setting(Written::Record, "missing/file"),
    Output::Setting(Written::Record, "."),
    Output::Setting(Written::State, "/dev/full"),
    Output::Setting(Written::State, "missing/file"),
    Output::Setting(Written::State, "."),
];

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    play_rounds(
        stage,
        tally,
        stage.rounds(u32::try_from(OUTPUTS.len()).unwrap()),
        || Ok(()),
        |(), round| {
            let output = OUTPUTS[round.number as usize % OUTPUTS.len()];
            spoiled(stage, output, round).map_err(|fault| fault.after(&format!("{output:?}")))
        },
        |(), _| Ok(()),
    );
}

fn spoiled(stage: &Stage, output: Output, round: &mut Round<'_>) -> Outcome {
    let mut setting = None;
    let mut to = None;
    // Held, but not read.
    let mut pipe_end = None;
    match output {
        Output::StalledPipe | Output::ClosedPipe => {
            let (reader, writer) = pipe().unwrap();
            pipe_end = matches!(output, Output::StalledPipe).then_some(reader);
            to = Some(full(writer));
        }
        Output::FullDevice => to = Some(open("/dev/full").into()),
        Output::Setting(written, path) => setting = Some((written, path)),
    }
    let mut fleet = Fleet::with_settings(stage, move |config, at| {
        config.telemetry.log = LogLevel::Trace;
        if let Some((written, path)) = setting {
            *written.path(&mut config.telemetry) = at.join(path);
        }
    })?;
    fleet.start_witness()?;
    make_pipe(&fleet.directory.path().join("pipe"));
    let mut robot = to.map_or_else(
        || fleet.start(Who::Daemon, VICTIM),
        |to| fleet.start_saying(to),
    );
    if let Answer::Works = fleet.answers_or_refuses(&mut robot)? {
        goes_on(&fleet, &mut robot)?;
        round.tally.ends.push(robot.program.terminate()?);
    }
    drop(pipe_end);
    fleet.end_witness()?;
    fleet.nothing_left()
}

fn goes_on(fleet: &Fleet, robot: &mut Started) -> Outcome {
    sleep(WATCHED);
    robot.program.look()?;
    if !fleet.ticks_now(VICTIM) {
        fault!("robot1 does not tick any more{}", robot.program.evidence());
    }
    Ok(())
}

/// A pipe that takes no more.
fn full(writer: std::io::PipeWriter) -> Stdio {
    let file = File::from(std::os::fd::OwnedFd::from(writer));
    rustix::io::ioctl_fionbio(&file, true).unwrap();
    while rustix::io::write(&file, &[b'.'; 4096]).is_ok() {}
    rustix::io::ioctl_fionbio(&file, false).unwrap();
    file.into()
}

fn open(path: &str) -> File {
    OpenOptions::new().write(true).open(path).unwrap()
}

/// Nobody reads it.
fn make_pipe(path: &Path) {
    let _ = fs::remove_file(path);
    let mode = rustix::fs::Mode::from_raw_mode(0o600);
    rustix::fs::mknodat(rustix::fs::CWD, path, rustix::fs::FileType::Fifo, mode, 0).unwrap();
}
