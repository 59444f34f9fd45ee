//! Where a space is: its root directory, its prefix, and how iceoryx2 is told.
use std::io::Write;
use std::os::fd::AsRawFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, FilePath, SemanticString};
use rustix::fs::MemfdFlags;

use super::error::OpenError;
use super::key::Key;

/// iceoryx2 limits paths to 255 bytes, and puts up to 99 and the full prefix (at most 51) behind the root.
const LONGEST_ROOT: usize = 100;
const LONGEST_PREFIX: usize = 16;

/// So long does iceoryx2 wait for a service that is half-made: its maker is dead, or knows nothing of the gate and takes
/// no time at all.
const CREATION: Duration = Duration::from_millis(50);

/// Publishers that leave between two looks of a subscriber and whose last messages it gets all the same; of more, some
/// lose theirs. Each place is looked at in every call: the 128 that are iceoryx2's default cost a sixth of a tick.
const LEAVERS: usize = 16;

/// A root directory and a prefix that is nobody else's.
#[derive(Debug)]
pub(crate) struct Place {
    root: PathBuf,
    family: String,
    prefix: String,
    config: Config,
}

impl Place {
    /// `root` as [`PrivateDirectory`](crate::private::PrivateDirectory) has found it.
    pub(super) fn new(root: &Path, prefix: &str, key: Key) -> Result<Self, OpenError> {
        let family = family(root, prefix);
        let prefix = format!("{family}{key}_");
        let config = configure(root, &prefix)?;
        set_global(&config, root)?;
        Ok(Self {
            root: root.into(),
            family,
            prefix,
            config,
        })
    }

    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// How everything in `/dev/shm` begins that ever was of this root and prefix.
    pub(crate) fn family(&self) -> &str {
        &self.family
    }

    /// How everything of iceoryx2 begins, for as long as the space is not emptied.
    pub(crate) fn prefix(&self) -> &str {
        &self.prefix
    }

    pub(crate) fn config(&self) -> &Config {
        &self.config
    }
}

/// What can be known to be wrong before anything is touched.
pub(super) fn check(root: &Path, prefix: &str) -> Result<(), OpenError> {
    let bytes = root.as_os_str().as_bytes();
    let plain = bytes.iter().all(|byte| (b' '..=b'~').contains(byte));
    let known = iceoryx2::prelude::Path::new(bytes).is_ok();
    if !root.is_absolute() || bytes.len() > LONGEST_ROOT || !plain || !known {
        return Err(bad_root(root));
    }
    check_prefix(prefix)
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

fn bad_root(root: &Path) -> OpenError {
    OpenError::BadRoot {
        root: root.into(),
        limit: LONGEST_ROOT,
    }
}

/// `<prefix>_<FNV-1a 64 of the root's path, 16 hex digits>_`.
///
/// iceoryx2 puts segments of all roots next to each other into `/dev/shm`: this tells people and programs whose they are.
pub(super) fn family(root: &Path, prefix: &str) -> String {
    format!("{prefix}_{:016x}_", hash(root))
}

pub(super) fn hash(root: &Path) -> u64 {
    let bytes = root.as_os_str().as_bytes();
    bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

pub(super) fn configure(root: &Path, prefix: &str) -> Result<Config, OpenError> {
    let bytes = root.as_os_str().as_bytes();
    let path = iceoryx2::prelude::Path::new(bytes)
        .ok()
        .filter(|_| bytes.len() <= LONGEST_ROOT);
    let mut config = Config::default();
    config.global.creation_timeout = CREATION;
    let services = &mut config.defaults.publish_subscribe;
    services.subscriber_expired_connection_buffer = LEAVERS;
    // Not outside of the gate.
    config.global.node.cleanup_dead_nodes_on_destruction = false;
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
    fn the_family_is_the_same_in_every_language() {
        assert_eq!(family(Path::new("a"), "coloc"), "coloc_af63dc4c8601ec8c_");
        assert_eq!(
            family(Path::new("foobar"), "coloc"),
            "coloc_85944171f73967e8_"
        );
    }

    #[test]
    fn unfit_places_are_refused() {
        let long = Path::new("/").join("x".repeat(LONGEST_ROOT));
        let bad_prefix = |prefix| {
            matches!(
                check(Path::new("/a"), prefix),
                Err(OpenError::BadPrefix { .. })
            )
        };
        assert!(bad_prefix("a/b") && bad_prefix("") && bad_prefix("12345678901234567"));
        let odd = ["here", "/ü", "/a\nb", "/a\0b"].map(Path::new);
        for root in odd.into_iter().chain([&*long]) {
            assert!(matches!(check(root, "t"), Err(OpenError::BadRoot { .. })));
        }
        assert!(check(Path::new("/a"), "t").is_ok());
    }
}
