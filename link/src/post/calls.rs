//! Calling members that are not connected.
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::Duration;

use tokio::task::spawn_local;

use super::company::Kept;
use super::lines;
use super::office::{Office, now};
use crate::engine::{Closing, Engine};
use crate::roster::{Member, Roster};

/// From one look at who is missing to the next.
const LOOK: Duration = Duration::from_millis(100);
/// From one call of a member to the next (looks), which does not wait for the first to fail: of calls into a radio that loses every second
/// packet one gets through soon. Who has just been lost, or was never there, is called the sooner.
const AGAIN: [u32; 3] = [2, 4, 8];
/// And so on, until it is there.
const THEN_AGAIN: u32 = 10;
/// Calls of one member at once: as many as are made before the first is given up, so that there is never a pause in them.
const AT_ONCE: usize = 8;

/// Who has started calls everybody for so long (ns): others may still believe that they are connected to the link that was there before.
const STARTED_NS: i64 = 3_000_000_000;

/// Who is being called.
#[derive(Debug, Default)]
struct Calls {
    open: BTreeMap<u16, usize>,
    missing: BTreeMap<u16, Missing>,
}

/// A member that is missing.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
struct Missing {
    /// Calls since it was lost.
    made: usize,
    /// Looks until the next one.
    pause: u32,
}

impl Missing {
    /// One look more; which call is due, if one is, where a member may be called at that moment or not.
    fn look(&mut self, may_call: bool) -> Option<usize> {
        self.pause = self.pause.saturating_sub(1);
        if self.pause > 0 || !may_call {
            return None;
        }
        let call = self.made;
        self.pause = AGAIN.get(call).copied().unwrap_or(THEN_AGAIN);
        self.made = call.wrapping_add(1);
        Some(call)
    }
}

/// Calls whoever is missing, until the end.
pub(super) async fn call_all(office: Rc<RefCell<Office>>, engine: Engine) {
    let calls = Rc::new(RefCell::new(Calls::default()));
    loop {
        let due = due(&office.borrow(), &mut calls.borrow_mut());
        for (id, address) in due {
            let (office, engine, calls) = (Rc::clone(&office), engine.clone(), Rc::clone(&calls));
            spawn_local(async move {
                call(office, engine, id, &address).await;
                if let Some(open) = calls.borrow_mut().open.get_mut(&id) {
                    *open = open.saturating_sub(1);
                }
            });
        }
        tokio::time::sleep(LOOK).await;
    }
}

fn due(office: &Office, calls: &mut Calls) -> Vec<(u16, String)> {
    let (roster, now_ns) = (office.roster(), now().boot_ns);
    let kept = Kept::of(&roster, office.own);
    let has_just_started = now_ns.saturating_sub(office.started_ns) < STARTED_NS;
    let missing = roster.member.iter().filter(|member| {
        if office.members.contains_key(&member.id) || !can_be_called(office, member) {
            return false;
        }
        let is_ours = is_called(&roster, office.own, member) || has_just_started;
        if kept.has(member.id) {
            return is_ours;
        }
        office.wanted.is_due(member.id, !is_ours, now_ns)
    });
    // Who is lost is called at once.
    calls
        .missing
        .retain(|id, _| !office.members.contains_key(id));
    let mut due = Vec::new();
    for member in missing {
        let open = calls.open.entry(member.id).or_default();
        let it = calls.missing.entry(member.id).or_default();
        let Some(call) = it.look(*open < AT_ONCE) else {
            continue;
        };
        // Where it was found and its addresses, in turn.
        let found = office.found.of(member.id).iter().map(SocketAddr::to_string);
        let mut places = found.chain(member.addresses.iter().cloned());
        let count = office.found.of(member.id).len() + member.addresses.len();
        let place = call.checked_rem(count);
        if let Some(address) = place.and_then(|place| places.nth(place)) {
            *open += 1;
            due.push((member.id, address));
        }
    }
    due
}

/// Of two that can be called the one with the lower number calls, so that they do not always call one another at once.
fn is_called(roster: &Roster, own: u16, member: &Member) -> bool {
    let can_be_called = roster
        .member(own)
        .is_some_and(|own| !own.addresses.is_empty());
    own < member.id || !can_be_called
}

fn can_be_called(office: &Office, member: &Member) -> bool {
    let is_placed = !member.addresses.is_empty() || !office.found.of(member.id).is_empty();
    member.id != office.own && is_placed
}

async fn call(office: Rc<RefCell<Office>>, engine: Engine, id: u16, address: &str) {
    let Some(to) = resolved(address).await else {
        let text = format!("{address} is no address that is known");
        office.borrow_mut().teller.remark(text);
        return;
    };
    // Who does not answer is told of once, when it was lost.
    let Ok(line) = engine.call(to).await else {
        return;
    };
    let (own, is_it, is_missing) = {
        let office = office.borrow();
        let roster = office.roster();
        let is_it = roster.owner(line.key()).is_some_and(|owner| owner.id == id);
        (office.own, is_it, !office.members.contains_key(&id))
    };
    match (is_it, is_missing) {
        (true, true) => {
            spawn_local(lines::keep(office, line));
        }
        // They have called one another: both stay with the one that the lower number made.
        (true, false) if own < id => {
            spawn_local(lines::keep(office, line));
        }
        // An earlier call has got through meanwhile.
        (true, false) => line.close(Closing::Replaced),
        (false, _) => {
            let text = format!("somebody else than was called answers at {address}");
            let mut office = office.borrow_mut();
            office.teller.remark(text);
            office.found.forget(id, to);
            line.close(Closing::Mistaken);
        }
    }
}

/// Names may take a while.
async fn resolved(address: &str) -> Option<SocketAddr> {
    tokio::net::lookup_host(address).await.ok()?.next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_missing_is_called_at_once_soon_and_then_every_second() {
        let mut missing = Missing::default();
        let called: Vec<_> = (0..45).filter(|_| missing.look(true).is_some()).collect();
        assert_eq!(called, [0, 2, 6, 14, 24, 34, 44]);
        assert_eq!(missing.made, called.len());
    }

    #[test]
    fn a_call_that_cannot_be_made_is_made_as_soon_as_it_can() {
        let mut missing = Missing::default();
        assert_eq!([missing.look(false), missing.look(true)], [None, Some(0)]);
        assert_eq!(missing.look(false), None);
        assert_eq!([missing.look(false), missing.look(true)], [None, Some(1)]);
    }
}
