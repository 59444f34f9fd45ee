//! Where shared memory, state and other files are: as configured, or in their default places.

use std::path::{Path, PathBuf};

use coloc_drivers::can::BusSpec;
use coloc_shm_types::places::{self, NoPlace, SharedMemoryRoot};
use coloc_shm_types::private::{OwnFile, PrivateDirectory};
use coloc_shm_types::{Group, NoGroup, OpenError, Space};

use super::Config;

impl Config {
    /// A relative path begins in `directory`, where the configuration is, whatever directory the daemon was started in.
    pub(super) fn resolve(&mut self, directory: &Path) {
        // Where the working directory is gone there is nothing better than the path as it is written.
        let directory = std::path::absolute(Path::new(".").join(directory))
            .unwrap_or_else(|_| directory.into());
        let written = |path: &&mut PathBuf| !path.as_os_str().is_empty();
        self.paths()
            .filter(written)
            .for_each(|path| *path = directory.join(&*path));
    }

    /// Of everything that is read, written or listened to below a path.
    fn paths(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let files = &mut self.telemetry;
        let written = [
            &mut files.log_file,
            &mut files.state_file,
            &mut files.record,
        ];
        let wheels = self.odometry.as_mut().map(|odometry| {
            let buses = odometry.buses.iter_mut().filter_map(bus_path);
            odometry.dbc.iter_mut().chain(buses)
        });
        written.into_iter().chain(wheels.into_iter().flatten())
    }

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

    /// The group that may read the newest estimate, if one is configured.
    ///
    /// # Errors
    /// If there is no such group on this computer, or this user may open nothing to it.
    pub fn readers(&self) -> Result<Option<Group>, NoGroup> {
        if self.shm.group.is_empty() {
            return Ok(None);
        }
        let group = Group::find(&self.shm.group)?;
        group.check_membership()?;
        Ok(Some(group))
    }

    /// Takes part in the shared memory under `name`.
    ///
    /// # Errors
    /// As [`Space::open`], and if there is no place.
    pub fn open_space(&self, name: &str) -> Result<Space, OpenError> {
        Space::open(&self.shm_root()?.path, &self.shm.prefix, name)
    }

    /// Where that will be, in words.
    pub(super) fn state_place(&self) -> String {
        let configured = &self.telemetry.state_file;
        if !configured.as_os_str().is_empty() {
            return configured.display().to_string();
        }
        let name = format!("{}.belief.toml", self.robot.name);
        match places::state_directory() {
            Ok(directory) => directory.join(name).display().to_string(),
            Err(problem) => problem.to_string(),
        }
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

/// Where its log or its sockets are.
fn bus_path(bus: &mut BusSpec) -> Option<&mut PathBuf> {
    match bus {
        BusSpec::SocketCan { .. } => None,
        BusSpec::Candump { path, .. } => Some(path),
        BusSpec::Local { directory } => Some(directory),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readers_find_the_same_place_without_a_configuration() {
        let text = "[robot]\nname = \"a\"\nid = 3\n";
        let config = Config::parse(text, Path::new("a.toml")).unwrap();
        assert_eq!(config.shm_root().ok(), places::shared_memory_root().ok());
        assert_eq!(config.shm.prefix, places::DEFAULT_PREFIX);
    }

    /// Every path that a configuration can have, all of them `path`.
    fn with_paths(path: &str) -> String {
        format!(
            "[robot]\nname = \"a\"\nid = 3\n\
             [telemetry]\nlog_file = \"{path}\"\nstate_file = \"{path}1\"\nrecord = \"{path}2\"\n\
             [odometry]\nbuses = [\"candump:{path}3?interface=can0\", \"local:{path}4\", \"socketcan:can0\"]\n\
             max_speed_mps = 2.0\n[odometry.wheels]\ntrack_m = 0.3\n\
             left = {{ message = \"WheelLeft\", signal = \"Ticks\", metres_per_tick = 1e-4 }}\n\
             right = {{ message = \"WheelRight\", signal = \"Ticks\", metres_per_tick = 1e-4 }}\n"
        )
    }

    fn paths_of(text: &str, file: &str) -> Vec<PathBuf> {
        let mut config = Config::parse(text, Path::new(file)).unwrap();
        config.paths().map(|path| path.clone()).collect()
    }

    #[test]
    fn relative_paths_begin_where_the_configuration_is() {
        let below = |name: &str| PathBuf::from(format!("/etc/coloc/{name}"));
        assert_eq!(
            paths_of(&with_paths("x"), "/etc/coloc/robot.toml"),
            ["x", "x1", "x2", "x3", "x4"].map(below)
        );
        let here = std::env::current_dir().unwrap().join("x");
        assert_eq!(paths_of(&with_paths("x"), "robot.toml")[0], here);
        let absolute = PathBuf::from("/x");
        assert_eq!(paths_of(&with_paths("/x"), "/etc/a.toml")[0], absolute);
    }

    #[test]
    fn a_file_that_is_not_configured_stays_so() {
        let minimal = "[robot]\nname = \"a\"\nid = 3\n";
        assert_eq!(
            paths_of(minimal, "/etc/coloc/robot.toml"),
            vec![PathBuf::new(); 3]
        );
    }
}
