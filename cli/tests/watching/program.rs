//! `coloc` beside robots that go on speaking.

use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Nothing here takes as long, however busy the machine; a test that gets there fails.
const PATIENCE: Duration = Duration::from_secs(60);
const PAUSE: Duration = Duration::from_millis(2);

pub(crate) struct Coloc {
    child: Child,
    /// What it says, line by line; `None` for the reader that a test lets go.
    stdout: Option<Receiver<String>>,
    stderr: Receiver<String>,
    said: Vec<String>,
    printed: Vec<String>,
}

/// What became of it.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) status: Option<i32>,
    pub(crate) printed: Vec<String>,
    pub(crate) said: Vec<String>,
}

impl Coloc {
    /// With these words, in the shared memory at `root`.
    pub(crate) fn start(words: &str, root: &Path) -> Self {
        let mut child = Self::command(words, root)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdout = lines(child.stdout.take().unwrap());
        Self::of(child, Some(stdout))
    }

    /// With these words, wherever robots run on this computer.
    pub(crate) fn start_anywhere(words: &str) -> Self {
        let mut child = Self::bare(words).stdout(Stdio::piped()).spawn().unwrap();
        let stdout = lines(child.stdout.take().unwrap());
        Self::of(child, Some(stdout))
    }

    /// The same as the first, of another user: a copy of the program that everybody may run.
    pub(crate) fn start_as(program: &Path, user: (u32, u32), words: &str, root: &Path) -> Self {
        let mut command = Command::new(program);
        command.args(words.split_whitespace());
        command.stdin(Stdio::null()).stderr(Stdio::piped());
        command.current_dir("/").uid(user.0).gid(user.1);
        command.arg("--root").arg(root);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let stdout = lines(child.stdout.take().unwrap());
        Self::of(child, Some(stdout))
    }

    /// The same as the first, with a reader of the test's own.
    pub(crate) fn start_into(words: &str, root: &Path, stdout: impl Into<Stdio>) -> Self {
        let child = Self::command(words, root).stdout(stdout).spawn().unwrap();
        Self::of(child, None)
    }

    fn command(words: &str, root: &Path) -> Command {
        let mut command = Self::bare(words);
        command.arg("--root").arg(root);
        command
    }

    fn bare(words: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_coloc"));
        command.args(words.split_whitespace());
        command.stdin(Stdio::null()).stderr(Stdio::piped());
        command
    }

    fn of(mut child: Child, stdout: Option<Receiver<String>>) -> Self {
        let stderr = lines(child.stderr.take().unwrap());
        Self {
            child,
            stdout,
            stderr,
            said: Vec::new(),
            printed: Vec::new(),
        }
    }

    /// Until `there` finds in the lines on standard output and on standard error what it looks for; meanwhile robots do
    /// `something`.
    pub(crate) fn wait(
        &mut self,
        mut something: impl FnMut(),
        there: impl Fn(&[String], &[String]) -> bool,
    ) {
        let deadline = Instant::now() + PATIENCE;
        loop {
            self.read();
            if there(&self.printed, &self.said) {
                return;
            }
            let so_far = (&self.printed, &self.said);
            assert!(self.child.try_wait().unwrap().is_none(), "{so_far:?}");
            assert!(Instant::now() < deadline, "{so_far:?}");
            something();
            std::thread::sleep(PAUSE);
        }
    }

    /// Until it says on standard error what contains `text`.
    pub(crate) fn wait_until_it_says(&mut self, text: &str, something: impl FnMut()) {
        self.wait(something, |_, said| {
            said.iter().any(|line| line.contains(text))
        });
    }

    /// Until it ends by itself.
    pub(crate) fn end(mut self, mut something: impl FnMut()) -> Ended {
        let deadline = Instant::now() + PATIENCE;
        while self.child.try_wait().unwrap().is_none() {
            self.read();
            let so_far = (&self.printed, &self.said);
            assert!(Instant::now() < deadline, "{so_far:?}");
            something();
            std::thread::sleep(PAUSE);
        }
        let status = self.child.wait().unwrap().code();
        // The pipes are closed, so these come to an end.
        self.said.extend(self.stderr.iter());
        self.printed.extend(self.stdout.iter().flatten());
        Ended {
            status,
            printed: std::mem::take(&mut self.printed),
            said: std::mem::take(&mut self.said),
        }
    }

    pub(crate) fn signal(&self, signal: &str) {
        let process = self.child.id().to_string();
        let killed = Command::new("kill").args(["-s", signal, &process]).status();
        assert!(killed.unwrap().success());
    }

    fn read(&mut self) {
        self.said.extend(self.stderr.try_iter());
        self.printed
            .extend(self.stdout.iter().flat_map(Receiver::try_iter));
    }
}

/// Of a failed test.
impl Drop for Coloc {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn lines(pipe: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(pipe).lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}
