//! The log. It can fail in any way (a pipe that nobody reads, a full disk, a file that is gone), and nothing else does.
//!
//! Lines are written by a thread of their own. What it cannot take in or write is lost and counted, and the count is a
//! line of its own as soon as lines can be written again.

use std::io::{self, Write};
use std::panic::PanicHookInfo;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use coloc_shm_types::private::OwnFile;
use tracing::{error, info, level_filters::LevelFilter, warn};

use crate::aside::Aside;
use crate::config::{self, LogLevel};
use crate::deleted::Output;
use crate::retry::Retry;

/// So many lines can wait for a slow disk or reader.
const CAPACITY: usize = 1024;

/// The log of the process.
#[derive(Debug)]
pub(crate) struct Log {
    lines: Lines,
    to_file: bool,
}

/// Takes in lines; clones share it.
#[derive(Clone, Debug)]
struct Lines {
    queue: Aside<Entry>,
    lost: Arc<AtomicU64>,
}

#[derive(Debug)]
enum Entry {
    Line(Box<[u8]>),
    Reopen,
}

impl Log {
    /// Opens the log for the whole process; what panics from now on says so in it.
    ///
    /// A file that cannot be opened is tried again now and then; until it can, lines go to standard error.
    ///
    /// # Errors
    /// If there is no thread to be had.
    pub(crate) fn open(config: &config::Telemetry) -> io::Result<Self> {
        let lost = Arc::new(AtomicU64::new(0));
        let mut sink = Sink::new(&config.log_file, Arc::clone(&lost));
        let queue = Aside::start("colocd-lines", CAPACITY, move |entry| sink.take(&entry))?;
        let lines = Lines { queue, lost };
        let writer = lines.clone();
        let subscriber = tracing_subscriber::fmt()
            .with_max_level(level(config.log))
            .with_target(false)
            .with_ansi(false)
            // It would print, and panic where that fails.
            .log_internal_errors(false)
            .with_writer(move || writer.clone());
        // A program that has a log already (a test, a tool that runs daemons as threads) keeps it.
        let _ = subscriber.try_init();
        std::panic::set_hook(Box::new(log_panic));
        Ok(Self {
            lines,
            to_file: !config.log_file.as_os_str().is_empty(),
        })
    }

    /// Whether lines go to a file, as far as it can be written.
    pub(crate) fn is_file(&self) -> bool {
        self.to_file
    }

    /// Goes on in a new file of the same name: the old one was moved away.
    pub(crate) fn reopen(&self) {
        // A full queue waits for something worse than an old file.
        let _ = self.lines.queue.offer(Entry::Reopen);
    }

    /// Waits until everything is written, but no longer than `patience`.
    pub(crate) fn finish(&self, patience: Duration) {
        // Twice: what the last lines have lost is said behind them.
        let _ = self.lines.queue.finish(patience) && self.lines.queue.finish(patience);
    }
}

/// The usual hook would wait for whoever reads standard error.
fn log_panic(panic: &PanicHookInfo<'_>) {
    let thread = std::thread::current();
    let payload = panic.payload();
    let what = (payload.downcast_ref::<&str>().copied())
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("for no stated reason");
    let at = panic.location().map(ToString::to_string);
    error!(
        at,
        "{} panicked: {what}",
        thread.name().unwrap_or("a thread")
    );
}

fn level(level: LogLevel) -> LevelFilter {
    match level {
        LogLevel::Error => LevelFilter::ERROR,
        LogLevel::Warn => LevelFilter::WARN,
        LogLevel::Info => LevelFilter::INFO,
        LogLevel::Debug => LevelFilter::DEBUG,
        LogLevel::Trace => LevelFilter::TRACE,
    }
}

/// A line comes in one piece.
impl Write for Lines {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if self.queue.offer(Entry::Line(line.into())).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Where lines end up; lives on the thread that may wait for it.
#[derive(Debug)]
struct Sink {
    /// Empty: standard error.
    path: PathBuf,
    file: Option<Output>,
    retry: Retry,
    lost: Arc<AtomicU64>,
    /// The last line was written in part.
    torn: bool,
}

impl Sink {
    fn new(path: &Path, lost: Arc<AtomicU64>) -> Self {
        Self {
            path: path.into(),
            file: None,
            retry: Retry::default(),
            lost,
            torn: false,
        }
    }

    fn take(&mut self, entry: &Entry) {
        match entry {
            Entry::Line(line) => self.line(line),
            Entry::Reopen => self.reopen(),
        }
    }

    fn line(&mut self, line: &[u8]) {
        self.miss();
        if self.file.is_none() && !self.path.as_os_str().is_empty() && self.retry.is_due() {
            self.open();
        }
        if self.write(line).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
            return;
        }
        let lost = self.lost.swap(0, Ordering::Relaxed);
        if lost > 0 {
            warn!(
                lines = lost,
                "the log could not be written: lines were lost"
            );
        }
    }

    /// Makes it anew if somebody has deleted it.
    fn miss(&mut self) {
        if !self.file.as_ref().is_some_and(Output::is_deleted) {
            return;
        }
        self.file = None;
        let path = self.path.display();
        warn!("the log {path} was deleted, and what was in it is lost");
        self.open();
    }

    /// Where that fails, the lines go to standard error: nobody looks for them in the old file.
    fn reopen(&mut self) {
        let was_open = self.file.take().is_some();
        if self.open() && was_open {
            info!("the log was opened again");
        }
    }

    fn open(&mut self) -> bool {
        match OwnFile::named(&self.path).and_then(|file| file.append()) {
            Ok(file) => {
                if self.retry.worked() {
                    info!("the log was opened again: before, lines went to standard error");
                }
                self.file = Some(Output::new(file));
                true
            }
            Err(problem) => {
                let pause_s = self.retry.failed().as_secs();
                let path = &self.path;
                error!(
                    "telemetry.log_file = {path:?}: {problem}; lines go to standard error, and it is tried again in {pause_s} s"
                );
                false
            }
        }
    }

    fn write(&mut self, line: &[u8]) -> io::Result<()> {
        let result = match &mut self.file {
            Some(output) => whole(&mut output.file, line, self.torn),
            None => whole(&mut io::stderr(), line, self.torn),
        };
        // Whether a part of it came through is not known: an empty line does no harm.
        self.torn = result.is_err();
        result
    }
}

fn whole(to: &mut impl Write, line: &[u8], torn: bool) -> io::Result<()> {
    if torn {
        to.write_all(b"\n")?;
    }
    to.write_all(line)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::FileTypeExt;

    use super::*;

    fn sink(path: &Path) -> Sink {
        Sink::new(path, Arc::default())
    }

    #[test]
    fn a_file_that_was_moved_away_is_opened_again() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log");
        let mut sink = sink(&path);
        sink.line(b"one\n");
        std::fs::rename(&path, path.with_extension("1")).unwrap();
        sink.line(b"two\n");
        sink.reopen();
        sink.line(b"three\n");
        let read = |path: &Path| std::fs::read_to_string(path).unwrap();
        assert_eq!(read(&path.with_extension("1")), "one\ntwo\n");
        assert_eq!(read(&path), "three\n");
    }

    #[test]
    fn a_file_that_was_deleted_is_made_anew() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("below/log");
        let below = path.parent().unwrap();
        std::fs::create_dir(below).unwrap();
        let mut sink = sink(&path);
        sink.line(b"one\n");
        std::fs::remove_file(&path).unwrap();
        sink.line(b"two\n");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "two\n");
        std::fs::remove_dir_all(below).unwrap();
        sink.line(b"to standard error\n");
        std::fs::create_dir(below).unwrap();
        sink.retry.worked();
        sink.line(b"three\n");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "three\n");
    }

    #[test]
    fn what_a_full_disk_does_not_take_is_counted() {
        let full = Path::new("/dev/full");
        assert!(full.metadata().unwrap().file_type().is_char_device());
        let mut sink = sink(full);
        (0..3).for_each(|_| sink.line(b"lost\n"));
        assert_eq!(sink.lost.load(Ordering::Relaxed), 3);
    }
}
