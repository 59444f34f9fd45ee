//! What a power cut does to files.

use std::fs::{self, File, OpenOptions};
use std::io::Result;
use std::os::unix::fs::FileExt;
use std::path::Path;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;
use tempfile::NamedTempFile;

/// As much of a file as is overwritten \[bytes\].
const MOST: u64 = 1 << 20;

/// Truncates it, empties it, overwrites it with zeros or noise, removes it, or leaves it; whether it did something.
pub(crate) fn spoil(path: &Path, chance: &mut ChaCha8Rng) -> bool {
    let Ok(length) = fs::metadata(path).map(|metadata| metadata.len()) else {
        return false;
    };
    let bytes = usize::try_from(length.min(MOST)).unwrap();
    let result = match chance.random_range(0..10) {
        0..3 => open(path).and_then(|file| file.set_len(chance.random_range(0..=length))),
        3 => open(path).and_then(|file| file.set_len(0)),
        4 => overwrite(path, &vec![0; bytes]),
        5 => {
            let mut noise = vec![0; bytes];
            chance.fill(&mut noise[..]);
            overwrite(path, &noise)
        }
        6 => fs::remove_file(path),
        _ => return false,
    };
    result.is_ok()
}

/// Makes it as it was when it was being made: empty, or of its length but without content.
///
/// Another file takes its place: one of the living may just have opened it, and whoever cuts off what another has mapped
/// ends it, which no power cut does. `aside` is a directory of the same file system that nobody looks into.
pub(crate) fn unmake(path: &Path, aside: &Path, chance: &mut ChaCha8Rng) {
    let Ok(was) = fs::metadata(path) else {
        return; // It has gone meanwhile.
    };
    let length = if chance.random() { was.len() } else { 0 };
    let unmade = NamedTempFile::new_in(aside).unwrap();
    unmade.as_file().set_len(length).unwrap();
    unmade.as_file().set_permissions(was.permissions()).unwrap();
    match renameat_with(CWD, unmade.path(), CWD, path, RenameFlags::EXCHANGE) {
        Ok(()) | Err(Errno::NOENT) => {}
        Err(error) => panic!("cannot take the place of {}: {error}", path.display()),
    }
}

fn overwrite(path: &Path, bytes: &[u8]) -> Result<()> {
    open(path)?.write_all_at(bytes, 0)
}

fn open(path: &Path) -> Result<File> {
    OpenOptions::new().write(true).open(path)
}

#[cfg(test)]
mod tests {
    use rand_chacha::rand_core::SeedableRng;

    use super::*;

    #[test]
    fn what_the_living_have_opened_stays_whole_when_its_name_is_of_something_half_made() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("of_the_dead");
        fs::write(&path, [7; 100]).unwrap();
        let opened = File::open(&path).unwrap();
        unmake(&path, directory.path(), &mut ChaCha8Rng::seed_from_u64(1));

        let mut held = [0; 100];
        opened.read_exact_at(&mut held, 0).unwrap();
        assert_eq!(held, [7; 100]);
        assert!(fs::read(&path).unwrap().iter().all(|byte| *byte == 0));
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_has_gone_stays_away() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("gone");
        unmake(&path, directory.path(), &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}
