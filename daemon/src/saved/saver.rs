//! Writes beliefs to disk, on a thread of its own: a slow disk delays the next belief and nothing else.

use std::io;
use std::time::Duration;

use tracing::{info, warn};

use super::{Saved, When};
use crate::aside::Aside;
use crate::config::Config;

/// Takes in beliefs; those that come while one is being written are passed over.
#[derive(Debug)]
pub struct Saver {
    aside: Aside<Saved>,
    boot: When,
}

impl Saver {
    /// Writes to where `config` says.
    ///
    /// # Errors
    /// If there is no thread to be had.
    pub fn start(config: &Config) -> io::Result<Self> {
        let mut state = StateFile {
            config: config.clone(),
            works: true,
        };
        Ok(Self {
            aside: Aside::start("colocd-save", 1, move |saved| state.write(&saved))?,
            boot: When::now(),
        })
    }

    /// What `CLOCK_BOOTTIME` called `boot_ns`, not long ago.
    #[must_use]
    pub fn when(&self, boot_ns: i64) -> When {
        self.boot.at(boot_ns)
    }

    /// To be written, unless the disk has not done with others yet: there will be a newer one.
    pub fn offer(&self, saved: Saved) {
        let _ = self.aside.offer(saved);
    }

    /// Waits for what is being written, no longer than `patience`.
    pub fn finish(&self, patience: Duration) {
        self.aside.finish(patience);
    }
}

struct StateFile {
    config: Config,
    works: bool,
}

impl StateFile {
    fn write(&mut self, saved: &Saved) {
        match saved.write(&self.config) {
            Ok(()) if !self.works => info!("the belief is saved again"),
            Err(problem) if self.works => warn!("the belief is not saved: {problem}"),
            _ => return,
        }
        self.works = !self.works;
    }
}

impl Saved {
    /// Puts it where `config` says, and brings it to the disk.
    ///
    /// # Errors
    /// What the system says; the old file is then still whole.
    pub fn write(&self, config: &Config) -> io::Result<()> {
        let text = toml::to_string(self).map_err(io::Error::other)?;
        let file = config.state().map_err(io::Error::other)?;
        file.replace(text.as_bytes()).map_err(io::Error::other)
    }
}
