//! What a power cut does to files.

use std::fs::{self, File, OpenOptions};
use std::io::Result;
use std::os::unix::fs::FileExt;
use std::path::Path;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

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
pub(crate) fn unmake(path: &Path, chance: &mut ChaCha8Rng) {
    let length = fs::metadata(path).map_or(0, |metadata| metadata.len());
    let emptied = open(path).and_then(|file| {
        file.set_len(0)?;
        file.set_len(if chance.random() { length } else { 0 })
    });
    let _ = emptied; // It may have gone meanwhile.
}

fn overwrite(path: &Path, bytes: &[u8]) -> Result<()> {
    open(path)?.write_all_at(bytes, 0)
}

fn open(path: &Path) -> Result<File> {
    OpenOptions::new().write(true).open(path)
}
