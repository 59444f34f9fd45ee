//! The plain program beside it: `benches/plain.c`, compiled here and now.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use coloc_daemon::config::Realtime;
use coloc_drivers::can::BusSpec;
use coloc_shm_types::Estimate;

use super::error::LatencyError;
use super::percentiles::Durations;
use super::placement::Placement;
use super::reader::Reader;
use super::sender::{Schedule, Sender};

const SOURCE: &str = include_str!("../../../benches/plain.c");
/// Who reads what it says.
const NAME: &str = "plain-reader";

/// The program, once it is compiled.
pub(crate) struct Plain(PathBuf);

impl Plain {
    /// Compiles it in `directory`.
    pub(crate) fn compile(directory: &Path) -> Result<Self, LatencyError> {
        let (source, program) = (directory.join("plain.c"), directory.join("plain"));
        let trouble = |reason: String| LatencyError::Spawn(format!("the plain program: {reason}"));
        std::fs::write(&source, SOURCE).map_err(|error| trouble(error.to_string()))?;
        let mut command = Command::new("cc");
        command.args(["-O2", "-o"]).arg(&program).arg(&source);
        let output = command.arg("-lm").output().map_err(|error| {
            trouble(format!("cc: {error}: install a C compiler (apt-get install gcc libc6-dev), or leave --plain out"))
        })?;
        if output.status.success() {
            return Ok(Self(program));
        }
        Err(trouble(
            String::from_utf8_lossy(&output.stderr).into_owned(),
        ))
    }

    /// From the second wheel's frame in the kernel to the reader, as colocd is measured.
    pub(crate) fn measure(
        &self,
        buses: &[BusSpec],
        directory: &Path,
        placement: &Placement,
        schedule: Schedule,
    ) -> Result<Durations, LatencyError> {
        let until_ns = schedule.end_ns();
        let reader = Reader::of_datagrams(directory, NAME, until_ns, placement)?;
        let running = Running::start(self, buses, &directory.join(NAME), placement, until_ns)?;
        let sender = Sender::of_frames(buses, schedule, placement)?;
        sender.finish()?;
        let seen = reader.finish()?;
        drop(running);
        // With the first pair counting starts, and everything is touched for the first time.
        let measured = seen.iter().skip(1);
        Ok(Durations::of(
            measured.map(|seen| seen.received_ns - seen.stamp_ns),
        ))
    }
}

/// While it runs.
struct Running(Child);

impl Running {
    fn start(
        program: &Plain,
        buses: &[BusSpec],
        socket: &Path,
        placement: &Placement,
        until_ns: i64,
    ) -> Result<Self, LatencyError> {
        let names: Vec<String> = buses.iter().map(ToString::to_string).collect();
        let cpu = placement.daemon.first();
        let cpu = cpu.map_or("-1".into(), ToString::to_string);
        let numbers = [
            size_of::<Estimate>().to_string(),
            cpu,
            Realtime::default().priority.to_string(),
            until_ns.to_string(),
        ];
        let mut command = Command::new(&program.0);
        command.arg(names.join(",")).arg(socket).args(numbers);
        let spawned = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
        let mut running = Self(
            spawned.map_err(|error| LatencyError::Spawn(format!("the plain program: {error}")))?,
        );
        let mut line = String::new();
        let ready = running.0.stdout.take().map(BufReader::new);
        let read = ready.map(|mut lines| lines.read_line(&mut line));
        match read {
            Some(Ok(1..)) => Ok(running),
            _ => Err(LatencyError::Thread("plain program")),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail only if it is gone already.
        let _ = (self.0.kill(), self.0.wait());
    }
}
