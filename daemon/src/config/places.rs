//! Where shared memory and state are: as configured, or in their default places.

use coloc_shm_types::places::{self, NoPlace, SharedMemoryRoot};
use coloc_shm_types::private::{OwnFile, PrivateDirectory};
use coloc_shm_types::{OpenError, Space};

use super::Config;

impl Config {
    /// Root of the shared memory: as configured, or the default place.
    ///
    /// # Errors
    /// If none is configured and this user has no default place.
    pub fn shm_root(&self) -> Result<SharedMemoryRoot, NoPlace> {
        if self.shm.root.as_os_str().is_empty() {
            return places::shared_memory_root();
        }
        Ok(SharedMemoryRoot {
            path: self.shm.root.clone(),
            goes_at_logout: false,
        })
    }

    /// Takes part in the shared memory under `name`.
    ///
    /// # Errors
    /// As [`Space::open`], and if there is no place.
    pub fn open_space(&self, name: &str) -> Result<Space, OpenError> {
        Space::open(&self.shm_root()?.path, &self.shm.prefix, name)
    }

    /// Where the last belief is saved: as configured, or below the default place, which is made if it is not there.
    ///
    /// # Errors
    /// What a person has to do about it.
    pub fn state(&self) -> Result<OwnFile, OpenError> {
        let configured = &self.telemetry.state_file;
        if configured.as_os_str().is_empty() {
            let directory = PrivateDirectory::make(&places::state_directory()?, |_| true)?;
            return Ok(directory.file(&format!("{}.belief.toml", self.robot.name))?);
        }
        Ok(OwnFile::named(configured)?)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn readers_find_the_same_place_without_a_configuration() {
        let text = "[robot]\nname = \"a\"\nid = 3\n";
        let config = Config::parse(text, Path::new("a.toml")).unwrap();
        assert_eq!(config.shm_root().ok(), places::shared_memory_root().ok());
        assert_eq!(config.shm.prefix, places::DEFAULT_PREFIX);
    }
}
