//! A process that the fleet has started, and what it is held to while it lives and when it ends.

use std::fmt::Write;
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::bars::Bar;
use crate::evidence;
use crate::fault::{Fault, Outcome, fault};

/// Within which SIGTERM ends it.
pub(crate) const END: Bar = Bar(Duration::from_secs(1));
/// After which nothing is waited for any more.
const PATIENCE: Bar = Bar(Duration::from_secs(10));
const PAUSE: Duration = Duration::from_micros(500);

pub(crate) struct Program {
    name: String,
    child: Child,
    lines: Receiver<String>,
    said: PathBuf,
    status: Option<ExitStatus>,
}

impl Program {
    /// Standard error goes to a file below `directory`, standard output is read line by line.
    pub(crate) fn start(name: &str, directory: &Path, command: &mut Command) -> Self {
        let said = said_file(directory, name);
        command.stderr(File::create(&said).unwrap());
        Self::start_saying(name, said, command)
    }

    /// Standard error goes to where the command says.
    pub(crate) fn start_saying(name: &str, said: PathBuf, command: &mut Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = lines(child.stdout.take().unwrap());
        Self {
            name: name.into(),
            child,
            lines,
            said,
            status: None,
        }
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// What it has written to standard error.
    pub(crate) fn said(&self) -> String {
        String::from_utf8_lossy(&fs::read(&self.said).unwrap_or_default()).into_owned()
    }

    /// The next line of its standard output that begins with `word`: what follows.
    pub(crate) fn line(&self, word: &str, within: Duration) -> Outcome<String> {
        match self.line_if_any(word, within) {
            Some(line) => Ok(line),
            None => fault!(
                "{} did not say `{word}` within {within:?}{}",
                self.name,
                self.evidence()
            ),
        }
    }

    pub(crate) fn line_if_any(&self, word: &str, within: Duration) -> Option<String> {
        let deadline = Instant::now() + within;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let line = self.lines.recv_timeout(left).ok()?;
            if let Some(rest) = line.strip_prefix(word) {
                return Some(rest.trim().into());
            }
        }
    }

    /// Waits until standard error contains this.
    pub(crate) fn says(&self, word: &str, within: Duration) -> Outcome {
        let deadline = Instant::now() + within;
        while !self.said().contains(word) {
            if Instant::now() > deadline {
                let evidence = self.evidence();
                fault!("{} did not say `{word}`{evidence}", self.name);
            }
            sleep(PAUSE);
        }
        Ok(())
    }

    /// Hands the lines over to somebody else.
    pub(crate) fn take_lines(&mut self) -> Receiver<String> {
        std::mem::replace(&mut self.lines, channel().1)
    }

    pub(crate) fn signal(&self, signal: Signal) {
        signal_pid(self.pid(), signal);
    }

    /// It must be running.
    pub(crate) fn look(&mut self) -> Outcome {
        match self.ended() {
            None => Ok(()),
            Some(status) => fault!("{} ended by itself, {status}{}", self.name, self.words()),
        }
    }

    /// kill -9.
    pub(crate) fn kill(&mut self) -> Outcome {
        self.signal(Signal::KILL);
        let status = self.wait(PATIENCE.patience())?;
        match status.signal() {
            Some(9) => self.no_panic(),
            _ => self.judge(status),
        }
    }

    /// SIGTERM: how long it took to end.
    pub(crate) fn terminate(&mut self) -> Outcome<Duration> {
        let begun = Instant::now();
        self.signal(Signal::TERM);
        let status = self.wait(PATIENCE.patience())?;
        let took = begun.elapsed();
        if status.signal() != Some(15) {
            self.judge(status)?;
        }
        END.hold(took, || {
            let words = self.words();
            format!("{} took {took:?} to end after SIGTERM{words}", self.name)
        })?;
        Ok(took)
    }

    /// It ends by itself.
    pub(crate) fn wait(&mut self, within: Duration) -> Outcome<ExitStatus> {
        let deadline = Instant::now() + within;
        loop {
            if let Some(status) = self.ended() {
                return Ok(status);
            }
            if Instant::now() > deadline {
                fault!(
                    "{} did not end within {within:?}{}",
                    self.name,
                    self.evidence()
                );
            }
            sleep(PAUSE);
        }
    }

    /// Whether it has ended, or this has happened, within that time.
    pub(crate) fn ends_or(
        &mut self,
        within: Duration,
        mut happened: impl FnMut(&Self) -> bool,
    ) -> bool {
        let deadline = Instant::now() + within;
        loop {
            if self.ended().is_some() || happened(self) {
                return true;
            }
            if Instant::now() > deadline {
                return false;
            }
            sleep(PAUSE);
        }
    }

    pub(crate) fn ended(&mut self) -> Option<ExitStatus> {
        if self.status.is_none() {
            self.status = self.child.try_wait().unwrap();
        }
        self.status
    }

    /// An end that nobody asked for with kill -9: a status and a sentence, no signal, no panic.
    pub(crate) fn judge(&self, status: ExitStatus) -> Outcome {
        if status.success() {
            return self.no_panic();
        }
        Err(Fault::new(format!(
            "{} ended, {status}{}",
            self.name,
            self.words()
        )))
    }

    /// It did not want to run: a status that says so, and a sentence.
    pub(crate) fn refused(&self, status: ExitStatus) -> Outcome<String> {
        self.no_panic()?;
        let said = self.said();
        match status.code() {
            Some(0 | 101) | None => fault!("{} ended, {status}{}", self.name, self.words()),
            Some(_) if said.trim().is_empty() => {
                fault!("{} ended without a word, {status}", self.name)
            }
            Some(_) => Ok(said.lines().last().unwrap_or_default().into()),
        }
    }

    pub(crate) fn no_panic(&self) -> Outcome {
        if self.said().contains("panicked at") {
            fault!("{} panicked{}", self.name, self.words());
        }
        Ok(())
    }

    /// The end of what it said.
    pub(crate) fn words(&self) -> String {
        let said = self.said();
        let lines: Vec<&str> = said.lines().rev().take(12).collect();
        let mut text = String::new();
        for line in lines.iter().rev() {
            let _ = write!(text, "\n    {}: {line}", self.name);
        }
        text
    }

    /// What it said, and what it is doing.
    pub(crate) fn evidence(&self) -> String {
        self.words() + &evidence::of(self.pid())
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = (self.child.kill(), self.child.wait());
        let _ = fs::remove_file(&self.said);
    }
}

pub(crate) fn signal_pid(pid: u32, signal: Signal) {
    let pid = Pid::from_raw(pid.try_into().unwrap()).unwrap();
    // It may have ended already; whoever waits for it will see.
    let _ = kill_process(pid, signal);
}

/// This program, in a part.
pub(crate) fn part(name: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["part", name]);
    command
}

/// Behind `command`, which runs another program: this one, in a part.
pub(crate) fn then_part<'a>(command: &'a mut Command, name: &str) -> &'a mut Command {
    command
        .arg(std::env::current_exe().unwrap())
        .args(["part", name])
}

fn said_file(directory: &Path, name: &str) -> PathBuf {
    use std::sync::atomic::{AtomicU64, Ordering};
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    directory.join(format!("{name}-{count}.log"))
}

fn lines(stdout: ChildStdout) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(stdout).lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}
