//! A team whose acknowledgements are there before the next datum is sent: the thesis's distributed search, in a queue of the test.

use std::collections::{BTreeMap, HashMap, VecDeque};

use coloc_estimator::assist::path::Path;
use coloc_estimator::assist::refusal::Refusal;
use coloc_estimator::assist::search::{Answer, Patience, Search, Use};
use coloc_estimator::assist::team::{Place, Team};
use coloc_estimator::assist::tree::Graph;

use crate::trees::place;

/// Tick, from, to, leader, path, result, acknowledgement.
pub(crate) type Message = (u32, u16, u16, u16, Vec<u16>, String, Option<u8>);

/// Child, leader, predecessor, degree of observation, tick.
pub(crate) type Got = (u16, u16, u16, usize, u32);

/// Nobody waits for anything.
const PATIENCE: Patience = Patience {
    ack_timeout: 0,
    close_after: u32::MAX,
};

/// In which order robots hand on.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// As they took it.
    Fifo,
    /// Those of one tick by the robots' numbers.
    Sender,
}

/// The numbers of messages that nobody gets, and of those that nobody hears an answer to.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Lost<'a> {
    pub(crate) data: &'a [usize],
    pub(crate) acks: &'a [usize],
}

pub(crate) struct Run<'a> {
    team: &'a Team,
    graph: &'a Graph,
    lost: Lost<'a>,
    pub(crate) searches: BTreeMap<Place, Search>,
    tasks: VecDeque<Task>,
    pub(crate) messages: Vec<Message>,
    pub(crate) got: Vec<Got>,
}

struct Task {
    tick: u32,
    child: Place,
    path: Vec<u16>,
}

/// What a child sees of children.
pub(crate) fn searches(team: &Team, graph: &Graph) -> BTreeMap<Place, Search> {
    let mut searches = BTreeMap::new();
    for child in team.children().each() {
        let mut search = Search::default();
        for seen in graph.seen_by(child).and(team.children()).each() {
            assert!(search.see(seen));
        }
        searches.insert(child, search);
    }
    searches
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        team: &'a Team,
        graph: &'a Graph,
        arrival: &[u16],
        order: Order,
        lost: Lost<'a>,
    ) -> Self {
        let mut run = Self {
            team,
            graph,
            lost,
            searches: searches(team, graph),
            tasks: VecDeque::new(),
            messages: Vec::new(),
            got: Vec::new(),
        };
        for leader in arrival {
            let seen = graph.seen_by(place(team, *leader)).and(team.children());
            for child in seen.each() {
                run.send(0, *leader, child, &[*leader]);
            }
        }
        while let Some(task) = run.next(order) {
            run.hand_on(&task);
        }
        run.got.sort_unstable();
        run
    }

    /// Tasks are in the order of their ticks, so that those of the lowest are in front.
    fn next(&mut self, order: Order) -> Option<Task> {
        let tick = self.tasks.front()?.tick;
        let of_tick = self.tasks.iter().take_while(|it| it.tick == tick);
        let first = match order {
            Order::Fifo => 0,
            Order::Sender => of_tick.enumerate().min_by_key(|it| it.1.child)?.0,
        };
        self.tasks.remove(first)
    }

    fn hand_on(&mut self, task: &Task) {
        let Task { tick, child, path } = task;
        let predecessor = path[path.len() - 2];
        let leader = self.team.rank(place(self.team, path[0])).unwrap();
        let sender = self.team.id(*child).0;
        for seen in self.graph.seen_by(*child).and(self.team.children()).each() {
            let search = self.searches.get_mut(child).unwrap();
            if self.team.id(seen).0 == predecessor || !search.offer(leader, seen, *tick) {
                continue;
            }
            let ack = self.send(*tick, sender, seen, path);
            let search = self.searches.get_mut(child).unwrap();
            match ack {
                Some(bit) => {
                    search.answered(seen, leader, bit, *tick, PATIENCE);
                }
                None => assert_eq!(search.time_out(*tick, PATIENCE).count(), 1),
            }
        }
    }

    /// The bit of the answer, if one came.
    fn send(&mut self, tick: u32, from: u16, to: Place, path: &[u16]) -> Option<bool> {
        let number = self.messages.len();
        let longer = [path, &[self.team.id(to).0]].concat();
        let (result, ack) = if self.lost.data.contains(&number) {
            ("lost", None)
        } else {
            match self.hear(to, &longer) {
                Answer::Accepted => {
                    self.take(tick, from, to, &longer);
                    ("accept", Some(true))
                }
                Answer::Declined => ("have", Some(false)),
                other => panic!("{longer:?}: {other:?}"),
            }
        };
        let ack = ack.filter(|_| !self.lost.acks.contains(&number));
        let (to, bit) = (self.team.id(to).0, ack.map(u8::from));
        self.messages
            .push((tick, from, to, path[0], longer, result.into(), bit));
        ack
    }

    /// Who was on the way has it.
    fn hear(&mut self, to: Place, path: &[u16]) -> Answer {
        let ids: Vec<_> = path.iter().copied().map(coloc_estimator::RobotId).collect();
        let leader = self.team.rank(place(self.team, path[0])).unwrap();
        let search = self.searches.get_mut(&to).unwrap();
        match Path::new(self.team, &ids) {
            Ok(path) => search.hear(leader, &path, 0, PATIENCE),
            Err(refusal) => {
                assert_eq!(refusal, Refusal::Looped);
                assert!(search.path_of(leader).is_some());
                Answer::Declined
            }
        }
    }

    fn take(&mut self, tick: u32, from: u16, to: Place, path: &[u16]) {
        let child = self.team.id(to).0;
        self.got.push((child, path[0], from, path.len() - 1, tick));
        self.tasks.push_back(Task {
            tick: tick + 1,
            child: to,
            path: path.to_vec(),
        });
    }

    /// From, to, leader.
    pub(crate) fn consumed(&self) -> Vec<(u16, u16, u16)> {
        let leaders: Vec<_> = self.team.leaders().each().collect();
        let by_rank: HashMap<_, _> = leaders
            .iter()
            .map(|it| (self.team.rank(*it).unwrap(), self.team.id(*it).0))
            .collect();
        let mut consumed = Vec::new();
        for (child, search) in &self.searches {
            for sight in search.sights() {
                if let Use::Consumed(leader) | Use::TimedOut(leader) = sight.used {
                    let edge = (self.team.id(*child).0, self.team.id(sight.child).0);
                    consumed.push((edge.0, edge.1, by_rank[&leader]));
                }
            }
        }
        consumed
    }
}
