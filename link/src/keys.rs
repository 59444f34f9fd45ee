//! Keys: who a robot is, and who may change the team.
//!
//! A robot has one Ed25519 key. It signs what the robot says, and TLS proves it on every connection; no authority stands between the two,
//! because the roster already says which key is whose. A certificate would say it once more, and go on saying it after the roster has
//! stopped: revocation would wait for a list, renewal for a reissue, and a robot whose clock is wrong would be a stranger. So TLS is
//! given the bare public key (RFC 7250), which has no dates, no names and no parser of certificates, and the roster decides alone.
//! The team's key signs rosters, and nothing else.
//!
//! Private keys are files of mode 0600 in a directory of mode 0700.
use std::fmt;
use std::io::{self, Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use coloc_shm_types::private::{NotPrivate, OwnFile, PrivateDirectory};
use ed25519_dalek::{SigningKey, VerifyingKey};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// The file of a robot's private key in its directory.
pub const ROBOT_KEY: &str = "robot.key";
/// The file of the team's private key, where the operator keeps it.
pub const TEAM_KEY: &str = "team.key";
/// The file of the team's public key: who has it believes what that key signs.
pub const TEAM: &str = "team.pub";

const PRIVATE: &str = "coloc-ed25519-private ";

/// The longest file of a key that is read (bytes).
const LONGEST: u64 = 256;

/// An Ed25519 public key; text of it is 64 hexadecimal digits.
#[derive(Copy, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PublicKey([u8; 32]);

/// Not a public key.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a public key is 64 hexadecimal digits, and a point of the curve")]
pub struct NotAKey;

/// A private key, of a robot or of a team.
pub struct Identity(SigningKey);

/// Why there is no key.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// It is not there.
    #[error("there is no key at {}: make one with `coloc-link fleet`", .0.display())]
    Missing(PathBuf),
    /// Others may read it.
    #[error("{} can be read by others (mode {mode:o}): chmod 600 it, and if somebody may have read it, renew it", path.display())]
    Open {
        /// Where.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// It is something else.
    #[error("{} is not a key", .0.display())]
    NotAKey(PathBuf),
    /// There is one already.
    #[error("{} is there already: a key is never overwritten", .0.display())]
    There(PathBuf),
    /// The file or its directory is not ours alone.
    #[error(transparent)]
    NotPrivate(#[from] NotPrivate),
    /// What the system says.
    #[error(transparent)]
    System(#[from] io::Error),
}

impl PublicKey {
    /// Of its bytes.
    ///
    /// # Errors
    /// If they are no point of the curve, or one of those of small order, for which signatures prove nothing.
    pub fn of(bytes: [u8; 32]) -> Result<Self, NotAKey> {
        let point = VerifyingKey::from_bytes(&bytes).map_err(|_| NotAKey)?;
        if point.is_weak() {
            return Err(NotAKey);
        }
        Ok(Self(bytes))
    }

    /// Its bytes.
    #[must_use]
    pub const fn bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// What checks signatures; `None` never, but the curve says so and not this type.
    #[must_use]
    pub fn verifier(&self) -> Option<VerifyingKey> {
        VerifyingKey::from_bytes(&self.0).ok()
    }

    /// The number of the team whose key it is, as it stands in an envelope: its first eight bytes.
    #[must_use]
    pub fn team(&self) -> u64 {
        let first = self.0.first_chunk().copied();
        first.map_or(0, u64::from_le_bytes)
    }
}

impl fmt::Display for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex(&self.0))
    }
}

impl fmt::Debug for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl FromStr for PublicKey {
    type Err = NotAKey;

    fn from_str(text: &str) -> Result<Self, NotAKey> {
        Self::of(unhex(text).ok_or(NotAKey)?)
    }
}

impl Serialize for PublicKey {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for PublicKey {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?
            .parse()
            .map_err(de::Error::custom)
    }
}

impl Identity {
    /// A new one.
    ///
    /// # Errors
    /// If the kernel gives no random numbers.
    pub fn generate() -> io::Result<Self> {
        let mut seed = [0; 32];
        std::fs::File::open("/dev/urandom")?.read_exact(&mut seed)?;
        Ok(Self::of_seed(&seed))
    }

    /// Of its seed: for tests, and for [`Self::insecure`].
    #[must_use]
    pub fn of_seed(seed: &[u8; 32]) -> Self {
        Self(SigningKey::from_bytes(seed))
    }

    /// One that everybody can make, for a robot of `[link] insecure = true`: the same code runs, and proves nothing.
    #[must_use]
    pub fn insecure(robot: u16) -> Self {
        let mut seed = [0; 32];
        seed[..2].copy_from_slice(&robot.to_le_bytes());
        Self::of_seed(&seed)
    }

    /// Reads the key `name` in `directory`.
    ///
    /// # Errors
    /// If it is not there, is not one, or anybody else could have read or written it.
    pub fn load(directory: &Path, name: &str) -> Result<Self, KeyError> {
        let missing = || KeyError::Missing(directory.join(name));
        let held = match PrivateDirectory::open(directory, |_| true) {
            Ok(held) => held,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(missing()),
            Err(error) => return Err(error.into()),
        };
        let file = held.file(name)?;
        let opened = file.existing()?.ok_or_else(missing)?;
        let mode = opened.metadata()?.permissions().mode() & 0o7777;
        let path = file.path().to_owned();
        if mode & 0o077 != 0 {
            return Err(KeyError::Open { path, mode });
        }
        let mut text = String::new();
        opened.take(LONGEST).read_to_string(&mut text)?;
        let seed = text.trim_end().strip_prefix(PRIVATE).and_then(unhex);
        seed.map(|seed| Self::of_seed(&seed))
            .ok_or(KeyError::NotAKey(path))
    }

    /// Writes it as `name` in `directory`, which is made if it is not there; an old key is never overwritten.
    ///
    /// # Errors
    /// If there is one, or the directory cannot be ours alone.
    pub fn save(&self, directory: &Path, name: &str) -> Result<(), KeyError> {
        let held = PrivateDirectory::make(directory, |_| true)?;
        let file = held.file(name)?;
        let mut made = match file.create_new() {
            Ok(made) => made,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                return Err(KeyError::There(file.path().to_owned()));
            }
            Err(error) => return Err(error.into()),
        };
        made.write_all(self.text().as_bytes())?;
        Ok(made.sync_all()?)
    }

    /// Writes it in the place of another one, which is lost.
    ///
    /// # Errors
    /// If the directory is not ours alone, and what the system says.
    pub fn replace(&self, directory: &Path, name: &str) -> Result<(), KeyError> {
        let held = PrivateDirectory::open(directory, |_| true)?;
        Ok(held.file(name)?.replace(self.text().as_bytes())?)
    }

    fn text(&self) -> String {
        format!("{PRIVATE}{}\n", hex(self.0.as_bytes()))
    }

    /// Its public key.
    #[must_use]
    pub fn public(&self) -> PublicKey {
        PublicKey(self.0.verifying_key().to_bytes())
    }

    /// What signs.
    #[must_use]
    pub const fn signing(&self) -> &SigningKey {
        &self.0
    }

    /// The key as PKCS #8 (RFC 8410), as TLS wants it.
    #[must_use]
    pub fn pkcs8(&self) -> Vec<u8> {
        // SEQUENCE { 0, SEQUENCE { 1.3.101.112 }, OCTET STRING { OCTET STRING of 32 bytes } }
        let mut der = vec![
            0x30, 0x2e, 0x02, 0x01, 0x00, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x04, 0x22,
            0x04, 0x20,
        ];
        der.extend_from_slice(self.0.as_bytes());
        der
    }
}

/// No word of the private part.
impl fmt::Debug for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Identity").field(&self.public()).finish()
    }
}

/// Reads the public key of the team from `directory`.
///
/// # Errors
/// If it is not there, is not one, or others could have written it.
pub fn load_team(directory: &Path) -> Result<PublicKey, KeyError> {
    let path = directory.join(TEAM);
    let text = match OwnFile::named(&path).and_then(|file| file.read(LONGEST)) {
        Ok(text) => text.ok_or_else(|| KeyError::Missing(path.clone()))?,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(KeyError::Missing(path));
        }
        Err(error) => return Err(error.into()),
    };
    text.trim_end().parse().map_err(|_| KeyError::NotAKey(path))
}

/// As hexadecimal digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    let nibbles = bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]);
    let digits = nibbles.filter_map(|nibble| char::from_digit(nibble.into(), 16));
    digits.collect()
}

/// Exactly `N` bytes of hexadecimal digits.
#[must_use]
pub fn unhex<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digits = text.as_bytes();
    if digits.len() != 2 * N {
        return None;
    }
    let digit = |at: usize| char::from(*digits.get(at)?).to_digit(16);
    let mut bytes = [0; N];
    for (place, byte) in bytes.iter_mut().enumerate() {
        let value = digit(2 * place)? << 4 | digit(2 * place + 1)?;
        *byte = u8::try_from(value).ok()?;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests;
