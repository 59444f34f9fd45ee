//! What every message begins and ends with.
use coloc_shm_types::Plain;
use ed25519_dalek::{Signature, Signer, SigningKey, Verifier, VerifyingKey};

use super::{LARGEST, Versions};

const MAGIC: [u8; 2] = *b"CL";
const SIGNATURE: usize = 64;

/// Who says what to whom, and when.
///
/// | offset | field | |
/// | --- | --- | --- |
/// | 0 | magic | "CL" |
/// | 2 | `version` | u8 |
/// | 3 | flags, zero | u8 |
/// | 4 | length of the whole message | u32 |
/// | 8 | `team` | u64 |
/// | 16 | `session` | u64 |
/// | 24 | `sequence` | u64 |
/// | 32 | `stamp_ns` | i64 |
/// | 40 | `kind` | u32 |
/// | 44 | `roster` | u32 |
/// | 48 | `speaker` | u16 |
/// | 50 | `receiver` | u16 |
/// | 52 | body | |
/// | length − 64 | Ed25519 over all before it | \[u8; 64\] |
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Envelope {
    /// The version of the format.
    pub version: u8,
    /// The first eight bytes of the team's public key.
    pub team: u64,
    /// Random, drawn when the speaker's link starts.
    pub session: u64,
    /// Counts the speaker's messages of this kind in this session, whomever they are for.
    pub sequence: u64,
    /// When it was sent, by the speaker's `CLOCK_REALTIME` (ns).
    pub stamp_ns: i64,
    /// The kind: a word of the link, or [`Kind::code`](crate::kinds::Kind).
    pub kind: u32,
    /// The version of the roster that the speaker has.
    pub roster: u32,
    /// The speaker's number in the team.
    pub speaker: u16,
    /// The receiver's, or [`EVERYBODY`](super::EVERYBODY).
    pub receiver: u16,
}

/// What is no message.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unreadable {
    /// Too short, too long, or not as long as it says.
    #[error("it is not as long as a message must be")]
    Length,
    /// It begins otherwise, or a field that must be zero is not.
    #[error("it does not begin as a message does")]
    Magic,
    /// A version that is not spoken here.
    #[error("it is of version {0} of the format, which is not understood")]
    Version(u8),
}

/// A message taken apart: nothing of it is believed.
#[derive(Copy, Clone, Debug)]
pub struct Parsed<'a> {
    /// What it says of itself.
    pub envelope: Envelope,
    /// What is in it.
    pub body: &'a [u8],
    signed: &'a [u8],
    signature: &'a [u8; SIGNATURE],
}

impl Envelope {
    /// Bytes before the body.
    pub const BYTES: usize = 52;
    /// Bytes around the body.
    pub const AROUND: usize = Self::BYTES + SIGNATURE;

    fn put(&self, length: u32, to: &mut [u8]) -> Option<()> {
        let to = MAGIC.put(to)?;
        let to = self.version.put(to)?;
        let to = 0_u8.put(to)?;
        let to = length.put(to)?;
        let to = self.team.put(to)?;
        let to = self.session.put(to)?;
        let to = self.sequence.put(to)?;
        let to = self.stamp_ns.put(to)?;
        let to = self.kind.put(to)?;
        let to = self.roster.put(to)?;
        let to = self.speaker.put(to)?;
        self.receiver.put(to).map(drop)
    }

    fn take(from: &[u8]) -> Option<([u8; 2], u8, u32, Self)> {
        let (magic, from) = Plain::take(from)?;
        let (version, from) = Plain::take(from)?;
        let (flags, from) = Plain::take(from)?;
        let (length, from) = Plain::take(from)?;
        let (team, from) = Plain::take(from)?;
        let (session, from) = Plain::take(from)?;
        let (sequence, from) = Plain::take(from)?;
        let (stamp_ns, from) = Plain::take(from)?;
        let (kind, from) = Plain::take(from)?;
        let (roster, from) = Plain::take(from)?;
        let (speaker, from) = Plain::take(from)?;
        let (receiver, _) = Plain::take(from)?;
        let envelope = Self {
            version,
            team,
            session,
            sequence,
            stamp_ns,
            kind,
            roster,
            speaker,
            receiver,
        };
        Some((magic, flags, length, envelope))
    }
}

/// Writes a message into `out`, which is emptied first, and signs it. `false` if the body is too large to be one.
pub fn seal(envelope: &Envelope, body: &[u8], key: &SigningKey, out: &mut Vec<u8>) -> bool {
    out.clear();
    let length = body.len().saturating_add(Envelope::AROUND);
    let Some(told) = u32::try_from(length).ok().filter(|_| length <= LARGEST) else {
        return false;
    };
    out.resize(Envelope::BYTES, 0);
    if envelope.put(told, out).is_none() {
        return false;
    }
    out.extend_from_slice(body);
    let signature = key.sign(out);
    out.extend_from_slice(&signature.to_bytes());
    true
}

impl<'a> Parsed<'a> {
    /// Takes a message of a version of this program's apart.
    ///
    /// # Errors
    /// As [`Self::among`].
    pub fn of(bytes: &'a [u8]) -> Result<Self, Unreadable> {
        Self::among(bytes, Versions::OWN)
    }

    /// Takes a message of one of these versions apart.
    ///
    /// # Errors
    /// If it is none, or of a version that is not understood.
    pub fn among(bytes: &'a [u8], versions: Versions) -> Result<Self, Unreadable> {
        if bytes.len() > LARGEST {
            return Err(Unreadable::Length);
        }
        let (signed, signature) = bytes
            .split_last_chunk::<SIGNATURE>()
            .ok_or(Unreadable::Length)?;
        let body = signed.get(Envelope::BYTES..).ok_or(Unreadable::Length)?;
        let (magic, flags, length, envelope) = Envelope::take(signed).ok_or(Unreadable::Length)?;
        if magic != MAGIC {
            return Err(Unreadable::Magic);
        }
        if !versions.has(envelope.version) {
            return Err(Unreadable::Version(envelope.version));
        }
        if flags != 0 {
            return Err(Unreadable::Magic);
        }
        if usize::try_from(length) != Ok(bytes.len()) {
            return Err(Unreadable::Length);
        }
        Ok(Self {
            envelope,
            body,
            signed,
            signature,
        })
    }

    /// Whether the key's owner has said exactly this. The key is none of small order ([`PublicKey`](crate::keys::PublicKey)), so what
    /// `verify_strict` looks at besides proves nothing more, and costs a sixth.
    #[must_use]
    pub fn is_signed_by(&self, key: &VerifyingKey) -> bool {
        let signature = Signature::from_bytes(self.signature);
        key.verify(self.signed, &signature).is_ok()
    }
}
