//! The telemetry thread's side: lines into a file.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tracing::error;

use super::Record;

/// Writes records until the disk refuses one.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    file: Option<BufWriter<File>>,
}

impl Recorder {
    /// Begins the recording at `path`, over an older one. An empty path records nothing.
    ///
    /// # Errors
    /// If the file cannot be made.
    pub fn create(path: &Path) -> io::Result<Self> {
        let wanted = !path.as_os_str().is_empty();
        let file = wanted.then(|| File::create(path)).transpose()?;
        Ok(Self {
            path: path.into(),
            file: file.map(BufWriter::new),
        })
    }

    /// Adds a line. After a failure the recording ends, the robot goes on.
    pub fn write(&mut self, record: &Record) {
        self.attempt(|file| {
            serde_json::to_writer(&mut *file, record)?;
            file.write_all(b"\n")
        });
    }

    /// Hands what was written to the kernel.
    pub fn flush(&mut self) {
        self.attempt(Write::flush);
    }

    fn attempt(&mut self, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) {
        let Some(file) = &mut self.file else { return };
        if let Err(problem) = write(file) {
            error!("the recording {} ends here: {problem}", self.path.display());
            self.file = None;
        }
    }
}
