//! With whom a link keeps up: with everybody in a small team, in a large one with neighbours and a few more.
//!
//! A connection costs packets also when nothing is said. Of a large team a robot meets few at a time: so it is connected to those with whom
//! something is exchanged, to stations, and to the [`RING`] before and the [`RING`] after it in the order of their numbers, so that a newer roster
//! reaches everybody. What a robot spends does not grow with its team then.
use std::collections::BTreeMap;

use crate::roster::{Role, Roster};

/// A team of so many is small.
const SMALL: usize = 16;
/// So many on either side are kept up with in a large team.
const RING: usize = 2;
/// After so long without a word, a connection that is not kept is given up (ns).
pub(super) const IDLE_NS: i64 = 60_000_000_000;
/// Who would be called by the other side calls after so long itself, since the other side may have nothing to say (ns).
const OWN_CALL_NS: i64 = 1_000_000_000;

/// Whom a member keeps up with whether or not something is said.
#[derive(Debug)]
pub(super) enum Kept {
    Everybody,
    These(Vec<u16>),
}

impl Kept {
    pub(super) fn of(roster: &Roster, own: u16) -> Self {
        let stations = || roster.member.iter().filter(|it| it.role == Role::Station);
        if roster.member.len() <= SMALL || stations().any(|it| it.id == own) {
            return Self::Everybody;
        }
        let mut ids: Vec<u16> = roster.member.iter().map(|it| it.id).collect();
        ids.sort_unstable();
        let place = ids.partition_point(|id| *id < own);
        let count = ids.len();
        let ring = (1..=RING).flat_map(|step| [place + step, place + count - step]);
        let mut kept: Vec<u16> = ring.map(|place| ids[place % count]).collect();
        kept.extend(stations().map(|it| it.id));
        Self::These(kept)
    }

    pub(super) fn has(&self, id: u16) -> bool {
        match self {
            Self::Everybody => true,
            Self::These(these) => these.contains(&id),
        }
    }
}

/// Members that are not connected and for whom there is something.
#[derive(Debug, Default)]
pub(super) struct Wanted(BTreeMap<u16, Want>);

#[derive(Copy, Clone, Debug)]
struct Want {
    since_ns: i64,
    until_ns: i64,
}

impl Wanted {
    /// Something was to be said to that member.
    pub(super) fn want(&mut self, id: u16, now_ns: i64) {
        let until_ns = now_ns.saturating_add(IDLE_NS);
        let new = Want {
            since_ns: now_ns,
            until_ns,
        };
        self.0.entry(id).or_insert(new).until_ns = until_ns;
    }

    /// Whether that member is to be called, which would call us if it had something to say where `calls_us`.
    pub(super) fn is_due(&self, id: u16, calls_us: bool, now_ns: i64) -> bool {
        let own_call_ns = if calls_us { OWN_CALL_NS } else { 0 };
        self.0.get(&id).is_some_and(|want| {
            now_ns <= want.until_ns && now_ns.saturating_sub(want.since_ns) >= own_call_ns
        })
    }

    /// Forgets those of `now_ns` who are not wanted any more, and who `is_there`.
    pub(super) fn tidy(&mut self, now_ns: i64, is_there: impl Fn(u16) -> bool) {
        self.0
            .retain(|id, want| now_ns <= want.until_ns && !is_there(*id));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::roster::tests::team;

    fn large(members: u16) -> Roster {
        let mut roster = team();
        let model = roster.member[0].clone();
        roster.member = (1..=members)
            .map(|id| crate::roster::Member {
                id,
                role: Role::Robot,
                ..model.clone()
            })
            .collect();
        roster
    }

    #[test]
    fn a_large_team_is_one_piece_and_nobody_keeps_more_than_four() {
        for members in [17, 100, 1000] {
            let roster = large(members);
            let mut reached = BTreeSet::from([1]);
            let mut next = vec![1];
            while let Some(id) = next.pop() {
                let Kept::These(these) = Kept::of(&roster, id) else {
                    panic!("{members} are many");
                };
                assert_eq!(these.len(), 2 * RING);
                for other in these {
                    assert!(Kept::of(&roster, other).has(id), "{id} and {other}");
                    if reached.insert(other) {
                        next.push(other);
                    }
                }
            }
            assert_eq!(reached.len(), usize::from(members));
        }
        assert!(Kept::of(&large(16), 3).has(12));
    }

    #[test]
    fn stations_are_kept_by_all_and_keep_all() {
        let mut roster = large(40);
        roster.member[29].role = Role::Station;
        assert!(Kept::of(&roster, 5).has(30) && Kept::of(&roster, 30).has(5));
        assert!(!Kept::of(&roster, 5).has(20));
    }

    #[test]
    fn who_is_wanted_is_called_until_nothing_was_said_for_a_while() {
        let mut wanted = Wanted::default();
        assert!(!wanted.is_due(4, false, 0));
        wanted.want(4, 0);
        assert!(wanted.is_due(4, false, 0) && !wanted.is_due(4, true, OWN_CALL_NS - 1));
        assert!(wanted.is_due(4, true, OWN_CALL_NS) && !wanted.is_due(4, true, IDLE_NS + 1));
        wanted.want(4, IDLE_NS);
        assert!(wanted.is_due(4, true, IDLE_NS + 1));
        wanted.tidy(IDLE_NS, |id| id == 4);
        assert!(!wanted.is_due(4, true, IDLE_NS + 1));
    }
}
