//! A team whose messages take ticks, get lost or come twice: as robots live.

use std::collections::BTreeMap;

use coloc_estimator::assist::path::Path;
use coloc_estimator::assist::search::{Answer, Patience, Search, Settled};
use coloc_estimator::assist::team::{Place, Rank, Team};
use coloc_estimator::assist::tree::Graph;

use crate::sync::{Got, searches};
use crate::trees::place;

/// What is in a message.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Body {
    Data(Path),
    Ack(bool),
}

#[derive(Clone, Debug)]
pub(crate) struct Message {
    pub(crate) tick: u32,
    pub(crate) from: Place,
    pub(crate) to: Place,
    pub(crate) leader: Rank,
    pub(crate) body: Body,
}

/// What became of a message.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) enum Result {
    Data(Answer),
    Ack(Settled),
}

pub(crate) struct Network<'a, D> {
    team: &'a Team,
    patience: Patience,
    /// In which ticks the message with this number arrives.
    deliver: D,
    pub(crate) searches: BTreeMap<Place, Search>,
    pub(crate) messages: Vec<Message>,
    inbox: BTreeMap<(u32, Place), Vec<(Place, usize)>>,
    /// Tick, receiver, number, result.
    pub(crate) received: Vec<(u32, Place, usize, Result)>,
    pub(crate) got: Vec<Got>,
}

impl<'a, D: FnMut(usize, u32) -> Vec<u32>> Network<'a, D> {
    pub(crate) fn new(
        team: &'a Team,
        graph: &Graph,
        arrival: &[u16],
        patience: Patience,
        deliver: D,
    ) -> Self {
        let mut network = Self {
            team,
            patience,
            deliver,
            searches: searches(team, graph),
            messages: Vec::new(),
            inbox: BTreeMap::new(),
            received: Vec::new(),
            got: Vec::new(),
        };
        for leader in arrival {
            let from = place(team, *leader);
            for to in graph.seen_by(from).and(team.children()).each() {
                network.send(Message {
                    tick: 0,
                    from,
                    to,
                    leader: team.rank(from).unwrap(),
                    body: Body::Data(Path::first(from, to)),
                });
            }
        }
        network
    }

    /// Until nobody has anything to do any more.
    pub(crate) fn run(&mut self) {
        let mut tick = 1;
        while tick <= self.patience.close_after || !self.inbox.is_empty() {
            for child in self.team.children().each() {
                self.act(child, tick);
            }
            tick += 1;
        }
        self.got.sort_unstable();
    }

    fn send(&mut self, message: Message) {
        let number = self.messages.len();
        for tick in (self.deliver)(number, message.tick) {
            let inbox = self.inbox.entry((tick, message.to)).or_default();
            inbox.push((message.from, number));
        }
        self.messages.push(message);
    }

    fn act(&mut self, child: Place, tick: u32) {
        let mut inbox = self.inbox.remove(&(tick, child)).unwrap_or_default();
        inbox.sort_unstable();
        let mut search = self.searches[&child];
        let mut out = Vec::new();
        for (_, number) in inbox {
            let message = self.messages[number].clone();
            let result = self.hear(&mut search, &message, tick);
            self.received.push((tick, child, number, result));
            if let Result::Data(answer) = result
                && self.team.children().contains(message.from)
            {
                let body = Body::Ack(answer.acknowledges());
                out.push((message.from, message.leader, body));
            }
        }
        let _ = search.time_out(tick, self.patience);
        search.hand_on(tick, self.patience, |leader, path| {
            out.push((path.end(), leader, Body::Data(*path)));
            true
        });
        self.searches.insert(child, search);
        for (to, leader, body) in out {
            self.send(Message {
                tick,
                from: child,
                to,
                leader,
                body,
            });
        }
    }

    fn hear(&mut self, search: &mut Search, message: &Message, tick: u32) -> Result {
        let Message { from, leader, .. } = *message;
        match &message.body {
            Body::Ack(bit) => Result::Ack(search.answered(from, leader, *bit, tick, self.patience)),
            Body::Data(path) => {
                let answer = search.hear(leader, path, tick, self.patience);
                if answer == Answer::Accepted {
                    let number = |place| self.team.id(place).0;
                    let (child, first) = (number(path.end()), number(path.leader()));
                    self.got
                        .push((child, first, number(from), path.hops(), tick));
                }
                Result::Data(answer)
            }
        }
    }
}
