//! Takes what room there is.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file that leaves so much room, until it is dropped.
pub(crate) struct Filler(PathBuf);

const CHUNK: usize = 1 << 16;

impl Filler {
    /// Leaves at most `left` bytes free.
    pub(crate) fn leaving(directory: &Path, left: u64) -> Self {
        let path = directory.join("filler");
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .unwrap();
        let zeros = vec![0; CHUNK];
        while let Some(more) = free(directory).checked_sub(left).filter(|more| *more > 0) {
            let size = usize::try_from(more).unwrap_or(CHUNK).min(CHUNK);
            if file.write_all(&zeros[..size]).is_err() {
                break;
            }
        }
        Self(path)
    }
}

impl Drop for Filler {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

/// Takes all but so many of the files that there may be, until it is dropped.
pub(crate) struct Crowd(PathBuf);

impl Crowd {
    pub(crate) fn leaving(directory: &Path, left: u64) -> Self {
        let own = directory.join("crowd");
        fs::create_dir_all(&own).unwrap();
        let files = || rustix::fs::statvfs(directory).unwrap().f_favail;
        for number in left..files() {
            let _ = File::create(own.join(number.to_string()));
        }
        Self(own)
    }
}

impl Drop for Crowd {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Free bytes.
fn free(directory: &Path) -> u64 {
    let memory = rustix::fs::statvfs(directory).unwrap();
    memory.f_bavail * memory.f_frsize
}
