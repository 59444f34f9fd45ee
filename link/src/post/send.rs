//! From the queues to the network.
use std::cell::RefCell;
use std::rc::Rc;
use std::task::{Context, Waker};
use std::time::Duration;

use coloc_shm_types::Matters;
use tokio::sync::Notify;
use tokio::task::spawn_local;

use super::office::{Office, now};
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

/// Sends what waits for a member and could not be sent when it was said, until the task is ended.
pub(super) async fn empty_queue(office: Rc<RefCell<Office>>, id: u16, line: Line) {
    let Some(put) = office
        .borrow()
        .members
        .get(&id)
        .map(|it| Rc::clone(&it.put))
    else {
        return;
    };
    loop {
        match send_due(&office, id, &line) {
            Some(rest) => tokio::time::sleep(rest).await,
            None => put.notified().await,
        }
    }
}

/// Sends what the own robot has just said: no task has to be woken for it, and only what has to wait is left to one.
pub(super) fn send_all(office: &Rc<RefCell<Office>>) {
    let due = office.borrow().due();
    for (id, line, put) in due {
        if send_due(office, id, &line).is_some() {
            put.notify_waiters();
        }
    }
}

/// Sends what waits for a member as far as its budget goes; after how long the rest may go, if there is one.
fn send_due(office: &Rc<RefCell<Office>>, id: u16, line: &Line) -> Option<Duration> {
    loop {
        let message = match office.borrow_mut().next(id, line) {
            Next::Message(message) => message,
            Next::Later(rest) => return Some(rest),
            Next::Nothing => return None,
        };
        hand_over(office, line, message);
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
    let mut sending = Box::pin(async move {
        if !line.send_stream(&message.bytes, patience).await {
            office.borrow_mut().counts.not_in_time += 1;
        }
    });
    // It goes out now; until it has arrived is for a task to wait.
    let mut nobody = Context::from_waker(Waker::noop());
    if sending.as_mut().poll(&mut nobody).is_pending() {
        spawn_local(sending);
    }
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

/// What is to be sent to a member.
enum Next {
    Message(Waiting),
    /// It has been sent as much as it may.
    Later(Duration),
    Nothing,
}

impl Office {
    /// Members for whom something waits.
    fn due(&self) -> Vec<(u16, Line, Rc<Notify>)> {
        let members = self.members.iter();
        let due = members.filter(|(_, it)| !it.queue.is_empty());
        due.map(|(id, it)| (*id, it.line.clone(), Rc::clone(&it.put)))
            .collect()
    }

    fn next(&mut self, id: u16, line: &Line) -> Next {
        let now_ns = now().boot_ns;
        // Of several connections one sends.
        let member = self.members.get_mut(&id).filter(|it| it.line.is(line));
        let Some(member) = member.filter(|it| !it.queue.is_empty()) else {
            return Next::Nothing;
        };
        let rest_s = member.told.take(0, now_ns);
        if rest_s > 0.0 {
            return Next::Later(Duration::from_secs_f64(rest_s));
        }
        let (next, too_old) = member.queue.pop(now_ns);
        self.counts.too_old_to_send += too_old;
        let Some(message) = next else {
            return Next::Nothing;
        };
        // What it is too much is waited for before the next one.
        member.told.take(message.bytes.len(), now_ns);
        Next::Message(message)
    }

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
