//! The kinds of messages on the wire: the rows of the table of channels, each with a number.
use std::sync::LazyLock;

use coloc_shm_types::{Channel, Header, Message, OnPayload, Speaker, Told};

/// A kind of message.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Its number: the FNV-1a hash of the payload's name and version, so that another layout is another kind.
    pub code: u32,
    /// Name and version of the payload.
    pub type_name: &'static str,
    /// Its row in the table of channels.
    pub told: Told,
    /// Whether its stamp is that of what it answers, by the clock of the robot that it is for.
    pub echoes: bool,
}

/// The number of the link's own words, below all of them.
pub const OWN_WORDS: u32 = 256;

static ALL: LazyLock<Vec<Kind>> = LazyLock::new(|| {
    let all = Channel::ALL.into_iter();
    all.map(|channel| channel.with_payload(Describe)).collect()
});

impl Kind {
    /// All of them, in the order of the channels.
    #[must_use]
    pub fn all() -> &'static [Self] {
        &ALL
    }

    /// The one of a channel.
    #[must_use]
    pub fn of(channel: Channel) -> Self {
        channel.with_payload(Describe)
    }

    /// The one with that number, if it is known here.
    #[must_use]
    pub fn of_code(code: u32) -> Option<Self> {
        Self::all().iter().find(|kind| kind.code == code).copied()
    }

    /// The one of the channel with that name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::all()
            .iter()
            .find(|kind| kind.told.name == name)
            .copied()
    }

    /// Whether another robot says it on the channel of the robot that it is for; else a robot says it on its own, for all.
    #[must_use]
    pub const fn is_for_one(&self) -> bool {
        matches!(self.told.by, Speaker::Neighbours | Speaker::Trackers)
    }

    /// Whether drivers of the robot's own sensors say it: that stays on the robot.
    #[must_use]
    pub const fn is_a_drivers(&self) -> bool {
        matches!(self.told.by, Speaker::Drivers)
    }

    /// What the payload in these bytes begins with; `None` if they are not as many as the kind has.
    #[must_use]
    pub fn header(&self, payload: &[u8]) -> Option<Header> {
        self.told.channel.with_payload(ReadHeader { payload })
    }

    /// Rewrites the payload in these bytes by a correction of its stamps: they are moved by `by_ns`, and `added` is what the doubt
    /// that is left adds to the dependent part of a place ([`blur`](crate::clock_offset::blur)). `None` if they are not as many as the
    /// kind has.
    #[must_use]
    pub fn correct(&self, payload: &mut [u8], by_ns: i64, added: &[f64; 9]) -> Option<()> {
        self.told.channel.with_payload(Correct {
            payload,
            by_ns,
            added,
        })
    }
}

struct Describe;

impl OnPayload for Describe {
    type Out = Kind;

    fn on<M: Message>(self) -> Kind {
        Kind {
            code: code(M::TYPE_NAME),
            type_name: M::TYPE_NAME,
            told: M::CHANNEL.told(),
            echoes: M::ECHOES,
        }
    }
}

struct ReadHeader<'a> {
    payload: &'a [u8],
}

impl OnPayload for ReadHeader<'_> {
    type Out = Option<Header>;

    fn on<M: Message>(self) -> Option<Header> {
        M::from_plain(self.payload).map(|message| *message.header())
    }
}

struct Correct<'a> {
    payload: &'a mut [u8],
    by_ns: i64,
    added: &'a [f64; 9],
}

impl OnPayload for Correct<'_> {
    type Out = Option<()>;

    fn on<M: Message>(self) -> Option<()> {
        let mut message = M::from_plain(self.payload)?;
        let header = message.header_mut();
        header.stamp_ns = header.stamp_ns.saturating_add(self.by_ns);
        message.move_stamps(self.by_ns);
        message.widen(self.added);
        message.put(self.payload).map(drop)
    }
}

/// FNV-1a, 32 bits (Fowler, Noll, Vo): no two payloads share one, which a test holds; nobody gains by making two.
fn code(name: &str) -> u32 {
    name.bytes().fold(0x811c_9dc5, |hash, byte| {
        (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
    })
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::{Neighbour, Plain};

    use super::*;

    #[test]
    fn every_kind_has_a_number_of_its_own_above_the_links_own_words() {
        for kind in Kind::all() {
            assert!(kind.code >= OWN_WORDS);
            assert_eq!(Kind::of_code(kind.code), Some(*kind));
            assert_eq!(Kind::of_name(kind.told.name), Some(*kind));
            assert_eq!(Kind::of(kind.told.channel), *kind);
        }
    }

    #[test]
    fn a_correction_moves_stamps_and_widens_the_dependent_part() {
        let kind = Kind::of(Channel::Neighbour);
        let mut told = Neighbour::default();
        told.header.stamp_ns = 50;
        let mut bytes = [0; Neighbour::BYTES];
        assert!(told.put(&mut bytes).is_some());
        let added = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        assert_eq!(kind.correct(&mut bytes, -8, &added), Some(()));
        told.header.stamp_ns = 42;
        told.dependent = added;
        assert_eq!(Neighbour::from_plain(&bytes), Some(told));
        assert_eq!(kind.correct(&mut bytes[1..], -8, &added), None);
    }

    #[test]
    fn the_number_is_that_of_fnv() {
        assert_eq!(code(""), 0x811c_9dc5);
        assert_eq!(code("foobar"), 0xbf9c_f968);
    }
}
