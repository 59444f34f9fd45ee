//! Whose clock is wrong.
use super::Offset;

/// Whose clock is wrong, as far as the peers' tell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Whose {
    /// Nobody's, as far as is known.
    Nobodys,
    /// The own: more peers than not agree with one another on another time.
    Mine,
    /// Those of these peers.
    Theirs(Vec<u16>),
}

/// Whose clock is wrong, `peers` being what is known of each peer's. Two that may be the same agree.
#[must_use]
pub fn whose_clock(peers: &[(u16, Offset)]) -> Whose {
    let off: Vec<_> = peers.iter().filter(|(_, offset)| offset.is_off()).collect();
    if off.is_empty() {
        return Whose::Nobodys;
    }
    let agreeing = |with: &Offset| {
        let same = off.iter().filter(|(_, other)| may_be_equal(with, other));
        same.count()
    };
    let most = off.iter().map(|(_, offset)| agreeing(offset)).max();
    // With the own clock among them: of two robots neither knows.
    let majority = most.is_some_and(|most| 2 * most > peers.len() + 1);
    if majority {
        return Whose::Mine;
    }
    Whose::Theirs(off.iter().map(|(peer, _)| *peer).collect())
}

fn may_be_equal(one: &Offset, other: &Offset) -> bool {
    (one.offset_s - other.offset_s).abs() <= one.within_s + other.within_s
}
