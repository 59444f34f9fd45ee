//! From the network to shared memory.
use std::cell::RefCell;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::Poll;
use std::time::Duration;

use tokio::task::spawn_local;

use super::office::{Office, now};
use super::send;
use crate::admission::{Payload, Word};
use crate::clock_offset::Correction;
use crate::engine::Line;
use crate::wire::word;

/// A member is heard up to so many times what may be said to each: nobody who keeps to the same bound waits, and what floods us waits there,
/// or is lost.
pub(super) const MORE_THAN_SAID: f64 = 2.0;

/// Takes what comes as datagrams, until the end of the connection.
pub(super) async fn datagrams(office: Rc<RefCell<Office>>, id: u16, line: Line) {
    while let Some(message) = line.datagram().await {
        office.borrow_mut().take(&message, &line);
        pay(&office, id, message.len()).await;
    }
}

/// Takes what comes as streams: each when it is whole, none waits for another.
pub(super) async fn streams(office: Rc<RefCell<Office>>, id: u16, line: Line) {
    while let Some(arriving) = line.stream().await {
        let mut whole = Box::pin(arriving.whole());
        // Most are whole when they are seen to begin.
        if let Poll::Ready(message) = poll_fn(|it| Poll::Ready(whole.as_mut().poll(it))).await {
            let bytes = message.as_ref().map_or(0, Vec::len);
            if let Some(message) = message {
                office.borrow_mut().take(&message, &line);
            }
            pay(&office, id, bytes).await;
            continue;
        }
        let (later, line) = (Rc::clone(&office), line.clone());
        spawn_local(async move {
            if let Some(message) = whole.await {
                let bytes = message.len();
                let mut office = later.borrow_mut();
                office.take(&message, &line);
                office.charge(id, bytes);
            }
        });
        pay(&office, id, 0).await;
    }
}

/// Waits until the member may be heard on.
async fn pay(office: &Rc<RefCell<Office>>, id: u16, bytes: usize) {
    let wait_s = office.borrow_mut().charge(id, bytes);
    if wait_s > 0.0 {
        office.borrow_mut().counts.told_too_much += 1;
        tokio::time::sleep(Duration::from_secs_f64(wait_s)).await;
    }
}

impl Office {
    /// How long a member that has said so many bytes more is not to be heard (s).
    fn charge(&mut self, id: u16, bytes: usize) -> f64 {
        let member = self.members.get_mut(&id);
        member.map_or(0.0, |it| it.heard.take(bytes, now().boot_ns))
    }

    /// Takes a message that came over a connection.
    pub(super) fn take(&mut self, message: &[u8], line: &Line) {
        self.counts.came += 1;
        let roster = self.roster();
        let owner = roster.owner(line.key());
        let name = owner.map_or("", |owner| owner.name.as_str());
        let id = owner.map_or(self.own, |owner| owner.id);
        let peer = self.admission.peer(id);
        let knew_its_clock = peer.is_some_and(|it| it.offset().is_some());
        let present = self.shown_now();
        match self.admission.admit(message, line.key(), &roster, present) {
            Ok(Word::Payload(payload)) => self.deliver(&payload),
            Ok(Word::Roster(text)) => {
                if self.offer(text, name) {
                    self.hand_on_the_roster();
                }
            }
            Ok(Word::Hello(_)) => {
                self.compare_rosters(line);
                self.tell_clock(id);
            }
            // Until both know both clocks, nothing else is admitted: they do not wait for the next round of words. Who has just started
            // knows nothing of ours, also where its clock is known here from before.
            Ok(Word::Clock { is_first }) if is_first || !knew_its_clock => self.tell_clock(id),
            Ok(Word::Clock { .. }) => {}
            Err(refusal) => {
                self.counts.refused += 1;
                self.teller.remark(format!("{name}: {refusal}"));
            }
        }
    }

    fn deliver(&mut self, payload: &Payload<'_>) {
        let speaker = payload.envelope.speaker;
        if let Some(member) = self.members.get_mut(&speaker) {
            member.company_until_ns = now().boot_ns.saturating_add(send::COMPANY_NS);
        }
        let Correction { by_ns, variance_s2 } = payload.correction;
        let shown_ns = payload.stamp_ns.saturating_add(by_ns);
        let by_ns = by_ns + (self.clock.right(shown_ns) - shown_ns);
        if by_ns == 0 && variance_s2 == 0.0 {
            self.say(speaker, &payload.kind, payload.bytes);
            return;
        }
        let added = self.motion.blur(variance_s2);
        let mut bytes = payload.bytes.to_vec();
        if payload.kind.correct(&mut bytes, by_ns, &added).is_some() {
            self.say(speaker, &payload.kind, &bytes);
        }
    }

    /// Who goes by an older roster gets this one.
    fn compare_rosters(&mut self, line: &Line) {
        let roster = self.roster();
        let Some(owner) = roster.owner(line.key()) else {
            return;
        };
        let theirs = self
            .admission
            .peer(owner.id)
            .map_or(0, crate::admission::Peer::roster);
        if theirs < roster.version {
            self.hand_on(owner.id, line);
        }
    }

    fn hand_on(&mut self, id: u16, line: &Line) {
        let text = self.book.text().to_owned();
        if let Some(message) = self.seal(word::ROSTER, id, text.as_bytes()) {
            send::at_once(line.clone(), message);
        }
    }

    pub(super) fn hand_on_the_roster(&mut self) {
        let lines: Vec<_> = self
            .members
            .iter()
            .map(|(id, it)| (*id, it.line.clone()))
            .collect();
        for (id, line) in lines {
            self.hand_on(id, &line);
        }
    }
}
