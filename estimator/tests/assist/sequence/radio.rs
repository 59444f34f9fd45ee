//! Messages that take steps, between children with several events open.

use std::collections::BTreeMap;

use coloc_estimator::assist::datum::first;
use coloc_estimator::assist::events::{Data, Events, Now, Terms, Word};
use coloc_estimator::assist::path::Path;
use coloc_estimator::assist::search::{Answer, Patience, Settled};
use coloc_estimator::assist::slot::{Slot, Slots};
use coloc_estimator::assist::team::Team;
use coloc_estimator::{GlobalPose, RobotId, Span, Stamp};

use super::world::{Meta, PAPER, Sent, Step, World, numbers};
use crate::distributed::Said;
use crate::trees::place;

/// Events are this many steps apart.
const EVERY: u32 = 10;

#[derive(Clone)]
enum Body {
    Data(Box<Data>),
    Ack(bool),
}

/// Of one event.
#[derive(Clone)]
struct Message {
    from: u16,
    to: u16,
    leader: u16,
    body: Body,
}

/// Event, sender, number.
type Arrived = (Slot, u16, usize);

/// Receiver, number, result, what was taken.
type Received = (u16, usize, &'static str, Option<GlobalPose>);

/// All children, each with its open events; messages by the event's slot.
pub(super) struct Radio {
    terms: Terms,
    events: BTreeMap<u16, Events>,
    messages: BTreeMap<Slot, Vec<Message>>,
    /// By step and receiver.
    inbox: BTreeMap<(u32, u16), Vec<Arrived>>,
    /// Of this step.
    sent: BTreeMap<Slot, Vec<usize>>,
    received: BTreeMap<Slot, Vec<Received>>,
}

fn slot_of(step: u32) -> Slot {
    Slot(i64::from(step / EVERY))
}

fn stamp_of(step: u32) -> Stamp {
    Stamp::default() + Span::from_millis(i64::from(step) * 20)
}

pub(super) fn began(slot: Slot) -> u32 {
    u32::try_from(slot.0).unwrap() * EVERY
}

impl Radio {
    pub(super) fn new(meta: &Meta, team: Team) -> Self {
        let patience = Patience {
            ack_timeout: meta.ack_timeout.unwrap(),
            close_after: meta.close_after.unwrap(),
        };
        let events = meta.children.iter();
        let events = events.map(|id| (*id, Events::new(place(&team, *id), Slot(0))));
        Self {
            events: events.collect(),
            terms: Terms {
                team,
                slots: Slots::new(Span::from_millis(200), Span::ZERO).unwrap(),
                patience,
                is_full: false,
                propagation: PAPER,
            },
            messages: BTreeMap::new(),
            inbox: BTreeMap::new(),
            sent: BTreeMap::new(),
            received: BTreeMap::new(),
        }
    }

    fn send(&mut self, slot: Slot, message: Message) {
        let messages = self.messages.entry(slot).or_default();
        self.sent.entry(slot).or_default().push(messages.len());
        messages.push(message);
    }

    /// An event begins: children see, leaders speak.
    pub(super) fn begin(&mut self, world: &World, step: &Step, arrival: &[u16]) {
        let (slot, stamp) = (slot_of(step.k), stamp_of(step.k));
        let (graph, readings) = world.readings(step);
        let team = world.team;
        let now = Now { tick: step.k, slot };
        for ((observer, observed), reading) in &readings {
            let observed = place(&team, *observed);
            let events = self.events.get_mut(observer);
            if let Some(events) = events.filter(|_| team.children().contains(observed)) {
                assert!(events.see(&self.terms, now, (observed, stamp, *reading), step.k));
            }
        }
        for leader in arrival {
            let from = place(&team, *leader);
            for child in graph.seen_by(from).and(team.children()).each() {
                let to = team.id(child).0;
                let reading = &readings[&(*leader, to)];
                let data = Data {
                    slot,
                    stamp,
                    path: Path::first(from, child),
                    is_final: false,
                    digest: 0,
                    said: first(&world.leaders[leader], reading, PAPER),
                    word: Word::default(),
                };
                let (from, leader, body) = (*leader, *leader, Body::Data(Box::new(data)));
                self.send(
                    slot,
                    Message {
                        from,
                        to,
                        leader,
                        body,
                    },
                );
            }
        }
    }

    /// One child's step: the event and pose of what it took.
    pub(super) fn act(&mut self, child: u16, step: u32) -> Vec<(Slot, RobotId, GlobalPose)> {
        let now = Now {
            tick: step,
            slot: slot_of(step),
        };
        let mut inbox = self.inbox.remove(&(step, child)).unwrap_or_default();
        inbox.sort_unstable();
        let (mut out, mut taken) = (Vec::new(), Vec::new());
        let events = self.events.get_mut(&child).unwrap();
        for (slot, _, number) in inbox {
            let message = self.messages[&slot][number].clone();
            let (from, leader) = (message.from, message.leader);
            let sender = place(&self.terms.team, from);
            let (result, said) = match &message.body {
                Body::Ack(bit) => {
                    let said = (sender, place(&self.terms.team, leader), *bit);
                    let settled = events.answered(&self.terms, now, said, slot).unwrap();
                    (settled_as(settled), None)
                }
                Body::Data(data) => {
                    let answer = events
                        .hear(&self.terms, now, sender, data, began(slot))
                        .unwrap();
                    if self.terms.team.children().contains(sender) {
                        let body = Body::Ack(answer.acknowledges());
                        out.push((slot, from, leader, body));
                    }
                    let said = (answer == Answer::Accepted).then_some(data.said);
                    taken.extend(said.map(|it| (slot, RobotId(leader), it)));
                    (answered_as(answer), said)
                }
            };
            let received = self.received.entry(slot).or_default();
            received.push((child, number, result, said));
        }
        let (team, at) = (self.terms.team, stamp_of(step));
        let way = |from: Stamp, to: Stamp| panic!("{from:?} to {to:?} at {at:?}: all at once");
        events.work(&self.terms, now, way, |data| {
            let (to, leader) = (team.id(data.path.end()).0, team.id(data.path.leader()).0);
            out.push((data.slot, to, leader, Body::Data(Box::new(*data))));
        });
        for (slot, to, leader, body) in out {
            let from = child;
            self.send(
                slot,
                Message {
                    from,
                    to,
                    leader,
                    body,
                },
            );
        }
        taken
    }

    /// What was sent in this step is what is stated, and arrives when that says.
    pub(super) fn check_sent(&mut self, stated: &[Sent]) {
        let sent = std::mem::take(&mut self.sent).into_iter();
        let sent = sent.flat_map(|(slot, numbers)| numbers.into_iter().map(move |it| (slot, it)));
        let sent: Vec<(Slot, usize)> = sent.collect();
        assert_eq!(sent.len(), stated.len());
        for ((slot, number), stated) in sent.into_iter().zip(stated) {
            let Message {
                from,
                to,
                leader,
                body,
            } = &self.messages[&slot][number];
            let (kind, said) = match body {
                Body::Ack(bit) => ("ACK", Said::Bit(u8::from(*bit))),
                Body::Data(data) => {
                    let path = data.path.places().iter();
                    (
                        "DATA",
                        Said::Path(path.map(|it| self.terms.team.id(*it).0).collect()),
                    )
                }
            };
            let (event, of, k, f, t, l, s, arrives) = stated;
            assert_eq!((began(slot), number), (*event, *of));
            assert_eq!((kind, from, to, leader, &said), (k.as_str(), f, t, l, s));
            for step in arrives {
                let inbox = self.inbox.entry((*step, *to)).or_default();
                inbox.push((slot, *from, number));
            }
        }
    }

    pub(super) fn check_received(&mut self, world: &mut World, stated: &[Vec<serde_json::Value>]) {
        let received = std::mem::take(&mut self.received).into_iter();
        let received: Vec<_> = received
            .flat_map(|(slot, lines)| lines.into_iter().map(move |it| (slot, it)))
            .collect();
        assert_eq!(received.len(), stated.len());
        for ((slot, (child, number, result, said)), line) in received.into_iter().zip(stated) {
            let found = serde_json::json!([began(slot), child, number, result]);
            assert_eq!(found.as_array().unwrap()[..], line[..4]);
            if line.len() > 4 {
                world.compare_datum(&said.unwrap(), &numbers(line, 4));
            }
        }
    }
}

fn answered_as(answer: Answer) -> &'static str {
    match answer {
        Answer::Accepted => "accept",
        Answer::Repeated => "repeat",
        Answer::Declined => "have",
        Answer::Closed => "closed",
    }
}

fn settled_as(settled: Settled) -> &'static str {
    match settled {
        Settled::Consumed => "consumed",
        Settled::Freed => "freed",
        Settled::Ignored => "ignored",
    }
}
