//! The readers, seen from the campaign.
use std::error::Error;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use coloc_shm_types::{Odometry, Subscriber};
use rustix::process::{Pid, Signal, kill_process};

use crate::publishing::{OPEN, THREADS};
use crate::reader::is_guest;
use crate::{PATIENCE, Tally};

pub(crate) struct Readers {
    root: PathBuf,
    all: Vec<Reader>,
    acknowledged: Subscriber<Odometry>,
    next: u32,
}

struct Reader {
    number: u32,
    child: Child,
    /// What it said last; nothing yet, if it has not heard both threads.
    known: Option<[u64; THREADS]>,
    stopped: bool,
}

impl Readers {
    pub(crate) fn start(
        count: u16,
        root: PathBuf,
        acknowledged: Subscriber<Odometry>,
    ) -> Result<Self, Box<dyn Error>> {
        let mut readers = Self {
            root,
            all: Vec::new(),
            acknowledged,
            next: 0,
        };
        for _ in 0..count {
            let reader = readers.come()?;
            readers.all.push(reader);
        }
        Ok(readers)
    }

    pub(crate) fn count(&self) -> usize {
        self.all.len()
    }

    fn come(&mut self) -> Result<Reader, Box<dyn Error>> {
        self.next += 1;
        let child = Command::new(std::env::current_exe()?)
            .args(["--read", &self.next.to_string()])
            .arg(&self.root)
            .stdin(Stdio::null())
            .spawn()?;
        Ok(Reader {
            number: self.next,
            child,
            known: None,
            stopped: false,
        })
    }

    /// As the kernel does when memory runs out; another one comes.
    pub(crate) fn kill(&mut self, which: usize) -> Result<(), Box<dyn Error>> {
        self.all[which].end();
        self.all[which] = self.come()?;
        Ok(())
    }

    /// Whether it goes on otherwise.
    pub(crate) fn stop(&mut self, which: usize) -> Result<bool, Box<dyn Error>> {
        let reader = &mut self.all[which];
        reader.signal(Signal::STOP)?;
        Ok(!std::mem::replace(&mut reader.stopped, true))
    }

    pub(crate) fn go_on(&mut self, which: usize) -> Result<(), Box<dyn Error>> {
        let reader = &mut self.all[which];
        reader.stopped = false;
        reader.signal(Signal::CONT)
    }

    /// Until all that are there and not stopped have said so; or who has not.
    pub(crate) fn wait_until_they_know(
        &mut self,
        said: [u64; THREADS],
        tally: &mut Tally,
    ) -> Result<(), String> {
        let deadline = Instant::now() + PATIENCE;
        loop {
            while let Some(message) = self.acknowledged.receive().unwrap() {
                self.hear(&message, tally);
            }
            self.replace_those_who_left(tally);
            let mut asleep = (self.all.iter()).filter(|reader| reader.is_asleep(said));
            let Some(first) = asleep.next() else {
                let awake = self.all.iter().filter(|reader| reader.knows(said));
                tally.awake += awake.count() as u64;
                return Ok(());
            };
            if Instant::now() > deadline {
                let (number, known) = (first.number, first.known);
                return Err(format!("reader {number} knows {known:?} of {said:?}"));
            }
            // It may have left instead.
            let pause = PATIENCE / 1000;
            if let Some(message) = self.acknowledged.wait(pause).unwrap() {
                self.hear(&message, tally);
            }
        }
    }

    fn hear(&mut self, message: &Odometry, tally: &mut Tally) {
        let header = &message.header;
        let known = [header.session, header.sequence];
        let is_its = |reader: &&mut Reader| i64::from(reader.number) == header.stamp_ns;
        if let Some(reader) = self.all.iter_mut().find(is_its) {
            // Who has come since a thread spoke last gets its newest message only with its next.
            if reader.heard_by(known).contains(&0) {
                return;
            }
            tally.came += u64::from(reader.known.is_none());
            reader.known = Some(known);
        }
    }

    fn replace_those_who_left(&mut self, tally: &mut Tally) {
        for which in 0..self.all.len() {
            if let Some(status) = self.all[which].child.try_wait().unwrap() {
                assert!(status.success(), "a reader failed: {status}");
                tally.left += 1;
                self.all[which] = self.come().unwrap();
            }
        }
    }
}

impl Reader {
    fn is_asleep(&self, said: [u64; THREADS]) -> bool {
        !self.stopped && self.known.is_some() && !self.knows(said)
    }

    fn knows(&self, said: [u64; THREADS]) -> bool {
        let known = self.known.as_ref();
        known.is_some_and(|known| self.heard_by(*known) == self.heard_by(said))
    }

    /// Of the threads that it can hear.
    fn heard_by(&self, threads: [u64; THREADS]) -> Vec<u64> {
        let hears = |thread: &usize| !is_guest(self.number) || *thread == OPEN;
        (0..THREADS).filter(hears).map(|it| threads[it]).collect()
    }

    fn signal(&self, signal: Signal) -> Result<(), Box<dyn Error>> {
        let pid = i32::try_from(self.child.id())?;
        kill_process(Pid::from_raw(pid).ok_or("no process")?, signal)?;
        Ok(())
    }

    fn end(&mut self) {
        // Both fail only if it has ended.
        let _ = (self.child.kill(), self.child.wait());
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        self.end();
    }
}
