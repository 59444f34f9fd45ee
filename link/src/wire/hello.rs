//! What a link says first on every connection, and again whenever something of it changes.
use coloc_shm_types::Plain;

use super::Versions;

/// Which versions and kinds are understood, and by which rules the robot goes.
///
/// | offset in the body | field | |
/// | --- | --- | --- |
/// | 0 | `oldest` | u8 |
/// | 1 | `newest` | u8 |
/// | 2 | `flags` | u16 |
/// | 4 | `datum` | u64 |
/// | 12 | `periods` | u64 |
/// | 20 | how many kinds follow | u16 |
/// | 22 | `kinds` | u32 each |
/// | after them | `origin` | u64 |
/// | | `program` | \[u8; 16\] |
///
/// The last two may be missing: links of before did not say them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hello {
    /// The oldest version of the format that is understood.
    pub oldest: u8,
    /// The newest.
    pub newest: u8,
    /// [`Self::CLOCK_UNSET`].
    pub flags: u16,
    /// [`fingerprint`](crate::roster::fingerprint) of the frame that its poses are in.
    pub datum: u64,
    /// The same of its periods.
    pub periods: u64,
    /// Numbers of the kinds that it understands.
    pub kinds: Vec<u32>,
    /// [`fingerprint`](crate::roster::fingerprint) of the point of the earth that its frame begins at, where its `[gnss.datum]` says one; else 0.
    pub origin: u64,
    /// The version of its program in ASCII; the rest is zero.
    pub program: [u8; 16],
}

impl Hello {
    /// In `flags`: it knows that its clock is wrong.
    pub const CLOCK_UNSET: u16 = 1;

    /// The body.
    #[must_use]
    pub fn body(&self) -> Vec<u8> {
        let mut body = vec![self.oldest, self.newest];
        body.extend(self.flags.to_le_bytes());
        body.extend(self.datum.to_le_bytes());
        body.extend(self.periods.to_le_bytes());
        let told = u16::try_from(self.kinds.len()).unwrap_or(u16::MAX);
        body.extend(told.to_le_bytes());
        let kinds = self.kinds.iter().take(usize::from(told));
        body.extend(kinds.flat_map(|kind| kind.to_le_bytes()));
        body.extend(self.origin.to_le_bytes());
        body.extend(self.program);
        body
    }

    /// What a body says; what a later version appends is passed over. `None` if it is too short.
    #[must_use]
    pub fn of(body: &[u8]) -> Option<Self> {
        let (oldest, from) = Plain::take(body)?;
        let (newest, from) = Plain::take(from)?;
        let (flags, from) = Plain::take(from)?;
        let (datum, from) = Plain::take(from)?;
        let (periods, from) = Plain::take(from)?;
        let (told, from) = u16::take(from)?;
        let (kinds, from) = from.split_at_checked(usize::from(told) * size_of::<u32>())?;
        let (kinds, _) = kinds.as_chunks();
        let (origin, from) = from.split_first_chunk().unwrap_or((&[0; 8], &[]));
        let program = from.first_chunk().copied().unwrap_or_default();
        Some(Self {
            oldest,
            newest,
            flags,
            datum,
            periods,
            kinds: kinds.iter().map(|it| u32::from_le_bytes(*it)).collect(),
            origin: u64::from_le_bytes(*origin),
            program,
        })
    }

    /// The version of its program, `text` cut to what is told of it.
    #[must_use]
    pub fn program_of(text: &str) -> [u8; 16] {
        let mut program = [0; 16];
        for (place, byte) in program.iter_mut().zip(text.bytes()) {
            *place = byte;
        }
        program
    }

    /// The version of its program, if it said one that can be printed.
    #[must_use]
    pub fn program(&self) -> Option<&str> {
        let length = self.program.iter().position(|byte| *byte == 0);
        let text = self.program.get(..length.unwrap_or(self.program.len()))?;
        let text = str::from_utf8(text).ok()?;
        let is_version = |letter: char| letter.is_ascii_alphanumeric() || "._+-".contains(letter);
        (!text.is_empty() && text.chars().all(is_version)).then_some(text)
    }

    /// The newest version that both understand.
    #[must_use]
    pub fn common_version(&self, own: Versions) -> Option<u8> {
        let best = self.newest.min(own.newest);
        (best >= self.oldest.max(own.oldest)).then_some(best)
    }
}
