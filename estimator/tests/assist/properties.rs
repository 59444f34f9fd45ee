//! What holds of any team, whoever sees whom.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use coloc_estimator::RobotId;
use coloc_estimator::assist::search::{Answer, Patience, Search, Use};
use coloc_estimator::assist::team::{Place, Robots, Team};
use coloc_estimator::assist::tree::{Forest, Graph};
use coloc_estimator::assist::wait::{Bound, Wait};

use crate::distributed::{around, waited};
use crate::network::{Body, Network, Result};
use crate::sync::{Got, Lost, Order, Run};
use crate::trees::edges_of;

const GRAPHS: u64 = 20_000;

/// Random numbers of a test: the same on every machine.
struct Chance(u64);

impl Chance {
    /// Splitmix64.
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    fn percent(&mut self, share: u64) -> bool {
        self.below(100) < share
    }
}

/// A team, and whom its robots see.
struct World {
    team: Team,
    graph: Graph,
    /// In the order in which they speak.
    leaders: Vec<u16>,
    is_symmetric: bool,
}

impl World {
    fn new(chance: &mut Chance) -> Self {
        let children = 2 + chance.below(8);
        let count = children + 1 + chance.below(3);
        let mut ids = BTreeSet::new();
        while (ids.len() as u64) < count {
            ids.insert(u16::try_from(1 + chance.below(60)).unwrap());
        }
        let mut ids: Vec<u16> = ids.into_iter().collect();
        for place in (1..ids.len()).rev() {
            let other = usize::try_from(chance.below(place as u64 + 1)).unwrap();
            ids.swap(place, other);
        }
        let split = usize::try_from(children).unwrap();
        let (children, leaders) = ids.split_at(split);
        let team = crate::trees::team_of(leaders, children);
        let is_symmetric = !chance.percent(25);
        let density = 10 + chance.below(60);
        let mut graph = Graph::default();
        let all = team.leaders().each().chain(team.children().each());
        let all: Vec<Place> = all.collect();
        for (index, one) in all.iter().enumerate() {
            for other in &all[..index] {
                let (there, back) = (chance.percent(density), chance.percent(density));
                if there {
                    graph.see(*one, *other);
                }
                if if is_symmetric { there } else { back } {
                    graph.see(*other, *one);
                }
            }
        }
        Self {
            graph,
            leaders: leaders.to_vec(),
            is_symmetric,
            team,
        }
    }

    fn place(&self, id: u16) -> Place {
        self.team.place(RobotId(id)).unwrap()
    }

    fn places(&self) -> Vec<Place> {
        self.leaders.iter().map(|it| self.place(*it)).collect()
    }

    /// How many sightings each child is away from a leader, by children.
    fn distances(&self, leader: Place) -> BTreeMap<Place, usize> {
        let mut distances = BTreeMap::new();
        let mut level = Robots::only(leader);
        for distance in 1.. {
            let mut next = Robots::NONE;
            for seen in level.each().map(|it| self.graph.seen_by(it)) {
                for child in seen.and(self.team.children()).each() {
                    next = next.with(child);
                }
            }
            level = Robots::NONE;
            for child in next.each() {
                if let Entry::Vacant(place) = distances.entry(child) {
                    place.insert(distance);
                    level = level.with(child);
                }
            }
            if level == Robots::NONE {
                break;
            }
        }
        distances
    }

    fn seen_by_count(&self, child: Place) -> usize {
        let all = self
            .team
            .leaders()
            .each()
            .chain(self.team.children().each());
        all.filter(|it| self.graph.seen_by(*it).contains(child))
            .count()
    }

    fn check_poses(&self, name: &str, child: Place, poses: usize) {
        let reachable = self.places().into_iter();
        let is_reachable = reachable
            .map(|it| self.distances(it))
            .any(|it| it.contains_key(&child));
        assert_eq!(
            poses > 0,
            is_reachable,
            "{name}: a pose if and only if reachable"
        );
        let most = self.seen_by_count(child).min(self.leaders.len());
        assert!(poses <= most, "{name}: {poses} poses, {most} can be");
    }

    /// S10.
    fn check_forest(&self, name: &str, forest: &Forest) {
        let mut used = BTreeSet::new();
        for tree in forest.trees() {
            let distances = self.distances(tree.leader());
            let mut reached = Robots::only(tree.leader());
            for edge in tree.edges() {
                assert!(
                    self.graph.seen_by(edge.parent).contains(edge.child),
                    "{name}"
                );
                assert!(used.insert((edge.parent, edge.child)), "{name}: used twice");
                assert!(reached.contains(edge.parent), "{name}: parents come first");
                assert!(!reached.contains(edge.child), "{name}: a child once");
                assert!(
                    self.team.children().contains(edge.child),
                    "{name}: children only"
                );
                reached = reached.with(edge.child);
                let (degree, shortest) = (usize::from(edge.degree), distances[&edge.child]);
                assert!(shortest <= degree && degree <= self.team.children().count());
                assert!(forest.trees().len() > 1 || shortest == degree, "{name}");
            }
        }
        for tree in forest.trees() {
            for parent in self.team.children().with(tree.leader()).each() {
                let is_in = parent == tree.leader() || tree.reaches(parent);
                let seen = self.graph.seen_by(parent).and(self.team.children());
                for child in seen.each().filter(|it| is_in && !tree.reaches(*it)) {
                    assert!(
                        used.contains(&(parent, child)),
                        "{name}: an edge is left over"
                    );
                }
            }
        }
        for child in self.team.children().each() {
            let poses = forest.trees().iter().filter(|it| it.reaches(child)).count();
            self.check_poses(name, child, poses);
        }
    }

    /// Child, leader, predecessor, degree of observation.
    fn triples(&self, forest: &Forest) -> Vec<(u16, u16, u16, usize)> {
        let mut triples: Vec<_> = forest
            .trees()
            .iter()
            .flat_map(|tree| {
                let leader = self.team.id(tree.leader()).0;
                let edges = edges_of(&self.team, tree).into_iter();
                edges.map(move |(parent, child, degree)| {
                    (child, leader, parent, usize::from(degree))
                })
            })
            .collect();
        triples.sort_unstable();
        triples
    }

    fn check_sync(&self, name: &str, run: &Run) {
        let edges: Vec<(u16, u16)> = run.consumed().iter().map(|it| (it.0, it.1)).collect();
        let distinct: BTreeSet<_> = edges.iter().collect();
        assert_eq!(distinct.len(), edges.len(), "{name}: an edge is used twice");
        let sights = |it: Place| self.graph.seen_by(it).and(self.team.children()).count();
        let of_leaders: usize = self.team.leaders().each().map(sights).sum();
        let of_children: usize = self.team.children().each().map(sights).sum();
        let bound = of_leaders + self.leaders.len() * of_children;
        assert!(run.messages.len() <= bound, "{name}: too many messages");
        for (child, leader, predecessor, degree, tick) in &run.got {
            assert_eq!(*tick as usize + 1, *degree, "{name}: one tick a hop");
            assert!(*degree <= self.team.children().count(), "{name}");
            if leader != predecessor {
                assert!(edges.contains(&(*predecessor, *child)), "{name}");
            }
        }
        for child in self.team.children().each() {
            let id = self.team.id(child).0;
            let got: Vec<Got> = run.got.iter().filter(|it| it.0 == id).copied().collect();
            self.check_poses(name, child, got.len());
            if self.is_symmetric {
                self.check_waits(name, child, &got);
            }
        }
    }

    /// S18 with the team's bound, and with the thesis's where there is one leader.
    fn check_waits(&self, name: &str, child: Place, got: &[Got]) {
        let around = around(&self.team, &self.graph, child);
        let Some(wait) = Wait::new(&around, Bound::Team) else {
            assert!(got.is_empty(), "{name}");
            return;
        };
        assert!(got.len() <= wait.most(), "{name}: more poses than expected");
        for bound in [Bound::Team, Bound::Own] {
            let (_, _, _, fused, _) = waited(&around, bound, got);
            let holds = bound == Bound::Team || self.leaders.len() == 1;
            assert!(!holds || fused.len() == got.len(), "{name}: a pose is lost");
        }
    }
}

#[test]
fn twenty_thousand_teams_at_once() {
    let mut chance = Chance(20_170_501);
    let (mut several, mut poses) = (0, 0);
    for number in 0..GRAPHS {
        let name = format!("team {number}");
        let world = World::new(&mut chance);
        let forest = Forest::new(&world.team, &world.graph, &world.places());
        world.check_forest(&name, &forest);
        for order in [Order::Fifo, Order::Sender] {
            let lost = Lost::default();
            let run = Run::new(&world.team, &world.graph, &world.leaders, order, lost);
            world.check_sync(&format!("{name}, {order:?}"), &run);
            if order == Order::Fifo {
                let found = run.got.iter().map(|it| (it.0, it.1, it.2, it.3));
                let found: Vec<_> = found.collect();
                assert_eq!(found, world.triples(&forest), "{name}: FIFO is the trees");
                poses += found.len();
            }
        }
        several += usize::from(world.leaders.len() > 1);
    }
    assert!(several > 12_000 && poses > 100_000, "{several}, {poses}");
}

/// How messages travel.
#[derive(Copy, Clone)]
struct Weather {
    name: &'static str,
    slowest: u64,
    lost: u64,
    twice: u64,
    patience: Patience,
}

const WEATHERS: [Weather; 3] = [
    Weather {
        name: "one tick",
        slowest: 1,
        lost: 0,
        twice: 0,
        patience: Patience {
            ack_timeout: 8,
            close_after: 40,
        },
    },
    Weather {
        name: "one to four ticks",
        slowest: 4,
        lost: 0,
        twice: 0,
        patience: Patience {
            ack_timeout: 10,
            close_after: 200,
        },
    },
    Weather {
        name: "one to seven ticks, lost and twice, time-outs too short",
        slowest: 7,
        lost: 20,
        twice: 15,
        patience: Patience {
            ack_timeout: 5,
            close_after: 200,
        },
    },
];

impl World {
    fn check_network<D: FnMut(usize, u32) -> Vec<u32>>(
        &self,
        weather: &Weather,
        network: &Network<D>,
    ) {
        let mut used: BTreeMap<(Place, Place), BTreeSet<_>> = BTreeMap::new();
        for (_, _, number, result) in &network.received {
            let message = &network.messages[*number];
            let Body::Data(path) = &message.body else {
                continue;
            };
            assert_eq!(path.end(), message.to);
            if *result == Result::Data(Answer::Accepted) {
                let edge = (message.from, message.to);
                used.entry(edge).or_default().insert(message.leader);
            }
        }
        for ((from, to), leaders) in &used {
            if self.team.leaders().contains(*from) {
                continue;
            }
            assert_eq!(
                leaders.len(),
                1,
                "{}: an edge serves two leaders",
                weather.name
            );
            let sights = network.searches[from].sights();
            let sight = sights.iter().find(|it| it.child == *to).unwrap();
            let leader = leaders.first().unwrap();
            let agrees = matches!(sight.used,
                Use::Consumed(of) | Use::TimedOut(of) if of == *leader);
            assert!(
                agrees,
                "{}: {:?}, used by {leader:?}",
                weather.name, sight.used
            );
        }
        let sights = network.searches.values().flat_map(Search::sights);
        for sight in sights {
            let is_pending = matches!(sight.used, Use::Pending(_));
            assert!(!is_pending, "{}: not settled", weather.name);
        }
    }
}

#[test]
fn twenty_thousand_teams_whose_messages_take_time() {
    let mut chance = Chance(4_201);
    let mut travels = Chance(11);
    for number in 0..GRAPHS {
        let world = World::new(&mut chance);
        let weather = &WEATHERS[usize::try_from(number).unwrap() % WEATHERS.len()];
        let deliver = |_, tick| {
            let copies = 1 + u32::from(travels.percent(weather.twice));
            let mut ticks = Vec::new();
            for _ in 0..copies {
                let takes = 1 + u32::try_from(travels.below(weather.slowest)).unwrap();
                if !travels.percent(weather.lost) {
                    ticks.push(tick + takes);
                }
            }
            ticks
        };
        let (team, graph) = (&world.team, &world.graph);
        let mut network = Network::new(team, graph, &world.leaders, weather.patience, deliver);
        network.run();
        world.check_network(weather, &network);
        if weather.slowest > 1 {
            continue;
        }
        for child in team.children().each() {
            let id = team.id(child).0;
            let got = network.got.iter().filter(|it| it.0 == id);
            world.check_poses(weather.name, child, got.count());
        }
        let latest = network.got.iter().map(|it| it.4 as usize).max();
        assert!(latest.is_none_or(|it| it <= team.children().count() + 4));
        if let [leader] = world.leaders[..] {
            let distances = world.distances(world.place(leader));
            for (child, _, _, degree, _) in &network.got {
                assert_eq!(distances[&world.place(*child)], *degree);
            }
        }
    }
}
