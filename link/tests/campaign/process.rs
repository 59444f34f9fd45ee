//! What the kernel says of a process.
use std::fs;
use std::process::{Child, Command};

/// A process that ends with this one.
pub(crate) struct Process(Child);

/// How it is doing.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Usage {
    /// Processor time of all its threads (s).
    pub(crate) busy_s: f64,
    /// Resident, what it shares with others included (MiB).
    pub(crate) resident_mib: f64,
    /// Of that what is its alone, which is no file and no shared memory (MiB).
    pub(crate) own_mib: f64,
    pub(crate) descriptors: usize,
}

impl Process {
    pub(crate) fn start(command: &mut Command) -> Self {
        let parent = std::process::id().to_string();
        Self(command.env("COLOC_DEMO_PID", parent).spawn().unwrap())
    }

    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    /// At once, without a word (SIGKILL).
    pub(crate) fn kill(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }

    /// In order (SIGTERM).
    pub(crate) fn end(&mut self) {
        let id = i32::try_from(self.id()).ok();
        let id = id.and_then(rustix::process::Pid::from_raw).unwrap();
        let _ = rustix::process::kill_process(id, rustix::process::Signal::TERM);
        let _ = self.0.wait();
    }

    pub(crate) fn wait(&mut self) {
        assert!(self.0.wait().unwrap().success());
    }

    pub(crate) fn usage(&self) -> Usage {
        let of = |what: &str| format!("/proc/{}/{what}", self.id());
        let tasks = fs::read_dir(of("task")).into_iter().flatten().flatten();
        let busy = tasks.filter_map(|task| {
            let text = fs::read_to_string(task.path().join("schedstat")).ok()?;
            text.split(' ').next()?.parse::<f64>().ok()
        });
        let rollup = fs::read_to_string(of("smaps_rollup")).unwrap_or_default();
        let mib = |name: &str| {
            let line = rollup.lines().find(|line| line.starts_with(name));
            let number = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
            number.unwrap_or(f64::NAN) / 1024.0
        };
        Usage {
            busy_s: busy.sum::<f64>() * 1e-9,
            resident_mib: mib("Rss:"),
            own_mib: mib("Anonymous:"),
            descriptors: fs::read_dir(of("fd")).map_or(0, Iterator::count),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}
