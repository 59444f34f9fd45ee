//! Telemetry's side: lines into a file, by a thread that may wait for the disk.

use std::fs::{File, Metadata};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use coloc_shm_types::private::{NotPrivate, OwnFile};
use tracing::{info, warn};

use super::Record;
use crate::aside::Aside;
use crate::deleted::Output;
use crate::retry::Retry;

/// A few seconds of batches can wait for a slow disk.
const BATCHES: usize = 100;
/// Recordings of one name beside one another.
const MOST_NAMES: u32 = 10_000;

/// Takes in records, and never waits.
#[derive(Debug)]
pub struct Recorder {
    aside: Aside<Vec<Record>>,
    batch: Vec<Record>,
    /// Lines that found no room since the writer was last told so.
    lost: u64,
}

impl Recorder {
    /// Records to `path`, or, as no recording is ever overwritten, to the first of `path`.1, `path`.2 … that is free.
    ///
    /// # Errors
    /// If there is no thread to be had. A file that cannot be made is tried again.
    pub fn start(path: &Path) -> io::Result<Self> {
        let mut file = RecordFile::new(path);
        Ok(Self {
            aside: Aside::start("colocd-record", BATCHES, move |batch| file.take(batch))?,
            batch: Vec::new(),
            lost: 0,
        })
    }

    /// Adds a line.
    pub fn take(&mut self, record: Record) {
        self.batch.push(record);
    }

    /// Hands what was taken to the writer.
    pub fn hand_on(&mut self) {
        if self.batch.is_empty() {
            return;
        }
        if self.lost > 0 {
            let lines = std::mem::take(&mut self.lost);
            self.batch.insert(0, Record::Lost { lines });
        }
        if let Err(batch) = self.aside.offer(std::mem::take(&mut self.batch)) {
            self.lost = lines(&batch);
        }
    }

    /// Waits until everything is written, no longer than `patience`.
    pub fn finish(&mut self, patience: Duration) {
        self.hand_on();
        self.aside.finish(patience);
    }
}

/// How many lines of a recording `batch` stands for.
fn lines(batch: &[Record]) -> u64 {
    let lines = |record: &Record| match record {
        Record::Lost { lines } => *lines,
        _ => 1,
    };
    batch.iter().map(lines).sum()
}

/// Lives on the thread that may wait for it.
struct RecordFile {
    /// What was asked for.
    wanted: PathBuf,
    /// What was free.
    path: PathBuf,
    file: Option<Output>,
    retry: Retry,
    /// The first line of every file.
    begin: Option<Record>,
    has_begun: bool,
    works: bool,
    /// Lines behind the first, in the file.
    written: u64,
    /// Lines that are not there yet to be told of.
    lost: u64,
    /// The last line was written in part.
    torn: bool,
}

impl RecordFile {
    fn new(path: &Path) -> Self {
        Self {
            wanted: path.into(),
            path: path.into(),
            file: None,
            retry: Retry::default(),
            begin: None,
            has_begun: false,
            works: true,
            written: 0,
            lost: 0,
            torn: false,
        }
    }

    fn take(&mut self, mut batch: Vec<Record>) {
        if let Some(begin @ Record::Begin { .. }) = batch.first() {
            self.begin = Some(*begin);
            batch.remove(0);
        }
        self.miss();
        if self.file.is_none() && self.retry.is_due() {
            self.open();
        }
        if self.file.is_none() {
            self.lost += lines(&batch);
            return;
        }
        let lost = (self.lost > 0).then_some(Record::Lost { lines: self.lost });
        let begin = self.begin.filter(|_| !self.has_begun);
        batch.splice(0..0, begin.into_iter().chain(lost));
        self.has_begun = true;
        self.lost = 0;
        self.write(&batch);
    }

    /// Begins another if somebody has deleted it; all lines of the first are missing in that one.
    fn miss(&mut self) {
        if !self.file.as_ref().is_some_and(Output::is_deleted) {
            return;
        }
        let lines = self.written;
        warn!(
            lines,
            "the recording {} was deleted, another one is begun",
            self.path.display()
        );
        let lost = self.lost + self.written;
        let (begin, wanted) = (self.begin, std::mem::take(&mut self.wanted));
        *self = Self {
            begin,
            lost,
            ..Self::new(&wanted)
        };
    }

    fn open(&mut self) {
        match create(&self.wanted) {
            Ok((file, path)) => {
                info!("recording to {}", path.display());
                self.retry.worked();
                self.file = Some(Output::new(file));
                self.path = path;
            }
            Err(problem) => {
                let (path, pause_s) = (self.wanted.display(), self.retry.failed().as_secs());
                warn!(
                    pause_s,
                    "nothing is recorded until {path} can be made: {problem}"
                );
            }
        }
    }

    fn write(&mut self, batch: &[Record]) {
        let mut text = if self.torn { vec![b'\n'] } else { Vec::new() };
        let mut ends = vec![];
        for record in batch {
            // Numbers and names only: nothing in it that JSON could not say.
            let _ = serde_json::to_writer(&mut text, record);
            text.push(b'\n');
            ends.push(text.len());
        }
        let (written, result) = self.write_some(&text);
        let whole = ends.iter().take_while(|&&end| end <= written).count();
        self.torn = written < text.len();
        let (there, missing) = batch.split_at(whole);
        let begins = |record: &&Record| matches!(record, Record::Begin { .. });
        self.written += lines(there) - there.iter().filter(begins).count() as u64;
        self.lost = lines(missing);
        self.tell(result);
    }

    /// How much of `text` was written, and what stopped it.
    fn write_some(&mut self, text: &[u8]) -> (usize, io::Result<()>) {
        let Some(Output { file, .. }) = &mut self.file else {
            return (0, Ok(()));
        };
        let mut written = 0;
        while let Some(rest) = text.get(written..).filter(|rest| !rest.is_empty()) {
            match file.write(rest) {
                Ok(0) => return (written, Err(ErrorKind::WriteZero.into())),
                Ok(count) => written += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return (written, Err(error)),
            }
        }
        (written, Ok(()))
    }

    fn tell(&mut self, result: io::Result<()>) {
        let path = self.path.display();
        match result {
            Ok(()) if !self.works => info!("the recording {path} goes on, with a gap"),
            Err(problem) if self.works => {
                warn!("the recording {path} has a gap from here on: {problem}");
            }
            _ => return,
        }
        self.works = !self.works;
    }
}

/// A file that was not there, and its name. A pipe or a device is written to as it is.
fn create(path: &Path) -> Result<(File, PathBuf), NotPrivate> {
    let is_special = |found: Metadata| !found.is_file() && !found.is_dir();
    if path.metadata().is_ok_and(is_special) {
        return Ok((OwnFile::named(path)?.append()?, path.into()));
    }
    let mut number = 0;
    loop {
        let name = numbered(path, number);
        match OwnFile::named(&name)?.create_new() {
            Err(problem) if problem.kind() == ErrorKind::AlreadyExists && number < MOST_NAMES => {
                number += 1;
            }
            result => return result.map(|file| (file, name)),
        }
    }
}

fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = path.to_owned().into_os_string();
    if number > 0 {
        name.push(format!(".{number}"));
    }
    name.into()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::FileTypeExt;

    use super::*;

    const TICK: Record = Record::Tick {
        tick: 1,
        stamp_ns: 2,
        inputs: 0,
        step: crate::record::Step::Own,
    };

    fn records(path: &Path) -> Vec<Record> {
        let text = std::fs::read_to_string(path).unwrap();
        text.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }

    #[test]
    fn no_recording_is_overwritten() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.jsonl");
        let names: Vec<PathBuf> = (0..3).map(|_| create(&path).unwrap().1).collect();
        let expected =
            ["a.jsonl", "a.jsonl.1", "a.jsonl.2"].map(|name| directory.path().join(name));
        assert_eq!(names, expected);
    }

    #[test]
    fn what_cannot_be_written_is_counted() {
        let full = Path::new("/dev/full");
        assert!(full.metadata().unwrap().file_type().is_char_device());
        let mut file = RecordFile::new(full);
        (0..3).for_each(|_| file.take(vec![TICK; 5]));
        assert_eq!((file.lost, file.works), (15, false));
    }

    #[test]
    fn a_folder_that_comes_later_gets_the_beginning_and_the_count() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("later/a.jsonl");
        let mut file = RecordFile::new(&path);
        let begin = Record::begin(1, 0, &coloc_estimator::Start::Unknown, None);
        file.take(vec![begin, TICK, TICK]);
        std::fs::create_dir(directory.path().join("later")).unwrap();
        file.retry.worked();
        file.take(vec![TICK]);
        assert_eq!(records(&path), [begin, Record::Lost { lines: 2 }, TICK]);
    }

    #[test]
    fn a_recording_that_was_deleted_is_begun_again_and_says_what_went() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("below/a.jsonl");
        let below = path.parent().unwrap();
        std::fs::create_dir(below).unwrap();
        let begin = Record::begin(1, 0, &coloc_estimator::Start::Unknown, None);
        let mut file = RecordFile::new(&path);
        file.take(vec![begin, TICK, TICK]);
        std::fs::remove_file(&path).unwrap();
        file.take(vec![TICK]);
        assert_eq!(records(&path), [begin, Record::Lost { lines: 2 }, TICK]);
        std::fs::remove_dir_all(below).unwrap();
        file.take(vec![TICK]);
        std::fs::create_dir(below).unwrap();
        std::fs::write(&path, "somebody else's").unwrap();
        file.retry.worked();
        file.take(vec![TICK]);
        let next = numbered(&path, 1);
        assert_eq!(records(&next), [begin, Record::Lost { lines: 4 }, TICK]);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "somebody else's");
    }
}
