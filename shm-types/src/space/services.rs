//! The services that this process uses, by the files that describe them.
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::config::Place;
use super::error::Lost;

/// Below the root: a file for each service.
pub(super) const DIRECTORY: &str = "services";
pub(super) const DESCRIPTION: &str = ".service";

/// By these it is noticed that somebody removes or exchanges them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Services(Arc<Mutex<BTreeMap<String, Described>>>);

#[derive(Debug)]
struct Described {
    file: PathBuf,
    identity: Option<(u64, u64)>,
    ports: usize,
}

/// That a port uses a service; ends before the port does, which may remove it.
#[derive(Debug)]
pub(crate) struct Use {
    services: Services,
    name: String,
}

impl Services {
    /// The service `name`, which iceoryx2 knows by `hash`, has one more port.
    pub(crate) fn enter(&self, place: &Place, name: &str, hash: &str) -> Use {
        let file = format!("{}{hash}{DESCRIPTION}", place.prefix());
        let file = place.root().join(DIRECTORY).join(file);
        let mut all = self.lock();
        let described = all.entry(name.into()).or_insert_with(|| Described {
            identity: identity(&file),
            file,
            ports: 0,
        });
        described.ports += 1;
        Use {
            services: self.clone(),
            name: name.into(),
        }
    }

    /// Whether all of them are as they were.
    pub(crate) fn check(&self) -> Result<(), Lost> {
        self.lock().values().try_for_each(Described::check)
    }

    /// Whether this one is, if it is used.
    pub(crate) fn check_one(&self, name: &str) -> Result<(), Lost> {
        self.lock().get(name).map_or(Ok(()), Described::check)
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Described>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Described {
    fn check(&self) -> Result<(), Lost> {
        if self.identity.is_some() && identity(&self.file) == self.identity {
            Ok(())
        } else {
            Err(Lost(self.file.clone()))
        }
    }
}

impl Drop for Use {
    fn drop(&mut self) {
        let mut all = self.services.lock();
        if let Some(described) = all.get_mut(&self.name) {
            described.ports -= 1;
            if described.ports == 0 {
                all.remove(&self.name);
            }
        }
    }
}

fn identity(file: &Path) -> Option<(u64, u64)> {
    let found = file.symlink_metadata().ok()?;
    Some((found.dev(), found.ino()))
}
