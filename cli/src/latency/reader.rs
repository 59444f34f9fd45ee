//! The other process: takes every estimate as soon as it is there, and notes when.

use std::io::{BufRead, BufReader, BufWriter, Write, stdout};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use coloc_shm_types::{Estimate, RobotName, Space};

use super::args::ReaderArgs;
use super::error::LatencyError;
use super::matching::Seen;
use super::place::PREFIX;
use super::placement::{Placement, settle};
use crate::daemon::{PARENT_VARIABLE, end_with_parent};
use crate::demo::clock::now_ns;
use crate::output::print_line;

const READY: &str = "ready";

/// Whoever waits for this processor gets it now, not when the sender's next frame makes the scheduler choose: that would be the
/// very moment at which an estimate is on its way.
const TURNS_PER_YIELD: u64 = 64;

/// Being that process: busy, at ordinary priority, until the time is over. Prints what it saw, a line each.
pub(crate) fn run(args: &ReaderArgs) -> Result<(), LatencyError> {
    end_with_parent().map_err(LatencyError::Reader)?;
    settle(&args.cpus, false);
    let space =
        Space::open(&args.root, PREFIX, "coloc-latency-reader").map_err(LatencyError::shm)?;
    let robot = RobotName::new(&args.robot).map_err(LatencyError::shm)?;
    let estimates = space
        .subscriber::<Estimate>(&robot)
        .map_err(LatencyError::shm)?;
    let mut seen = Vec::with_capacity(args.expect);
    print_line(READY);
    let mut now = now_ns();
    for turn in 1_u64.. {
        if now >= args.until_ns {
            break;
        }
        if turn.is_multiple_of(TURNS_PER_YIELD) {
            std::thread::yield_now();
        }
        let estimate = estimates.receive().map_err(LatencyError::shm)?;
        now = now_ns();
        seen.extend(estimate.map(|estimate| note(&estimate, now)));
    }
    print(&seen).map_err(|error| LatencyError::Reader(error.to_string()))
}

fn note(estimate: &Estimate, received_ns: i64) -> Seen {
    Seen {
        received_ns,
        stamp_ns: estimate.header.stamp_ns,
        frame_stamp_ns: estimate.frame_stamp_ns,
        latency_ns: estimate.latency_ns,
        lateness_ns: estimate.lateness_ns,
        collect_ns: estimate.collect_ns,
        estimate_ns: estimate.estimate_ns,
        publish_ns: estimate.publish_ns,
        account_ns: estimate.account_ns,
    }
}

fn print(seen: &[Seen]) -> std::io::Result<()> {
    let mut out = BufWriter::new(stdout().lock());
    for estimate in seen {
        serde_json::to_writer(&mut out, estimate)?;
        out.write_all(b"\n")?;
    }
    out.flush()
}

/// That process, seen from this one; it ends with this.
pub(crate) struct Reader {
    child: Child,
    output: BufReader<ChildStdout>,
}

impl Reader {
    /// Starts it, and waits until it listens.
    pub(crate) fn start(
        root: &Path,
        robot: &str,
        until_ns: i64,
        expect: usize,
        placement: &Placement,
    ) -> Result<Self, LatencyError> {
        let spawn = |error: std::io::Error| LatencyError::Spawn(format!("the reader: {error}"));
        let cpus: Vec<String> = placement.others.iter().map(ToString::to_string).collect();
        let mut command = Command::new(std::env::current_exe().map_err(spawn)?);
        command.arg("latency-reader").arg("--root").arg(root);
        command.args(["--robot", robot, "--until-ns", &until_ns.to_string()]);
        command.args(["--expect", &expect.to_string()]);
        if !cpus.is_empty() {
            command.args(["--cpus", &cpus.join(",")]);
        }
        command.env(PARENT_VARIABLE, std::process::id().to_string());
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(spawn)?;
        let Some(output) = child.stdout.take() else {
            return Err(LatencyError::Thread("reader"));
        };
        let mut reader = Self {
            child,
            output: BufReader::new(output),
        };
        match reader.line()?.as_deref() {
            Some(READY) => Ok(reader),
            _ => Err(LatencyError::Thread("reader")),
        }
    }

    /// All that it saw, once its time is over.
    pub(crate) fn finish(mut self) -> Result<Vec<Seen>, LatencyError> {
        let mut seen = Vec::new();
        while let Some(line) = self.line()? {
            let estimate = serde_json::from_str(&line);
            seen.push(estimate.map_err(|error| LatencyError::Reader(error.to_string()))?);
        }
        Ok(seen)
    }

    fn line(&mut self) -> Result<Option<String>, LatencyError> {
        let mut line = String::new();
        let length = self.output.read_line(&mut line);
        match length.map_err(|error| LatencyError::Reader(error.to_string()))? {
            0 => Ok(None),
            _ => Ok(Some(line.trim_end().to_owned())),
        }
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        // Both fail only if it is gone already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
