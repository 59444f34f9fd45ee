//! Where a space is: its root directory, its prefix, and how iceoryx2 is told.
use std::io::Write;
use std::os::fd::AsRawFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, FilePath, SemanticString};
use rustix::fs::MemfdFlags;

use super::error::OpenError;

/// iceoryx2 limits paths to 255 bytes, and puts up to 99 and the full prefix behind the root.
const LONGEST_ROOT: usize = 100;
const LONGEST_PREFIX: usize = 16;

/// A root directory that exists and is ours, and a prefix that is nobody else's.
#[derive(Debug)]
pub(crate) struct Place {
    root: PathBuf,
    prefix: String,
    config: Config,
}

impl Place {
    pub(crate) fn prepare(root: &Path, prefix: &str) -> Result<Self, OpenError> {
        check_prefix(prefix)?;
        let root = make_root(root)?;
        let prefix = full_prefix(&root, prefix);
        let config = configure(&root, &prefix)?;
        set_global(&config, &root)?;
        Ok(Self {
            root,
            prefix,
            config,
        })
    }

    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    pub(crate) fn prefix(&self) -> &str {
        &self.prefix
    }

    pub(crate) fn config(&self) -> &Config {
        &self.config
    }
}

fn check_prefix(prefix: &str) -> Result<(), OpenError> {
    let fits = (1..=LONGEST_PREFIX).contains(&prefix.len());
    let plain = prefix
        .bytes()
        .all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    if fits && plain {
        Ok(())
    } else {
        Err(OpenError::BadPrefix {
            prefix: prefix.into(),
        })
    }
}

fn make_root(root: &Path) -> Result<PathBuf, OpenError> {
    if !root.is_absolute() {
        return Err(bad_root(root));
    }
    let failed = |action| {
        move |source| OpenError::System {
            action,
            path: root.into(),
            source,
        }
    };
    std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(root)
        .map_err(failed("make the shared-memory root"))?;
    let root = root
        .canonicalize()
        .map_err(failed("resolve the shared-memory root"))?;
    check_owner(&root)?;
    Ok(root)
}

fn check_owner(root: &Path) -> Result<(), OpenError> {
    let owner = root
        .metadata()
        .map_err(|source| OpenError::System {
            action: "look at the shared-memory root",
            path: root.into(),
            source,
        })?
        .uid();
    let own = rustix::process::geteuid().as_raw();
    if owner == own {
        Ok(())
    } else {
        Err(OpenError::WrongUser {
            root: root.into(),
            owner,
            own,
        })
    }
}

fn bad_root(root: &Path) -> OpenError {
    OpenError::BadRoot {
        root: root.into(),
        limit: LONGEST_ROOT,
    }
}

/// `<prefix>_<FNV-1a 64 of the root's canonical path, 16 hex digits>_`.
///
/// iceoryx2 puts segments of all roots next to each other into `/dev/shm`. With the root in their name, those that
/// begin with it belong to this space and to no other, so that they may be removed.
fn full_prefix(root: &Path, prefix: &str) -> String {
    let hash = root
        .as_os_str()
        .as_bytes()
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
    format!("{prefix}_{hash:016x}_")
}

fn configure(root: &Path, prefix: &str) -> Result<Config, OpenError> {
    let bytes = root.as_os_str().as_bytes();
    let path = iceoryx2::prelude::Path::new(bytes)
        .ok()
        .filter(|_| bytes.len() <= LONGEST_ROOT);
    let mut config = Config::default();
    config
        .global
        .set_root_path(&path.ok_or_else(|| bad_root(root))?);
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|_| OpenError::BadPrefix {
        prefix: prefix.into(),
    })?;
    Ok(config)
}

/// Makes `config` iceoryx2's process-wide configuration too, under which it looks up dead nodes of which little is left.
///
/// The first space of a process wins; otherwise a file in the working directory would. iceoryx2 takes it from a file only.
fn set_global(config: &Config, root: &Path) -> Result<(), OpenError> {
    let failed = |source| OpenError::System {
        action: "configure iceoryx2 for",
        path: root.into(),
        source,
    };
    let text = toml::to_string(config).map_err(|error| failed(std::io::Error::other(error)))?;
    let memory = rustix::fs::memfd_create("coloc-iceoryx2.toml", MemfdFlags::CLOEXEC)
        .map_err(|error| failed(error.into()))?;
    let mut file = std::fs::File::from(memory);
    file.write_all(text.as_bytes()).map_err(failed)?;
    let path = FilePath::new(format!("/proc/self/fd/{}", file.as_raw_fd()).as_bytes())
        .map_err(|error| failed(std::io::Error::other(format!("{error:?}"))))?;
    Config::setup_global_config_from_file(&path)
        .map_err(|error| failed(std::io::Error::other(error)))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_full_prefix_is_the_same_in_every_language() {
        assert_eq!(
            full_prefix(Path::new("a"), "coloc"),
            "coloc_af63dc4c8601ec8c_"
        );
        assert_eq!(
            full_prefix(Path::new("foobar"), "coloc"),
            "coloc_85944171f73967e8_"
        );
    }

    #[test]
    fn unfit_places_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        let long = directory.path().join("x".repeat(LONGEST_ROOT));
        assert!(matches!(
            Place::prepare(directory.path(), "a/b"),
            Err(OpenError::BadPrefix { .. })
        ));
        assert!(matches!(
            Place::prepare(directory.path(), ""),
            Err(OpenError::BadPrefix { .. })
        ));
        assert!(matches!(
            Place::prepare(Path::new("here"), "t"),
            Err(OpenError::BadRoot { .. })
        ));
        assert!(matches!(
            Place::prepare(&long, "t"),
            Err(OpenError::BadRoot { .. })
        ));
    }
}
