//! Two robots, who listens to them and who feeds them, in a space of their own.

mod answer;
mod config;
mod recovery;
mod start;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use coloc_daemon::config::Config;
use coloc_tests::surroundings::realtime_ns;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::fault::{Outcome, fault};
use crate::files::{self, Entry, SHARED_MEMORY, list};
use crate::litter::Litter;
use crate::program::{Program, part, then_part};
use crate::stage::Stage;
use crate::watch::Watch;

use answer::PATIENCE;
pub(crate) use answer::{ANSWER, Answer};
use config::{PREFIX, ROBOTS, Settings};
pub(crate) use start::{Harm, Started};

/// The robot that is harmed.
pub(crate) const VICTIM: usize = 0;
/// The one that must not notice.
pub(crate) const OTHER: usize = 1;
/// Within which everybody has connected to everybody.
const SETTLED: Duration = Duration::from_millis(300);

/// Who can be harmed.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Who {
    Daemon,
    Reader,
    Feeder,
}

impl Who {
    pub(crate) const ALL: [Self; 3] = [Self::Daemon, Self::Reader, Self::Feeder];

    pub(crate) fn any(chance: &mut ChaCha8Rng) -> Self {
        *Self::ALL.choose(chance).expect("there are three")
    }
}

pub(crate) struct Fleet {
    /// What is harmed: the space's root, the bus, beliefs and logs.
    pub(crate) directory: TempDir,
    /// What is not: configurations, and what the programs say.
    notes: TempDir,
    /// Of its files in shared memory.
    full_prefix: String,
    colocd: Option<PathBuf>,
    settings: Settings,
    /// A reader who tells all that it hears.
    witness: Option<Program>,
    watch: Option<Watch>,
    /// The robots that nobody harms.
    others: Vec<Program>,
    pub(crate) litter: Litter,
}

impl Fleet {
    /// Nobody runs yet.
    pub(crate) fn new(stage: &Stage) -> Outcome<Self> {
        Self::with_settings(stage, |_, _| ())
    }

    /// With what is otherwise in the configurations; it is told the fleet's directory.
    pub(crate) fn with_settings(
        stage: &Stage,
        settings: impl Fn(&mut Config, &Path) + 'static,
    ) -> Outcome<Self> {
        let mut fleet = Self {
            directory: tempfile::tempdir().unwrap(),
            notes: tempfile::tempdir().unwrap(),
            full_prefix: String::new(),
            colocd: stage.colocd.clone(),
            settings: Box::new(settings),
            witness: None,
            watch: None,
            others: Vec::new(),
            litter: Litter::default(),
        };
        fleet.write_configurations();
        fleet.full_prefix = fleet.visit()?;
        Ok(fleet)
    }

    /// The robot that nobody harms runs, and the witness.
    pub(crate) fn with_other(stage: &Stage) -> Outcome<Self> {
        Self::new(stage)?.joined_by_other()
    }

    pub(crate) fn joined_by_other(mut self) -> Outcome<Self> {
        self.start_witness()?;
        let mut other = self.start(Who::Daemon, OTHER);
        self.answers(&mut other)?;
        self.others.push(other.program);
        self.keep();
        Ok(self)
    }

    /// From here on nothing of what is there now may go.
    pub(crate) fn keep(&mut self) {
        sleep(SETTLED);
        self.litter.keep(self.files());
    }

    pub(crate) fn watch(&self) -> &Watch {
        self.watch.as_ref().expect("there is a witness")
    }

    /// A tick is heard that begins after now.
    pub(crate) fn ticks_now(&self, robot: usize) -> bool {
        let patience = ANSWER.patience();
        self.watch().ticks_after(robot, realtime_ns(), patience)
    }

    pub(crate) fn root(&self) -> PathBuf {
        self.directory.path().join("shm")
    }

    /// All files of the space.
    pub(crate) fn files(&self) -> BTreeSet<Entry> {
        files::of(&self.root(), &self.full_prefix)
    }

    /// A directory of the file system in which an entry is, where nobody looks for files of this space.
    pub(crate) fn aside(&self, entry: &Entry) -> &Path {
        let shared_memory = Path::new(SHARED_MEMORY);
        if entry.path.starts_with(shared_memory) {
            shared_memory
        } else {
            self.directory.path()
        }
    }

    /// What a power cut can spoil.
    pub(crate) fn files_and_beliefs(&self) -> Vec<PathBuf> {
        let beliefs = ROBOTS.map(|name| self.directory.path().join(format!("{name}.belief.toml")));
        let files = self.files().into_iter().map(|entry| entry.path);
        files.chain(beliefs).collect()
    }

    fn place(&self) -> Vec<String> {
        let root = self.root().display().to_string();
        [&root, PREFIX]
            .iter()
            .chain(&ROBOTS)
            .map(ToString::to_string)
            .collect()
    }

    /// Whoever is not harmed lives.
    pub(crate) fn look(&mut self) -> Outcome {
        for program in self.others.iter_mut().chain(&mut self.witness) {
            program.look()?;
        }
        Ok(())
    }

    fn evidence(&self) -> String {
        let mut text = String::new();
        for program in self.others.iter().chain(&self.witness) {
            let _ = write!(text, "\n  {}:{}", program.name(), program.evidence());
        }
        text
    }

    /// Everybody ends in good order, and nothing is left.
    pub(crate) fn end(mut self) -> Outcome<Vec<Duration>> {
        let mut took = Vec::new();
        for program in self.others.iter_mut().chain(&mut self.witness) {
            took.push(program.terminate()?);
        }
        self.nothing_left()?;
        Ok(took)
    }

    pub(crate) fn end_witness(&mut self) -> Outcome {
        let witness = self.witness.take();
        witness.map_or(Ok(()), |mut witness| witness.kill())
    }

    /// Inodes of all that those who are not harmed have open or mapped.
    pub(crate) fn held(&self) -> BTreeSet<u64> {
        let living = self.others.iter().chain(&self.witness);
        living
            .flat_map(|program| files::held_by(program.pid()))
            .collect()
    }

    /// Somebody comes and goes: the full prefix of the space.
    fn visit(&self) -> Outcome<String> {
        let mut command = part("launch");
        then_part(&mut command, "visitor").args(self.place());
        let mut visitor = Program::start("visitor", self.notes.path(), &mut command);
        let prefix = visitor.line("prefix ", PATIENCE.patience())?;
        let status = visitor.wait(PATIENCE.patience())?;
        visitor.judge(status)?;
        Ok(prefix)
    }

    /// The witness ends as if it was killed, so somebody must come to clean up after it.
    pub(crate) fn nothing_left(&self) -> Outcome {
        self.visit()?;
        let left = self.files();
        if left.is_empty() {
            return Ok(());
        }
        fault!("left at the end: {}", list(&left))
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        if self.full_prefix.is_empty() {
            return;
        }
        self.others.clear();
        self.witness = None;
        for entry in self.files() {
            let _ = fs::remove_file(entry.path);
        }
    }
}
