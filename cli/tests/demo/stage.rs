//! A demo in a world of its own: its own temporary folder, and eyes on what it leaves.

use std::io::{BufRead, BufReader, Lines};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::fs::{FlockOperation, flock};
use serde_json::Value;
use tempfile::TempDir;

/// Nothing here takes as long, however busy the machine; a test that gets there fails.
const PATIENCE: Duration = Duration::from_secs(60);

/// A demo that runs.
pub(crate) struct Demo {
    child: Child,
    said: Lines<BufReader<ChildStderr>>,
    folder: TempDir,
}

/// A demo that has ended.
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) summary: Value,
    /// The lines for people that nobody waited for.
    pub(crate) said: String,
    pub(crate) folder: TempDir,
}

impl Demo {
    /// `coloc demo --json` with `args`; pictures go into `out` in its folder.
    pub(crate) fn start(args: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let temporary = folder.path().join("tmp");
        std::fs::create_dir(&temporary).unwrap();
        let mut child = coloc()
            .args(["demo", "--json", "--out"])
            .arg(folder.path().join("out"))
            .args(args)
            .env("TMPDIR", temporary)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stderr.take().unwrap()).lines();
        Self {
            child,
            said,
            folder,
        }
    }

    /// The next line for people that contains `text`.
    pub(crate) fn wait_for_line(&mut self, text: &str) -> String {
        let mut before = Vec::new();
        for line in self.said.by_ref().map(Result::unwrap) {
            if line.contains(text) {
                return line;
            }
            before.push(line);
        }
        panic!(
            "the demo ended without saying {text:?}; it said:\n{}",
            before.join("\n")
        );
    }

    /// The folder that the demo has made for the time that it runs.
    pub(crate) fn home(&self) -> PathBuf {
        let entry = entries(&self.folder.path().join("tmp")).pop();
        entry
            .expect("it runs in a temporary folder")
            .canonicalize()
            .unwrap()
    }

    pub(crate) fn send(&self, signal: &str) {
        send(self.child.id(), signal);
    }

    /// Waits for its end and reads its summary (null if it printed none).
    pub(crate) fn end(mut self) -> Ended {
        let said: Vec<String> = self.said.by_ref().map(Result::unwrap).collect();
        let output = self.child.wait_with_output().unwrap();
        let said = said.join("\n");
        println!("{said}");
        let summary = serde_json::from_slice(&output.stdout).unwrap_or_default();
        Ended {
            status: output.status,
            summary,
            said,
            folder: self.folder,
        }
    }
}

impl Ended {
    pub(crate) fn robot(&self, number: usize) -> &Value {
        &self.summary["robots"][number - 1]
    }

    /// Estimates that were compared with the truth.
    pub(crate) fn estimates(&self, number: usize) -> u64 {
        self.robot(number)["accuracy"]["estimates"]
            .as_u64()
            .unwrap()
    }

    /// No file is left of the run but what the person asked for.
    pub(crate) fn assert_left_nothing(&self) {
        assert_eq!(
            entries(&self.folder.path().join("tmp")),
            Vec::<PathBuf>::new()
        );
        assert_eq!(self.summary["left_in_shared_memory"], serde_json::json!([]));
    }
}

pub(crate) fn coloc() -> Command {
    Command::new(env!("CARGO_BIN_EXE_coloc"))
}

pub(crate) fn send(pid: u32, signal: &str) {
    let status = Command::new("kill")
        .args([&format!("-{signal}"), &pid.to_string()])
        .status()
        .unwrap();
    assert!(status.success(), "process {pid} is gone already");
}

pub(crate) fn entries(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect()
}

/// The process whose command line contains `path`, if there is one.
pub(crate) fn process_with(path: &Path) -> Option<u32> {
    let numbers = entries(Path::new("/proc"))
        .into_iter()
        .filter_map(|entry| entry.file_name()?.to_str()?.parse().ok());
    let names = |pid: &u32| {
        let line = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&line).contains(path.to_str().unwrap())
    };
    numbers.into_iter().find(names)
}

/// Whether nobody holds the locks of a demo's folder and its shared memory: who was killed keeps them for a moment after
/// its command line is gone.
pub(crate) fn is_free(home: &Path) -> bool {
    let lock = |folder: &Path| {
        let folder = std::fs::File::open(folder).unwrap();
        flock(&folder, FlockOperation::NonBlockingLockExclusive).is_ok()
    };
    lock(home) && lock(&home.join("shm"))
}

/// Files in `/dev/shm` of the shared-memory space at `root`: they carry the hash (FNV-1a) of its path.
pub(crate) fn shared_memory_of(root: &Path) -> Vec<PathBuf> {
    let hash = root
        .to_str()
        .unwrap()
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
    let ours = |path: &PathBuf| path.to_str().unwrap().contains(&format!("{hash:016x}"));
    entries(Path::new("/dev/shm"))
        .into_iter()
        .filter(ours)
        .collect()
}

/// Waits until `done`.
pub(crate) fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !done() {
        assert!(Instant::now() < deadline, "waited in vain until {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}
