//! What the system must have mounted before a space can be opened.
use std::path::Path;

use super::error::OpenError;
use super::segments::SHARED_MEMORY;

/// What is looked for, its file system, and how that is mounted.
const MOUNTS: [(&str, &str, &str); 2] = [
    (
        SHARED_MEMORY,
        SHARED_MEMORY,
        "mount -t tmpfs -o mode=1777 tmpfs /dev/shm",
    ),
    ("/proc/self/fd", "/proc", "mount -t proc proc /proc"),
];

pub(super) fn check() -> Result<(), OpenError> {
    let missing = MOUNTS.iter().find(|(sign, ..)| !Path::new(sign).is_dir());
    missing.map_or(Ok(()), |&(_, at, command)| {
        Err(OpenError::NotMounted { at, command })
    })
}
