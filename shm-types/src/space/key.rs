//! A number in the names of a space's files in `/dev/shm`, drawn when the space begins and forgotten when it is empty.
//!
//! Anybody may make files in `/dev/shm`. Nobody can guess these names, so nobody can take them first; and who enters a
//! root directory that was exchanged never meets the files of those who still live in the old one.
use std::fmt;
use std::io::Write;

use super::error::OpenError;
use crate::private::{NotPrivate, PrivateDirectory, unguessable};

/// Below the root: the number, for whoever enters later.
pub(super) const FILE: &str = "key";

const DIGITS: usize = 16;

/// Written as 16 hexadecimal digits.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) struct Key(u64);

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl Key {
    /// `None` if there is none, or a half of one: who drew it died, and somebody draws another when he is alone.
    pub(super) fn read(directory: &PrivateDirectory) -> Result<Option<Self>, NotPrivate> {
        let text = directory.file(FILE)?.read(DIGITS as u64)?;
        Ok(text.and_then(|text| Self::parse(&text)))
    }

    pub(super) fn parse(text: &str) -> Option<Self> {
        let whole = text.len() == DIGITS && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        whole.then(|| u64::from_str_radix(text, 16).ok().map(Self))?
    }

    /// For who is alone in the space.
    pub(super) fn draw(directory: &PrivateDirectory) -> Result<Self, OpenError> {
        let key = Self(unguessable().map_err(|source| OpenError::System {
            action: "draw a number from",
            path: "/dev/urandom".into(),
            source,
        })?);
        let file = directory.file(FILE)?;
        file.remove()?;
        file.create_new()?
            .write_all(key.to_string().as_bytes())
            .map_err(|source| OpenError::System {
                action: "write",
                path: file.path().into(),
                source,
            })?;
        Ok(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_is_read_and_a_half_is_not() {
        let directory = tempfile::tempdir().unwrap();
        let directory = PrivateDirectory::make(directory.path(), |_| true).unwrap();
        assert_eq!(Key::read(&directory).unwrap(), None);
        let key = Key::draw(&directory).unwrap();
        assert_eq!(Key::read(&directory).unwrap(), Some(key));
        assert_ne!(Key::draw(&directory).unwrap(), key);
        std::fs::write(directory.path().join(FILE), "0123").unwrap();
        assert_eq!(Key::read(&directory).unwrap(), None);
    }
}
