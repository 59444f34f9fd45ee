//! From the queues to the network.
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use coloc_shm_types::Matters;
use tokio::task::spawn_local;

use super::office::{Office, now};
use crate::budget::Budget;
use crate::engine::Line;
use crate::queue::Waiting;
use crate::wire::{LARGEST_DATAGRAM, word};

/// So long is a word of the link itself tried on one stream.
const PATIENCE: Duration = Duration::from_secs(5);
/// And from there to the next one: who refuses it gets it no faster.
const PAUSE: Duration = Duration::from_millis(250);
/// From one word about clocks to the next: often enough that within seconds some of both ways are quick.
const CLOCKS: Duration = Duration::from_millis(250);
/// A connection begins with as many as that, so that its clock is known before there is something to say (ns).
pub(super) const BEGINNING_NS: i64 = 5_000_000_000;
/// After a message either way so long there are words about clocks (ns). Else the members share one word each time: what a robot spends on
/// clocks grows with its neighbours, not with its team.
pub(super) const COMPANY_NS: i64 = 10_000_000_000;

/// Sends a word of the link itself, which must arrive: without a hello nothing else is heard, as long as the connection is up. So it is tried
/// until it has arrived or the connection is over.
pub(super) fn at_once(line: Line, message: Vec<u8>) {
    spawn_local(async move {
        while !line.is_over() && !line.send_stream(&message, PATIENCE).await {
            tokio::time::sleep(PAUSE).await;
        }
    });
}

/// Sends what waits for a member, within its budget, until the task is ended.
pub(super) async fn empty_queue(office: Rc<RefCell<Office>>, id: u16, line: Line) {
    let per_s = f64::from(office.borrow().section.max_bytes_per_s);
    let mut budget = Budget::new(per_s, now().boot_ns);
    let Some(put) = office
        .borrow()
        .members
        .get(&id)
        .map(|it| Rc::clone(&it.put))
    else {
        return;
    };
    loop {
        let next = {
            let mut office = office.borrow_mut();
            let member = office.members.get_mut(&id);
            // Of several connections one sends.
            let own = member.filter(|it| it.line.is(&line));
            let popped = own.map(|it| it.queue.pop(now().boot_ns));
            let (next, too_old) = popped.unwrap_or_default();
            office.counts.too_old_to_send += too_old;
            next
        };
        let Some(message) = next else {
            put.notified().await;
            continue;
        };
        let wait_s = budget.take(message.bytes.len(), now().boot_ns);
        if wait_s > 0.0 {
            tokio::time::sleep(Duration::from_secs_f64(wait_s)).await;
        }
        hand_over(&office, &line, message);
    }
}

fn hand_over(office: &Rc<RefCell<Office>>, line: &Line, message: Waiting) {
    office.borrow_mut().counts.sent += 1;
    let largest = line.largest_datagram().min(LARGEST_DATAGRAM);
    if message.matters == Matters::Newest && message.bytes.len() <= largest {
        if !line.send_datagram(&message.bytes) {
            office.borrow_mut().counts.not_in_time += 1;
        }
        return;
    }
    let left_ns = message.until_ns.saturating_sub(now().boot_ns);
    let patience = Duration::from_nanos(u64::try_from(left_ns).unwrap_or(0));
    let (office, line) = (Rc::clone(office), line.clone());
    spawn_local(async move {
        if !line.send_stream(&message.bytes, patience).await {
            office.borrow_mut().counts.not_in_time += 1;
        }
    });
}

/// Tells those with whom something is exchanged of the own clock, and one of the others in turn, until the end. Such a word is worth nothing
/// late.
pub(super) async fn tell_clocks(office: Rc<RefCell<Office>>) {
    let mut last = 0;
    loop {
        {
            let mut office = office.borrow_mut();
            for id in to_be_told(&office, now().boot_ns, &mut last) {
                office.tell_clock(id);
            }
        }
        tokio::time::sleep(CLOCKS).await;
    }
}

impl Office {
    /// Tells a member of the own clock.
    pub(super) fn tell_clock(&mut self, id: u16) {
        let body = self.admission.clock_word(id).body();
        let message = self.seal(word::CLOCK, id, &body);
        let line = self.members.get(&id).map(|it| &it.line);
        // What is lost is said again soon.
        let _ = message.is_some_and(|it| line.is_some_and(|line| line.send_datagram(&it)));
    }
}

/// All in company, and the one of the others that follows `last`.
fn to_be_told(office: &Office, now_ns: i64, last: &mut u16) -> Vec<u16> {
    let members = office.members.iter();
    let (mut told, others): (Vec<_>, Vec<_>) = members
        .map(|(id, member)| (*id, member.company_until_ns >= now_ns))
        .partition(|(_, in_company)| *in_company);
    let next = others.iter().find(|(id, _)| id > last);
    if let Some(next) = next.or_else(|| others.first()) {
        *last = next.0;
        told.push(*next);
    }
    told.into_iter().map(|(id, _)| id).collect()
}
