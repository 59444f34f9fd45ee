//! Names of coloc's files in `/dev/shm`, and which of them nobody needs any more.
//!
//! A name is `<prefix>_<hash of the root>_<key>`, the space's name, and then `_…` for iceoryx2's segments and `.…` for
//! coloc's own files. One of these is the lock that everybody holds who is in the space, whatever becomes of its root: it
//! is there before the first segment and goes after the last one.
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::error::OpenError;
use super::key::{self, Key};
use super::lock;
use crate::private::{OwnFile, own_user};

pub(super) const SHARED_MEMORY: &str = "/dev/shm";

const LOCK: &str = ".lock";
const HEX: usize = 16;
const LONGEST_PREFIX: usize = 16;
/// As long as it takes somebody to start again.
const YOUNG: Duration = Duration::from_secs(10);

/// Longest root in a lock file (bytes).
const LIMIT: u64 = 4096;

/// The space's name, of a file's name.
pub(super) fn space_of(name: &str) -> Option<&str> {
    let hex = |text: Option<&str>| {
        text.is_some_and(|text| {
            text.bytes()
                .all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
        })
    };
    let is_space = |start: usize| {
        let (hash, key) = (start + 1, start + 2 + HEX);
        name.get(start..hash) == Some("_")
            && hex(name.get(hash..hash + HEX))
            && name.get(hash + HEX..key) == Some("_")
            && hex(name.get(key..key + HEX))
            && matches!(name.get(key + HEX..=key + HEX), Some("_" | "."))
    };
    let start = (1..=LONGEST_PREFIX).find(|&start| is_space(start))?;
    name.get(..start + 2 + 2 * HEX)
}

/// The root and the prefix of the space of which this is the lock file.
pub(super) fn place_of(name: &str) -> Option<(PathBuf, String)> {
    let space = name
        .strip_suffix(LOCK)
        .filter(|space| space_of(name) == Some(space))?;
    let prefix = space.get(..space.len().checked_sub(2 + 2 * HEX)?)?;
    let root = OwnFile::named(&path(name)).ok()?.read(LIMIT).ok()??;
    Some((root.into(), prefix.to_owned()))
}

/// The root's hash and the key, of a space's name.
fn root_and_key(space: &str) -> Option<(&str, Key)> {
    let (front, key) = space.split_at_checked(space.len().checked_sub(HEX)?)?;
    let hash = front.get(front.len().checked_sub(HEX + 1)?..front.len() - 1)?;
    Some((hash, Key::parse(key)?))
}

/// The prefix, and the root's hash as text, of a space's name.
pub(super) fn prefix_and_hash(space: &str) -> Option<(&str, &str)> {
    let (hash, _) = root_and_key(space)?;
    let prefix = space.get(..space.len().checked_sub(2 + 2 * HEX)?)?;
    Some((prefix, hash))
}

/// The mode of `/dev/shm`, if others may take away there what is not theirs.
pub(super) fn loose_mode() -> Option<u32> {
    let found = rustix::fs::stat(SHARED_MEMORY).ok()?;
    is_loose(found.st_mode).then_some(found.st_mode & 0o7777)
}

/// In a sticky directory only who owns something can remove it.
fn is_loose(mode: u32) -> bool {
    mode & 0o022 != 0 && mode & 0o1000 == 0
}

/// Names of all files of ours.
pub(super) fn list() -> std::io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        let Ok(name) = entry.file_name().into_string() else {
            continue;
        };
        // What vanishes meanwhile was not left behind.
        let ours = || entry.metadata().is_ok_and(|it| it.uid() == own_user());
        if space_of(&name).is_some() && ours() {
            names.push(name);
        }
    }
    Ok(names)
}

pub(super) fn path(name: &str) -> PathBuf {
    Path::new(SHARED_MEMORY).join(name)
}

/// Says to everybody for as long as it lives that somebody is in the space.
pub(super) fn enter(space: &str, root: &Path, deadline: Instant) -> Result<File, OpenError> {
    let path = path(&format!("{space}{LOCK}"));
    loop {
        let mut file = OwnFile::named(&path)?.read_write()?;
        lock::share(&file, &path, deadline)?;
        let found = file.metadata().map_err(look(&path))?;
        if found.len() == 0 {
            file.write_all(root.as_os_str().as_encoded_bytes())
                .map_err(look(&path))?;
        }
        // Who cleaned up just then has removed it.
        if found.nlink() > 0 {
            return Ok(file);
        }
    }
}

fn look(path: &Path) -> impl Fn(std::io::Error) -> OpenError {
    |source| OpenError::System {
        action: "use",
        path: path.into(),
        source,
    }
}

/// Whether the lock file still has its name: whoever empties `/dev/shm` takes away what the space consists of.
pub(super) fn is_in_place(file: impl AsFd) -> bool {
    rustix::fs::fstat(file).is_ok_and(|found| found.st_nlink > 0)
}

/// Removes what spaces have left in which nobody is any more: how many files it was.
///
/// That of `root` with the key `own`, for whoever is alone in there; all others that ever had this root, even if a power cut
/// has spoiled what their locks say; and old ones whose root has gone or begun anew.
pub(super) fn sweep(root: &Path, own: Option<Key>) -> std::io::Result<usize> {
    let names = list()?;
    let spaces: BTreeSet<_> = names.iter().filter_map(|name| space_of(name)).collect();
    let hash = format!("{:016x}", super::config::hash(root));
    let mut removed = 0;
    for space in spaces {
        let of = root_and_key(space);
        let is_same_root = of.is_some_and(|(of, _)| of == hash);
        let is_own = is_same_root && of.map(|(_, key)| key) == own;
        let is_past = is_same_root || is_old(space) && is_abandoned(space);
        if is_own || is_past && !may_be_mapped(space) {
            removed += remove(space, &names)?;
        }
    }
    Ok(removed)
}

fn is_old(space: &str) -> bool {
    let lock = path(&format!("{space}{LOCK}")).symlink_metadata();
    let age = lock.and_then(|it| it.modified()).map(|it| it.elapsed());
    age.is_ok_and(|age| age.is_ok_and(|age| age > YOUNG))
}

/// Whoever enters a root that still has the key cleans up there.
fn is_abandoned(space: &str) -> bool {
    let lock = OwnFile::named(&path(&format!("{space}{LOCK}")));
    let Ok(Some(root)) = lock.and_then(|lock| lock.read(LIMIT)) else {
        return false;
    };
    let key = std::fs::read_to_string(Path::new(&root).join(key::FILE));
    match (key, root_and_key(space)) {
        (Ok(text), Some((_, key))) => Key::parse(&text) != Some(key),
        (Err(error), Some(_)) => error.kind() == ErrorKind::NotFound,
        (_, None) => false,
    }
}

/// Whether a process that knows nothing of the locks may use the space: iceoryx2 from another language, say. Processes of
/// others have none of our files, which are private.
fn may_be_mapped(space: &str) -> bool {
    let Ok(processes) = std::fs::read_dir("/proc") else {
        return true;
    };
    let mut numbered = processes.flatten().filter(|entry| {
        let name = entry.file_name();
        name.as_encoded_bytes().iter().all(u8::is_ascii_digit)
    });
    numbered.any(|process| maps(&process.path(), space))
}

fn maps(process: &Path, space: &str) -> bool {
    match std::fs::read(process.join("maps")) {
        Ok(maps) => maps
            .windows(space.len())
            .any(|window| window == space.as_bytes()),
        // One of ours with rights of its own does not let us look; nor need the system's first one, which runs no robots.
        Err(error) => {
            let is_first = process.file_name() == Some("1".as_ref());
            error.kind() == ErrorKind::PermissionDenied && !is_first && is_own(process)
        }
    }
}

/// By what it runs as: what is below `/proc` belongs to the superuser if a process has rights of its own.
fn is_own(process: &Path) -> bool {
    let status = std::fs::read_to_string(process.join("status")).unwrap_or_default();
    let users = status.lines().find_map(|line| line.strip_prefix("Uid:"));
    let mut users = users.unwrap_or_default().split_ascii_whitespace();
    users.any(|user| user.parse() == Ok(own_user()))
}

/// Removes the files of the space, its lock last, unless somebody holds that.
fn remove(space: &str, names: &[String]) -> std::io::Result<usize> {
    let lock = OwnFile::named(&path(&format!("{space}{LOCK}"))).map_err(std::io::Error::from)?;
    let held = match lock.existing() {
        Ok(Some(file)) if !lock::try_alone(&file) => return Ok(0),
        Ok(file) => file,
        Err(_) => return Ok(0),
    };
    let mut removed = 0;
    let files = names.iter().filter(|name| space_of(name) == Some(space));
    for name in files.filter(|name| !name.ends_with(LOCK)) {
        OwnFile::named(&path(name)).and_then(|file| file.remove())?;
        removed += 1;
    }
    lock.remove()?;
    drop(held);
    Ok(removed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_space_is_known_by_the_names_of_its_files() {
        let space = "t_x_0123456789abcdef_fedcba9876543210";
        for rest in ["_node.global_mgmt", ".lock", "_"] {
            assert_eq!(space_of(&format!("{space}{rest}")), Some(space));
        }
        for other in [
            "",
            "t",
            "_0123456789abcdef_fedcba9876543210_x",
            space,
            "é_0123456789abcdef_x",
        ] {
            assert_eq!(space_of(other), None, "{other}");
        }
        let (hash, key) = root_and_key(space).unwrap();
        assert_eq!(
            (hash, key.to_string().as_str()),
            ("0123456789abcdef", "fedcba9876543210")
        );
    }
}
