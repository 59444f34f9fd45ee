//! Every message that is written is read again, and nothing else is read as one.
use coloc_shm_types::{Channel, Message, Neighbour, OnPayload, Plain};
use proptest::prelude::*;

use super::*;
use crate::keys::Identity;
use crate::kinds::Kind;

fn key() -> Identity {
    Identity::of_seed(&[5; 32])
}

fn any_envelope() -> impl Strategy<Value = Envelope> {
    let numbers = (any::<u64>(), any::<u64>(), any::<u64>(), any::<i64>());
    let rest = (any::<u32>(), any::<u32>(), any::<u16>(), any::<u16>());
    (OLDEST..=NEWEST, numbers, rest).prop_map(|(version, numbers, rest)| Envelope {
        version,
        team: numbers.0,
        session: numbers.1,
        sequence: numbers.2,
        stamp_ns: numbers.3,
        kind: rest.0,
        roster: rest.1,
        speaker: rest.2,
        receiver: rest.3,
    })
}

fn any_hello() -> impl Strategy<Value = Hello> {
    let numbers = (
        any::<u8>(),
        any::<u8>(),
        any::<u16>(),
        any::<u64>(),
        any::<u64>(),
    );
    let appended = (any::<u64>(), any::<[u8; 16]>());
    let kinds = prop::collection::vec(any::<u32>(), 0..64);
    (numbers, kinds, appended).prop_map(|(numbers, kinds, appended)| Hello {
        oldest: numbers.0,
        newest: numbers.1,
        flags: numbers.2,
        datum: numbers.3,
        periods: numbers.4,
        kinds,
        origin: appended.0,
        program: appended.1,
    })
}

fn sealed(envelope: &Envelope, body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    assert!(seal(envelope, body, key().signing(), &mut bytes));
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_is_sealed_is_read_again(envelope in any_envelope(), body in prop::collection::vec(any::<u8>(), 0..2000)) {
        let bytes = sealed(&envelope, &body);
        prop_assert_eq!(bytes.len(), body.len() + Envelope::AROUND);
        let parsed = Parsed::of(&bytes).unwrap();
        prop_assert_eq!(parsed.envelope, envelope);
        prop_assert_eq!(parsed.body, &body[..]);
        prop_assert!(parsed.is_signed_by(&key().public().verifier().unwrap()));
        let other = Identity::of_seed(&[6; 32]).public();
        prop_assert!(!parsed.is_signed_by(&other.verifier().unwrap()));
    }

    #[test]
    fn no_bit_can_be_turned(envelope in any_envelope(), body in prop::collection::vec(any::<u8>(), 0..300), at in any::<prop::sample::Index>(), bit in 0..8) {
        let mut bytes = sealed(&envelope, &body);
        let at = at.index(bytes.len());
        bytes[at] ^= 1_u8 << bit;
        let verifier = key().public().verifier().unwrap();
        let believed = Parsed::of(&bytes).is_ok_and(|parsed| parsed.is_signed_by(&verifier));
        prop_assert!(!believed);
    }

    #[test]
    fn a_message_that_was_cut_or_lengthened_is_none(envelope in any_envelope(), body in prop::collection::vec(any::<u8>(), 0..300), more in 1..9_usize, kept in any::<prop::sample::Index>()) {
        let bytes = sealed(&envelope, &body);
        let cut = &bytes[..kept.index(bytes.len())];
        prop_assert_eq!(Parsed::of(cut).err(), Some(Unreadable::Length));
        let longer = [&bytes[..], &[0; 8][..more.min(8)]].concat();
        prop_assert_eq!(Parsed::of(&longer).err(), Some(Unreadable::Length));
    }

    #[test]
    fn a_hello_is_read_again_also_when_a_later_version_says_more(hello in any_hello(), more in prop::collection::vec(any::<u8>(), 0..9)) {
        let body = [hello.body(), more].concat();
        prop_assert_eq!(Hello::of(&body), Some(hello));
    }

    #[test]
    fn a_clock_word_is_read_again(echo_ns in any::<i64>(), heard_ns in any::<i64>()) {
        let word = ClockWord { echo_ns, heard_ns };
        prop_assert_eq!(ClockWord::of(&word.body()), Some(word));
        prop_assert_eq!(ClockWord::of(&word.body()[..15]), None);
    }

    #[test]
    fn any_bytes_are_harmless(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        read_all(&bytes);
        let head = sealed(&ENVELOPE, &[]);
        read_all(&[&head[..head.len().min(bytes.len())], &bytes].concat());
    }

    #[test]
    fn payloads_of_any_bytes_are_read_and_written_again(bytes in prop::collection::vec(any::<u8>(), 16456)) {
        for kind in Kind::all() {
            let own = &bytes[..kind.told.size];
            prop_assert_eq!(&kind.told.channel.with_payload(Again(own)), own);
            prop_assert!(kind.header(own).is_some());
            prop_assert!(kind.header(&own[1..]).is_none());
            prop_assert!(kind.header(&[own, &[0]].concat()).is_none());
        }
    }
}

const ENVELOPE: Envelope = Envelope {
    version: NEWEST,
    team: 1,
    session: 2,
    sequence: 3,
    stamp_ns: 4,
    kind: 5,
    roster: 6,
    speaker: 7,
    receiver: 8,
};

/// Reads bytes as everything that comes from a network.
fn read_all(bytes: &[u8]) {
    if let Ok(parsed) = Parsed::of(bytes) {
        let _ = parsed.is_signed_by(&key().public().verifier().unwrap());
    }
    let _ = Hello::of(bytes);
    let _ = ClockWord::of(bytes);
    if let Ok(text) = str::from_utf8(bytes) {
        assert!(crate::roster::Roster::verify(text, &key().public()).is_err());
    }
}

/// Reads a payload and writes it again.
struct Again<'a>(&'a [u8]);

impl OnPayload for Again<'_> {
    type Out = Vec<u8>;

    fn on<M: Message>(self) -> Vec<u8> {
        let mut bytes = vec![0; M::BYTES];
        let message = M::from_plain(self.0).unwrap();
        assert!(message.put(&mut bytes).is_some());
        bytes
    }
}

#[test]
fn a_field_lies_where_the_page_says() {
    let bytes = sealed(&ENVELOPE, b"body");
    assert_eq!(bytes[..8], *b"CL\x01\0\x78\0\0\0");
    let at = |place: usize| bytes[place];
    assert_eq!(
        [8, 16, 24, 32, 40, 44, 48, 50].map(at),
        [1, 2, 3, 4, 5, 6, 7, 8]
    );
    assert_eq!(&bytes[52..56], b"body");
    assert_eq!(bytes.len(), 56 + 64);
}

#[test]
fn a_payload_lies_as_its_layout_says() {
    let mut told = Neighbour::default();
    told.header.stamp_ns = 0x0102;
    told.pose = [1.0, -2.0, 0.5];
    let mut bytes = [0; Neighbour::BYTES];
    assert!(told.put(&mut bytes).unwrap().is_empty());
    assert_eq!(bytes[..8], [2, 1, 0, 0, 0, 0, 0, 0]);
    assert_eq!(bytes[40..48], 1.0_f64.to_le_bytes());
    assert_eq!(bytes[48..56], (-2.0_f64).to_le_bytes());
    assert_eq!(Kind::of(Channel::Neighbour).told.size, Neighbour::BYTES);
}

#[test]
fn what_is_too_large_is_not_sealed() {
    let mut bytes = Vec::new();
    let largest = vec![0; LARGEST - Envelope::AROUND];
    assert!(seal(&ENVELOPE, &largest, key().signing(), &mut bytes));
    assert!(Parsed::of(&bytes).is_ok());
    let larger = vec![0; largest.len() + 1];
    assert!(!seal(&ENVELOPE, &larger, key().signing(), &mut bytes));
}

#[test]
fn another_version_is_named_whatever_follows() {
    let mut bytes = sealed(&ENVELOPE, b"body");
    bytes[2] = NEWEST + 1;
    assert_eq!(
        Parsed::of(&bytes).err(),
        Some(Unreadable::Version(NEWEST + 1))
    );
    bytes[0] = b'X';
    assert_eq!(Parsed::of(&bytes).err(), Some(Unreadable::Magic));
}

#[test]
fn two_versions_speak_the_newest_that_both_know() {
    let hello = |oldest, newest| Hello {
        oldest,
        newest,
        ..Hello::default()
    };
    let own = |oldest, newest| Versions { oldest, newest };
    assert_eq!(hello(1, 2).common_version(own(1, 1)), Some(1));
    assert_eq!(hello(1, 2).common_version(own(2, 3)), Some(2));
    assert_eq!(hello(2, 3).common_version(own(1, 1)), None);
    assert_eq!(hello(1, 1).common_version(own(2, 3)), None);
}

#[test]
fn a_hello_of_a_link_of_before_is_read() {
    let hello = Hello {
        kinds: vec![7, 8],
        origin: 9,
        program: Hello::program_of("0.1.0"),
        ..Hello::default()
    };
    assert_eq!(hello.program(), Some("0.1.0"));
    let body = hello.body();
    let before = Hello::of(&body[..body.len() - 24]).unwrap();
    assert_eq!((before.kinds.len(), before.origin), (2, 0));
    assert_eq!(before.program(), None);
}
