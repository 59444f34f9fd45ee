//! The search of leaders that know all readings.

use coloc_estimator::RobotId;
use coloc_estimator::assist::team::{Place, Team};
use coloc_estimator::assist::tree::{Forest, Graph, Tree, by_priority};
use serde::Deserialize;

use crate::support::read_vectors;

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    id: String,
    tag: String,
    input: Input,
    expected: Expected,
}

#[derive(Deserialize)]
struct Input {
    children: Vec<u16>,
    leaders: Vec<Leader>,
    sees: Vec<[u16; 2]>,
}

#[derive(Deserialize)]
struct Leader {
    id: u16,
    trace: f64,
}

#[derive(Deserialize)]
struct Expected {
    order: Vec<u16>,
    trees: Vec<Stated>,
    single_leader: Single,
    poses: Vec<(u16, usize)>,
}

#[derive(Deserialize)]
struct Stated {
    leader: u16,
    edges: Vec<(u16, u16, u8)>,
}

#[derive(Deserialize)]
struct Single {
    #[serde(flatten)]
    tree: Stated,
    unreachable: Vec<u16>,
}

pub(crate) fn team_of(leaders: &[u16], children: &[u16]) -> Team {
    let ids = |list: &[u16]| list.iter().map(|id| RobotId(*id)).collect::<Vec<_>>();
    Team::new(&ids(leaders), &ids(children)).unwrap()
}

pub(crate) fn graph_of(team: &Team, sees: &[[u16; 2]]) -> Graph {
    let mut graph = Graph::default();
    for [observer, observed] in sees {
        graph.see(place(team, *observer), place(team, *observed));
    }
    graph
}

pub(crate) fn place(team: &Team, id: u16) -> Place {
    team.place(RobotId(id)).unwrap()
}

pub(crate) fn edges_of(team: &Team, tree: &Tree) -> Vec<(u16, u16, u8)> {
    let number = |place| team.id(place).0;
    let edges = tree.edges().iter();
    edges
        .map(|it| (number(it.parent), number(it.child), it.degree))
        .collect()
}

impl Case {
    fn check(&self) {
        let name = format!("{} ({})", self.id, self.tag);
        let ids: Vec<u16> = self.input.leaders.iter().map(|it| it.id).collect();
        let team = team_of(&ids, &self.input.children);
        let graph = graph_of(&team, &self.input.sees);
        let ranked = self.input.leaders.iter();
        let mut ranked: Vec<_> = ranked.map(|it| (it.trace, place(&team, it.id))).collect();
        by_priority(&mut ranked);
        let order: Vec<Place> = ranked.iter().map(|it| it.1).collect();
        let numbers: Vec<u16> = order.iter().map(|it| team.id(*it).0).collect();
        assert_eq!(numbers, self.expected.order, "{name}");

        let forest = Forest::new(&team, &graph, &order);
        assert_eq!(forest.trees().len(), self.expected.trees.len());
        for (tree, stated) in forest.trees().iter().zip(&self.expected.trees) {
            assert_eq!(team.id(tree.leader()).0, stated.leader, "{name}");
            assert_eq!(edges_of(&team, tree), stated.edges, "{name}");
        }
        let single = &self.expected.single_leader;
        let first = place(&team, single.tree.leader);
        let alone = Forest::new(&team, &graph, &[first]).trees()[0];
        assert_eq!(edges_of(&team, &alone), single.tree.edges, "{name}");
        let children = team.children().each();
        let beyond = children.filter(|it| !alone.reaches(*it));
        let beyond: Vec<u16> = beyond.map(|it| team.id(it).0).collect();
        assert_eq!(beyond, single.unreachable, "{name}");
        for (child, poses) in &self.expected.poses {
            let child = place(&team, *child);
            let found = forest.trees().iter().filter(|it| it.reaches(child));
            assert_eq!(found.count(), *poses, "{name}");
        }
    }
}

#[test]
fn trees() {
    let Some(file) = read_vectors::<File>("leader/trees.json") else {
        return;
    };
    assert!(file.cases.len() > 40, "{}", file.cases.len());
    file.cases.iter().for_each(Case::check);
}
