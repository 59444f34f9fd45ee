//! The bytes between two links; [`docs/link-wire.md`](https://github.com/coloc/coloc/blob/main/docs/link-wire.md) is the same for people.
//!
//! A message is an [`Envelope`], a body and a signature. Everything is written field by field and little-endian, by the same rule as
//! payloads ([`coloc_shm_types::Plain`]): nothing is a dump of memory, and nothing is read that was not checked to be there.
//!
//! * [`seal`] writes and signs a message; [`Parsed::of`] takes it apart, and believes nothing of it.
//! * Kinds below 256 are the link's own words: [`Hello`], [`ClockWord`], a roster's text. All others are payloads.
//! * A body may be longer than what this version knows of it: later versions append.

mod clock_word;
mod envelope;
mod hello;

pub use clock_word::ClockWord;
pub use envelope::{Envelope, Parsed, Unreadable, seal};
pub use hello::Hello;

/// The newest version of the format that is spoken here.
pub const NEWEST: u8 = 1;
/// The oldest that is understood.
pub const OLDEST: u8 = 1;

/// Which versions of the format a link speaks.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Versions {
    /// The oldest that it understands.
    pub oldest: u8,
    /// The newest.
    pub newest: u8,
}

impl Versions {
    /// Those of this program.
    pub const OWN: Self = Self {
        oldest: OLDEST,
        newest: NEWEST,
    };

    /// Whether that one is among them.
    #[must_use]
    pub const fn has(self, version: u8) -> bool {
        self.oldest <= version && version <= self.newest
    }
}

/// `receiver` of what is for everybody.
pub const EVERYBODY: u16 = u16::MAX;

/// The largest message that is sent as one datagram, envelope and signature included (bytes); a larger one is a stream of its own.
/// QUIC promises 1200 bytes a packet; its own header, frame and seal take less than 60.
pub const LARGEST_DATAGRAM: usize = 1140;

/// The largest message at all (bytes).
pub const LARGEST: usize = 64 * 1024;

/// The kinds of the link's own words.
pub mod word {
    /// [`Hello`](super::Hello).
    pub const HELLO: u32 = 1;
    /// [`ClockWord`](super::ClockWord).
    pub const CLOCK: u32 = 2;
    /// The text of a roster, UTF-8.
    pub const ROSTER: u32 = 3;
}

#[cfg(test)]
mod tests;
