//! The search without a centre: every message of every robot, in order.

use std::collections::BTreeMap;

use coloc_estimator::assist::search::{Answer, Patience, Settled, Sight, Use};
use coloc_estimator::assist::team::{Place, Team};
use coloc_estimator::assist::tree::Graph;
use coloc_estimator::assist::wait::{Around, Bound, Wait};
use serde::Deserialize;

use crate::network::{self, Body, Network};
use crate::support::read_vectors;
use crate::sync::{Got, Lost, Message, Order, Run};
use crate::trees::{graph_of, place, team_of};

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    id: String,
    tag: String,
    #[serde(flatten)]
    protocol: Protocol,
}

#[derive(Deserialize)]
#[serde(tag = "protocol", rename_all = "lowercase")]
enum Protocol {
    Sync {
        input: SyncInput,
        expected: SyncExpected,
    },
    Async {
        input: AsyncInput,
        expected: AsyncExpected,
    },
}

#[derive(Deserialize)]
struct SyncInput {
    #[serde(flatten)]
    given: Given,
    order: String,
    lost: Vec<usize>,
    ack_lost: Vec<usize>,
}

#[derive(Deserialize)]
struct Given {
    children: Vec<u16>,
    arrival: Vec<u16>,
    sees: Vec<[u16; 2]>,
}

/// Greatest delay, liberate point, when it is fused, leaders fused, when it closes.
type Bounded = (u32, Option<u32>, Option<u32>, Vec<u16>, Option<u32>);

#[derive(Deserialize)]
struct SyncExpected {
    messages: Vec<Message>,
    got: Vec<Got>,
    consumed: Vec<(u16, u16, u16)>,
    points: Vec<Point>,
}

/// Child, n, `n_ch`, n̄, then for the bounds "team" and "own" what [`Bounded`] has.
#[derive(Deserialize)]
struct Point(
    u16,
    usize,
    usize,
    usize,
    u32,
    Option<u32>,
    Option<u32>,
    Vec<u16>,
    Option<u32>,
    u32,
    Option<u32>,
    Option<u32>,
    Vec<u16>,
    Option<u32>,
);

#[derive(Deserialize)]
struct AsyncInput {
    #[serde(flatten)]
    given: Given,
    ack_timeout: u32,
    close_after: u32,
}

#[derive(Deserialize)]
struct AsyncExpected {
    messages: Vec<Sent>,
    received: Vec<(u32, u16, usize, String)>,
    got: Vec<Got>,
    edges: Vec<(u16, u16, String, Option<u16>)>,
    complete: Vec<(u16, usize, Option<u32>)>,
}

/// Number, tick, kind, from, to, leader, path or bit, ticks of arrival.
type Sent = (usize, u32, String, u16, u16, u16, Said, Vec<u32>);

#[derive(Deserialize, Debug, PartialEq)]
#[serde(untagged)]
pub(crate) enum Said {
    Bit(u8),
    Path(Vec<u16>),
}

impl Given {
    fn team(&self) -> (Team, Graph) {
        let team = team_of(&self.arrival, &self.children);
        let graph = graph_of(&team, &self.sees);
        (team, graph)
    }
}

/// n, `n_ch`, |L| and |C| at a child.
pub(crate) fn around(team: &Team, graph: &Graph, child: Place) -> Around {
    let seen = graph.seen_by(child);
    Around {
        seen: seen.count(),
        seen_children: seen.and(team.children()).count(),
        leaders: team.leaders().count(),
        children: team.children().count(),
    }
}

/// What a child fuses that waits by this bound, given when what came.
pub(crate) fn waited(around: &Around, bound: Bound, got: &[Got]) -> Bounded {
    let Some(mut wait) = Wait::new(around, bound) else {
        return (0, None, None, Vec::new(), None);
    };
    let by = |tick| got.iter().filter(move |it| it.4 <= tick);
    let mut ticks = 0..=wait.max_delay();
    let due = |tick: &u32| wait.is_due(*tick, by(*tick).count());
    let fused = ticks.find(due).unwrap();
    let leaders: Vec<u16> = by(fused).map(|it| it.1).collect();
    let is_liberated = leaders.len() >= wait.most();
    assert_eq!(wait.fused(), Some(fused));
    (
        wait.max_delay(),
        is_liberated.then_some(fused),
        Some(fused),
        leaders,
        wait.closes(),
    )
}

impl SyncInput {
    fn check(&self, name: &str, expected: SyncExpected) {
        let (team, graph) = self.given.team();
        let order = match self.order.as_str() {
            "fifo" => Order::Fifo,
            "sender" => Order::Sender,
            other => panic!("order {other}"),
        };
        let lost = Lost {
            data: &self.lost,
            acks: &self.ack_lost,
        };
        let run = Run::new(&team, &graph, &self.given.arrival, order, lost);
        for (found, stated) in run.messages.iter().zip(&expected.messages) {
            assert_eq!(found, stated, "{name}");
        }
        assert_eq!(run.messages.len(), expected.messages.len(), "{name}");
        assert_eq!(run.got, expected.got, "{name}");
        assert_eq!(run.consumed(), expected.consumed, "{name}");
        assert_eq!(expected.points.len(), team.children().count());
        for point in expected.points {
            let Point(child, n, n_ch, n_bar, t1, t2, t3, t4, t5, o1, o2, o3, o4, o5) = point;
            let around = around(&team, &graph, place(&team, child));
            assert_eq!((around.seen, around.seen_children), (n, n_ch), "{name}");
            let wait = Wait::new(&around, Bound::Team);
            assert_eq!(wait.map_or(0, |it| it.most()), n_bar, "{name}");
            let got: Vec<Got> = run.got.iter().filter(|it| it.0 == child).copied().collect();
            let (of_team, of_own) = ((t1, t2, t3, t4, t5), (o1, o2, o3, o4, o5));
            assert_eq!(
                waited(&around, Bound::Team, &got),
                of_team,
                "{name}, {child}"
            );
            assert_eq!(waited(&around, Bound::Own, &got), of_own, "{name}, {child}");
        }
    }
}

fn result_of(result: network::Result) -> &'static str {
    match result {
        network::Result::Data(Answer::Accepted) => "accept",
        network::Result::Data(Answer::Repeated) => "repeat",
        network::Result::Data(Answer::Declined) => "have",
        network::Result::Data(Answer::Closed) => "closed",
        network::Result::Ack(Settled::Consumed) => "consumed",
        network::Result::Ack(Settled::Freed) => "freed",
        network::Result::Ack(Settled::Ignored) => "ignored",
    }
}

/// Numbers of leaders by rank.
fn leader_of(team: &Team, rank: coloc_estimator::assist::team::Rank) -> u16 {
    let mut leaders = team.leaders().each();
    let found = leaders.find(|it| team.rank(*it) == Some(rank)).unwrap();
    team.id(found).0
}

fn message_of(team: &Team, found: &network::Message) -> (u32, &'static str, u16, u16, u16, Said) {
    let number = |place| team.id(place).0;
    let (kind, said) = match &found.body {
        Body::Ack(bit) => ("ACK", Said::Bit(u8::from(*bit))),
        Body::Data(path) => {
            let path = path.places().iter().copied().map(number);
            ("DATA", Said::Path(path.collect()))
        }
    };
    let leader = leader_of(team, found.leader);
    (
        found.tick,
        kind,
        number(found.from),
        number(found.to),
        leader,
        said,
    )
}

fn edge_of(team: &Team, child: Place, sight: Sight) -> (u16, u16, String, Option<u16>) {
    let (state, leader) = match sight.used {
        Use::Free => ("free", None),
        Use::Pending(leader) => ("pending", Some(leader)),
        Use::Consumed(leader) => ("consumed", Some(leader)),
        Use::TimedOut(leader) => ("consumed by time-out", Some(leader)),
    };
    let leader = leader.map(|it| leader_of(team, it));
    (
        team.id(child).0,
        team.id(sight.child).0,
        state.into(),
        leader,
    )
}

impl AsyncInput {
    fn check(&self, name: &str, expected: &AsyncExpected) {
        let (team, graph) = self.given.team();
        let patience = Patience {
            ack_timeout: self.ack_timeout,
            close_after: self.close_after,
        };
        let deliver = |number: usize, _| expected.messages[number].7.clone();
        let mut network = Network::new(&team, &graph, &self.given.arrival, patience, deliver);
        network.run();
        for (found, stated) in network.messages.iter().zip(&expected.messages) {
            let (tick, kind, from, to, leader, said) = message_of(&team, found);
            let (number, t, k, f, o, l, s, _) = stated;
            let stated = (t, k.as_str(), f, o, l, s);
            assert_eq!(
                (&tick, kind, &from, &to, &leader, &said),
                stated,
                "{name}, {number}"
            );
        }
        assert_eq!(network.messages.len(), expected.messages.len(), "{name}");
        let received = network.received.iter();
        let received: Vec<_> = received
            .map(|(tick, to, number, result)| {
                (
                    *tick,
                    team.id(*to).0,
                    *number,
                    result_of(*result).to_owned(),
                )
            })
            .collect();
        assert_eq!(received, expected.received, "{name}");
        assert_eq!(network.got, expected.got, "{name}");
        let edges = network.searches.iter();
        let edges: Vec<_> = edges
            .flat_map(|(child, it)| it.sights().iter().map(|it| edge_of(&team, *child, *it)))
            .collect();
        assert_eq!(edges, expected.edges, "{name}");
        let mut ticks: BTreeMap<u16, Vec<u32>> = BTreeMap::new();
        for (child, .., tick) in &network.got {
            ticks.entry(*child).or_default().push(*tick);
        }
        for (child, most, complete) in &expected.complete {
            let around = around(&team, &graph, place(&team, *child));
            let found = Wait::new(&around, Bound::Team).map_or(0, |it| it.most());
            assert_eq!(found, *most, "{name}, {child}");
            let mut ticks = ticks.remove(child).unwrap_or_default();
            ticks.sort_unstable();
            let last = most.checked_sub(1).and_then(|it| ticks.get(it)).copied();
            assert_eq!(last, *complete, "{name}, {child}");
        }
    }
}

#[test]
fn distributed() {
    let Some(file) = read_vectors::<File>("leader/distributed.json") else {
        return;
    };
    assert!(file.cases.len() > 60, "{}", file.cases.len());
    for case in file.cases {
        let name = format!("{} ({})", case.id, case.tag);
        match case.protocol {
            Protocol::Sync { input, expected } => input.check(&name, expected),
            Protocol::Async { input, expected } => input.check(&name, &expected),
        }
    }
}
