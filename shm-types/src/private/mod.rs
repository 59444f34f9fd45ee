//! Directories and files that no other user of the machine can read, change or take the place of.
//!
//! * Nothing that somebody else made is followed, believed or written to: a path is walked name by name, and of
//!   symbolic links only those are followed that this user, the superuser or the directory's owner made.
//! * A [`PrivateDirectory`] has mode 0700, whatever it was before, and nobody else can rename it. An [`OwnFile`] is an ordinary file with one
//!   name; what coloc makes has mode 0600. The umask changes nothing.
//! * Whoever may run as this user, and the superuser, are trusted.
mod directory;
mod error;
mod file;
mod owner;
mod walk;

use std::io::Read;

pub use directory::PrivateDirectory;
pub use error::NotPrivate;
pub use file::OwnFile;

/// Whose files are ours: those of the effective user.
pub(crate) fn own_user() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// A number that nobody can guess, for names that nobody shall take first.
///
/// # Errors
/// If the kernel gives none.
pub fn unguessable() -> std::io::Result<u64> {
    let mut bytes = [0; 8];
    std::fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(u64::from_ne_bytes(bytes))
}
