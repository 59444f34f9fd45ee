//! From the network to shared memory.
use std::cell::RefCell;
use std::rc::Rc;

use tokio::task::spawn_local;

use super::office::{Office, now};
use super::send;
use crate::admission::{Payload, Word};
use crate::clock_offset::Correction;
use crate::engine::Line;
use crate::wire::word;

/// Takes what comes as datagrams, until the end of the connection.
pub(super) async fn datagrams(office: Rc<RefCell<Office>>, line: Line) {
    while let Some(message) = line.datagram().await {
        office.borrow_mut().take(&message, &line);
    }
}

/// Takes what comes as streams: each when it is whole, none waits for another.
pub(super) async fn streams(office: Rc<RefCell<Office>>, line: Line) {
    while let Some(arriving) = line.stream().await {
        let (office, line) = (Rc::clone(&office), line.clone());
        spawn_local(async move {
            if let Some(message) = arriving.whole().await {
                office.borrow_mut().take(&message, &line);
            }
        });
    }
}

impl Office {
    /// Takes a message that came over a connection.
    pub(super) fn take(&mut self, message: &[u8], line: &Line) {
        self.counts.came += 1;
        let roster = self.roster();
        let name = roster.owner(line.key()).map(|owner| owner.name.to_string());
        let name = name.unwrap_or_default();
        match self.admission.admit(message, line.key(), &roster, now()) {
            Ok(Word::Payload(payload)) => self.deliver(&payload),
            Ok(Word::Roster(text)) => {
                if self.offer(text, &name) {
                    self.hand_on_the_roster();
                }
            }
            Ok(Word::Hello(_)) => self.compare_rosters(line),
            Ok(Word::Clock) => {}
            Err(refusal) => {
                self.counts.refused += 1;
                self.teller.remark(format!("{name}: {refusal}"));
            }
        }
    }

    fn deliver(&mut self, payload: &Payload<'_>) {
        let speaker = payload.envelope.speaker;
        let Correction { by_ns, variance_s2 } = payload.correction;
        if payload.correction == Correction::default() {
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
