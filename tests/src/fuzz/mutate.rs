//! Bytes that are nearly good.

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// The longest that is made (bytes).
const LONGEST: usize = 4096;

/// What programs stumble over.
const WORDS: [&[u8]; 24] = [
    b"nan",
    b"-nan",
    b"inf",
    b"-inf",
    b"1e308",
    b"-1e-308",
    b"0",
    b"-1",
    b"65535",
    b"65536",
    b"4294967295",
    b"18446744073709551615",
    b"-9223372036854775808",
    b"9223372036854775807",
    b"\n",
    b"\r\n",
    b"\0",
    b"\"",
    b"=",
    b"[",
    b"]",
    b"#",
    b" ",
    b"\xEF\xBB\xBF",
];

/// One of `seeds`, changed in a few places.
pub(super) fn mutate(seeds: &[Vec<u8>], chance: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = seeds.choose(chance).cloned().unwrap_or_default();
    for _ in 0..1 << chance.random_range(0..6) {
        change(&mut bytes, seeds, chance);
    }
    bytes.truncate(LONGEST);
    bytes
}

fn change(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], chance: &mut ChaCha8Rng) {
    let at = chance.random_range(0..=bytes.len());
    let length = chance.random_range(0..=16.min(bytes.len() - at));
    let place = at..at + length;
    let (place, with) = match chance.random_range(0..8) {
        0 => (place, vec![]),
        1 => (at..at, vec![chance.random()]),
        2 => (place, WORDS.choose(chance).unwrap().to_vec()),
        3 => (place, part(seeds.choose(chance).unwrap(), chance)),
        4 => (at..at, bytes[place].to_vec()),
        5 => (at.max(1).min(bytes.len())..bytes.len(), vec![]),
        _ => {
            let flipped = bytes
                .get(at)
                .map(|byte| byte ^ 1 << chance.random_range(0..8));
            (at..at + flipped.iter().len(), flipped.into_iter().collect())
        }
    };
    bytes.splice(place, with);
}

fn part(of: &[u8], chance: &mut ChaCha8Rng) -> Vec<u8> {
    let from = chance.random_range(0..=of.len());
    let to = chance.random_range(from..=of.len().min(from + 64));
    of[from..to].to_vec()
}
