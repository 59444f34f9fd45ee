//! How the programs of a fleet are started.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use coloc_tests::surroundings::realtime_ns;

use super::answer::PATIENCE;
use super::config::ROBOTS;
use super::{Fleet, VICTIM, Who};
use crate::fault::Outcome;
use crate::parts::{CountFrom, monotonic_ns};
use crate::program::{Program, part, then_part};
use crate::watch::Watch;

/// What was started, and when.
pub(crate) struct Started {
    pub(crate) program: Program,
    pub(crate) who: Who,
    pub(super) robot: usize,
    pub(super) at: Instant,
    pub(super) realtime_ns: i64,
    pub(super) monotonic_ns: i64,
}

/// What is done at a stop.
#[derive(Copy, Clone, Debug)]
pub(crate) enum Harm {
    Kill,
    Term,
    Hold(Duration),
}

impl Started {
    fn new(who: Who, robot: usize, start: impl FnOnce() -> Program) -> Self {
        Self {
            who,
            robot,
            at: Instant::now(),
            realtime_ns: realtime_ns(),
            monotonic_ns: monotonic_ns(),
            program: start(),
        }
    }
}

impl Fleet {
    pub(crate) fn start_witness(&mut self) -> Outcome {
        let mut command = part("launch");
        then_part(&mut command, "reader").arg("--report");
        command.args(self.place());
        let mut witness = Program::start("witness", self.notes.path(), &mut command);
        witness.line("ready", PATIENCE.patience())?;
        self.watch = Some(Watch::new(witness.take_lines()));
        self.witness = Some(witness);
        Ok(())
    }

    pub(crate) fn start(&self, who: Who, robot: usize) -> Started {
        self.start_within(who, robot, &[])
    }

    /// With options of the part `launch`.
    pub(crate) fn start_within(&self, who: Who, robot: usize, limits: &[String]) -> Started {
        let mut command = part("launch");
        command.args(limits);
        self.program(who, robot, &mut command);
        self.start_command(who, robot, &mut command)
    }

    /// The victim's daemon, whose standard error goes elsewhere.
    pub(crate) fn start_saying(&self, to: Stdio) -> Started {
        let mut command = part("launch");
        self.program(Who::Daemon, VICTIM, &mut command);
        command.stderr(to);
        let nowhere = self.notes.path().join("nowhere");
        Started::new(Who::Daemon, VICTIM, || {
            Program::start_saying(ROBOTS[VICTIM], nowhere, &mut command)
        })
    }

    /// A reader of this robot alone.
    pub(crate) fn start_listener(&self, robot: usize) -> Started {
        let mut command = part("launch");
        then_part(&mut command, "reader").args(&self.place()[..2]);
        command.arg(ROBOTS[robot]);
        self.start_command(Who::Reader, robot, &mut command)
    }

    /// Harmed at a stop of a system call, if one is given.
    pub(crate) fn start_traced(&self, who: Who, from: CountFrom, at: Option<u64>) -> Started {
        self.start_harmed(who, from, at, Harm::Kill)
    }

    pub(crate) fn start_harmed(
        &self,
        who: Who,
        from: CountFrom,
        at: Option<u64>,
        harm: Harm,
    ) -> Started {
        let mut command = part("tracer");
        command.arg(match from {
            CountFrom::Start => "--from=start",
            CountFrom::Term => "--from=term",
        });
        command.args(at.map(|at| format!("--at={at}")));
        command.args(match harm {
            Harm::Kill => None,
            Harm::Term => Some("--term".to_owned()),
            Harm::Hold(still) => Some(format!("--hold-ms={}", still.as_millis())),
        });
        self.program(who, VICTIM, &mut command);
        self.start_command(who, VICTIM, &mut command)
    }

    /// What starts `who`, behind a command that runs another program.
    fn program(&self, who: Who, robot: usize, command: &mut Command) {
        match (who, &self.colocd) {
            (Who::Daemon, Some(colocd)) => command.arg(colocd),
            (Who::Daemon, None) => then_part(command, "colocd"),
            (Who::Reader, _) => then_part(command, "reader"),
            (Who::Feeder, _) => then_part(command, "feeder"),
        };
        match who {
            Who::Daemon => command.arg("run").arg(self.config(robot)),
            Who::Reader | Who::Feeder => command.args(self.place()),
        };
    }

    fn start_command(&self, who: Who, robot: usize, command: &mut Command) -> Started {
        let name = match who {
            Who::Daemon => ROBOTS[robot],
            Who::Reader => "reader",
            Who::Feeder => "feeder",
        };
        Started::new(who, robot, || {
            Program::start(name, self.notes.path(), command)
        })
    }
}
