//! The other process: takes every estimate as soon as it is there, and notes when; what its tick took is told later.

use std::io::{BufRead, BufReader, BufWriter, Write, stdout};
use std::os::unix::net::UnixDatagram;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, RobotName, Space, Subscriber, Timing};

use super::args::{ReaderArgs, WaitArg};
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

/// A tick is told of by then, unless the machine has no time for that at all.
const TOLD_WITHIN: Duration = Duration::from_secs(2);
const BETWEEN_LOOKS: Duration = Duration::from_millis(10);

/// How long the end may be late for a reader that sleeps.
const SLEEP: Duration = Duration::from_millis(100);

/// No datagram is longer.
const MOST_BYTES: usize = 4096;

/// Being that process until the time is over: busy at ordinary priority, or asleep and in real time, where that is granted. Prints
/// what it saw, a line each.
pub(crate) fn run(args: &ReaderArgs) -> Result<(), LatencyError> {
    end_with_parent().map_err(LatencyError::Reader)?;
    settle(&args.cpus, args.wait == WaitArg::Sleep);
    let seen = if args.datagrams {
        read_datagrams(args)?
    } else {
        read_estimates(args)?
    };
    print(&seen).map_err(|error| LatencyError::Reader(error.to_string()))
}

/// Datagrams begin with the moment that they are counted from.
fn read_datagrams(args: &ReaderArgs) -> Result<Vec<Seen>, LatencyError> {
    let socket = UnixDatagram::bind(args.root.join(&args.robot)).map_err(LatencyError::bus)?;
    let patience = socket.set_read_timeout(Some(SLEEP));
    patience.map_err(LatencyError::bus)?;
    let mut seen = Vec::with_capacity(args.expect);
    let mut bytes = [0; MOST_BYTES];
    print_line(READY);
    let mut now = now_ns();
    while now < args.until_ns {
        let received = socket.recv(&mut bytes);
        now = now_ns();
        if let (Ok(_), Some(stamp)) = (received, bytes.first_chunk()) {
            let stamp_ns = i64::from_ne_bytes(*stamp);
            seen.push(Seen {
                received_ns: now,
                stamp_ns,
                frame_stamp_ns: stamp_ns,
                ..Seen::default()
            });
        }
    }
    // The next one who reads may want the same name.
    let _ = std::fs::remove_file(args.root.join(&args.robot));
    Ok(seen)
}

fn read_estimates(args: &ReaderArgs) -> Result<Vec<Seen>, LatencyError> {
    let space =
        Space::open(&args.root, PREFIX, "coloc-latency-reader").map_err(LatencyError::shm)?;
    let robot = RobotName::new(&args.robot).map_err(LatencyError::shm)?;
    let estimates: Subscriber<Estimate> = space.subscriber(&robot).map_err(LatencyError::shm)?;
    let timings: Subscriber<Timing> = space.subscriber(&robot).map_err(LatencyError::shm)?;
    let mut seen = Vec::with_capacity(args.expect);
    let mut told = Vec::with_capacity(args.expect);
    let mut next = take(args.wait, &estimates)?;
    print_line(READY);
    let mut now = now_ns();
    while now < args.until_ns {
        let estimate = next()?;
        now = now_ns();
        if let Some(estimate) = estimate {
            seen.push(note(&estimate, now));
            // The next one is not due yet.
            listen(&timings, &mut told)?;
        }
    }
    let last = seen.last().map_or(0, |seen: &Seen| seen.tick);
    let deadline = Instant::now() + TOLD_WITHIN;
    while told.last().is_none_or(|timing| timing.tick < last) && Instant::now() < deadline {
        std::thread::sleep(BETWEEN_LOOKS);
        listen(&timings, &mut told)?;
    }
    complete(&mut seen, &told);
    Ok(seen)
}

/// What takes the next estimate, if there is one.
fn take(
    wait: WaitArg,
    estimates: &Subscriber<Estimate>,
) -> Result<impl FnMut() -> Result<Option<Estimate>, LatencyError>, LatencyError> {
    if wait == WaitArg::Sleep {
        // Now, so that the first one is not measured with it.
        estimates.bell().map_err(LatencyError::shm)?;
    }
    let mut turn = 0_u64;
    Ok(move || match wait {
        WaitArg::Sleep => estimates.wait(SLEEP).map_err(LatencyError::shm),
        WaitArg::Poll => {
            turn += 1;
            if turn.is_multiple_of(TURNS_PER_YIELD) {
                std::thread::yield_now();
            }
            estimates.receive().map_err(LatencyError::shm)
        }
    })
}

fn listen(timings: &Subscriber<Timing>, told: &mut Vec<Timing>) -> Result<(), LatencyError> {
    while let Some(timing) = timings.receive().map_err(LatencyError::shm)? {
        told.push(timing);
    }
    Ok(())
}

fn note(estimate: &Estimate, received_ns: i64) -> Seen {
    Seen {
        received_ns,
        stamp_ns: estimate.header.stamp_ns,
        tick: estimate.tick,
        ..Seen::default()
    }
}

/// Puts to every estimate what its tick told; both are in the order of the ticks.
fn complete(seen: &mut [Seen], told: &[Timing]) {
    let mut told = told.iter().peekable();
    for seen in seen {
        while told.next_if(|timing| timing.tick < seen.tick).is_some() {}
        if let Some(timing) = told.next_if(|timing| timing.tick == seen.tick) {
            *seen = Seen {
                frame_stamp_ns: timing.frame_stamp_ns,
                since_tick_ns: timing.since_tick_ns,
                lateness_ns: timing.lateness_ns,
                collect_ns: timing.collect_ns,
                estimate_ns: timing.estimate_ns,
                publish_ns: timing.publish_ns,
                account_ns: timing.account_ns,
                ..*seen
            };
        }
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
        wait: WaitArg,
        placement: &Placement,
    ) -> Result<Self, LatencyError> {
        let expect = expect.to_string();
        let words = ["--expect", &expect, "--wait", wait.name()];
        Self::start_with(root, robot, until_ns, placement, &words)
    }

    /// One that sleeps until a datagram comes to the socket `name`.
    pub(crate) fn of_datagrams(
        directory: &Path,
        name: &str,
        until_ns: i64,
        placement: &Placement,
    ) -> Result<Self, LatencyError> {
        let words = ["--datagrams", "--wait", WaitArg::Sleep.name()];
        Self::start_with(directory, name, until_ns, placement, &words)
    }

    /// Its number among the processes.
    pub(crate) fn process(&self) -> u32 {
        self.child.id()
    }

    fn start_with(
        root: &Path,
        robot: &str,
        until_ns: i64,
        placement: &Placement,
        words: &[&str],
    ) -> Result<Self, LatencyError> {
        let spawn = |error: std::io::Error| LatencyError::Spawn(format!("the reader: {error}"));
        let cpus: Vec<String> = placement.others.iter().map(ToString::to_string).collect();
        let mut command = Command::new(std::env::current_exe().map_err(spawn)?);
        command.arg("latency-reader").arg("--root").arg(root);
        command.args(["--robot", robot, "--until-ns", &until_ns.to_string()]);
        command.args(words);
        if !cpus.is_empty() {
            command.args(["--cpus", &cpus.join(",")]);
        }
        command.env(PARENT_VARIABLE, std::process::id().to_string());
        let mut child = command
            // A Ctrl-C is for the command, which then ends it in order.
            .process_group(0)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_estimate_gets_what_its_own_tick_told() {
        let mut seen: Vec<Seen> = [3, 4, 6]
            .map(|tick| Seen {
                tick,
                ..Seen::default()
            })
            .into();
        let told = [2, 3, 5, 6].map(|tick| Timing {
            tick,
            since_tick_ns: 100 + tick,
            ..Timing::default()
        });
        complete(&mut seen, &told);
        let told: Vec<u64> = seen.iter().map(|seen| seen.since_tick_ns).collect();
        assert_eq!(told, [103, 0, 106]);
    }
}
