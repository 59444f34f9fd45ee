//! Where members were found by multicast DNS, if that is wanted. An address is a hint where to call and nothing more: who answers there has to prove
//! the key that the roster has. Nothing here has a socket: what was announced comes in.
use std::collections::BTreeMap;
use std::net::SocketAddr;

use crate::roster::Roster;

/// What links announce.
pub const SERVICE: &str = "_coloc-link._udp.local.";
/// So many addresses of a member are kept, the newest ones.
const KEPT: usize = 4;

/// What somebody announces; whether it is true is found out by calling.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Announced {
    /// The team, by the beginning of its key.
    pub team: u64,
    /// The member's number.
    pub id: u16,
    /// Where it is to be called.
    pub addresses: Vec<SocketAddr>,
}

/// Where members were found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    addresses: BTreeMap<u16, Vec<SocketAddr>>,
    strangers: u64,
}

impl Found {
    /// Takes what was announced, if it is of another member of the team, and counts it else. Whether something new was learned.
    pub fn take(&mut self, announced: &Announced, team: u64, own: u16, roster: &Roster) -> bool {
        let Announced { id, addresses, .. } = announced;
        if announced.team == team && *id == own {
            return false; // The own voice.
        }
        if announced.team != team || roster.member(*id).is_none() {
            self.strangers = self.strangers.saturating_add(1);
            return false;
        }
        let known = self.addresses.entry(*id).or_default();
        let mut is_new = false;
        for address in addresses.iter().take(KEPT).rev() {
            is_new |= !known.contains(address);
            known.retain(|it| it != address);
            known.insert(0, *address);
        }
        known.truncate(KEPT);
        is_new
    }

    /// Where a member was found, the newest address first.
    #[must_use]
    pub fn of(&self, id: u16) -> &[SocketAddr] {
        self.addresses.get(&id).map_or(&[], Vec::as_slice)
    }

    /// Somebody else answers there.
    pub fn forget(&mut self, id: u16, address: SocketAddr) {
        if let Some(known) = self.addresses.get_mut(&id) {
            known.retain(|it| *it != address);
        }
    }

    /// Who is no member any more is not remembered.
    pub fn tidy(&mut self, roster: &Roster) {
        self.addresses.retain(|id, _| roster.member(*id).is_some());
    }

    /// Announcements of others than members.
    #[must_use]
    pub const fn strangers(&self) -> u64 {
        self.strangers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::roster::tests::team;

    const TEAM: u64 = 7;

    fn announced(team: u64, id: u16, ports: std::ops::Range<u16>) -> Announced {
        let address = |port| SocketAddr::from(([10, 0, 0, 2], port));
        Announced {
            team,
            id,
            addresses: ports.map(address).collect(),
        }
    }

    #[test]
    fn a_member_is_called_where_it_was_found_last_and_the_roster_alone_says_who_is_one() {
        let (mut found, roster) = (Found::default(), team());
        let ports = |found: &Found| found.of(2).iter().map(SocketAddr::port).collect::<Vec<_>>();
        assert!(found.take(&announced(TEAM, 2, 1..2), TEAM, 1, &roster));
        assert!(!found.take(&announced(TEAM, 2, 1..2), TEAM, 1, &roster));
        assert!(found.take(&announced(TEAM, 2, 5..7), TEAM, 1, &roster));
        assert_eq!(ports(&found), [5, 6, 1]);
        assert!(!found.take(&announced(TEAM, 1, 9..10), TEAM, 1, &roster));
        assert_eq!((found.of(1), found.strangers()), (&[][..], 0));
        found.forget(2, SocketAddr::from(([10, 0, 0, 2], 6)));
        assert_eq!(ports(&found), [5, 1]);
        let mut without = roster;
        without.member.retain(|member| member.id != 2);
        found.tidy(&without);
        assert_eq!(ports(&found), [0_u16; 0]);
    }

    #[test]
    fn strangers_are_counted_and_whoever_speaks_for_a_member_has_four_addresses_of_it() {
        let (mut found, roster) = (Found::default(), team());
        for id in 0..1000 {
            assert!(!found.take(&announced(TEAM + 1, id, 1..2), TEAM, 1, &roster));
            assert!(!found.take(&announced(TEAM, 1000 + id, 1..2), TEAM, 1, &roster));
        }
        assert_eq!(found.strangers(), 2000);
        assert_eq!(found.addresses.len(), 0);
        found.take(&announced(TEAM, 2, 1..1000), TEAM, 1, &roster);
        assert_eq!(found.of(2).len(), KEPT);
    }
}
