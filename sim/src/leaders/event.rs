//! One event, as all leaders compose it: which leader tells which child what.

use std::collections::BTreeMap;

use coloc_estimator::assist::datum::{Reading, first, joined};
use coloc_estimator::assist::team::{Place, Team};
use coloc_estimator::assist::tree::{Forest, Graph, Tree, by_priority};
use coloc_estimator::{Belief, GlobalPose, RobotId};

use super::robot::PAPER;

/// What robots see, by observer and observed.
pub(crate) type Readings = BTreeMap<[RobotId; 2], Reading>;

/// Poses, by child and leader.
pub(crate) type Poses = BTreeMap<[RobotId; 2], GlobalPose>;

/// What the leaders of `team` with these beliefs tell children.
pub(crate) fn poses(
    team: &Team,
    leaders: &BTreeMap<RobotId, Belief>,
    readings: &Readings,
) -> Poses {
    let mut graph = Graph::default();
    for [observer, observed] in readings.keys() {
        if let (Some(from), Some(to)) = (team.place(*observer), team.place(*observed)) {
            graph.see(from, to);
        }
    }
    let trace = |belief: &Belief| belief.total().variances().iter().sum();
    let ranked = leaders.iter();
    let ranked = ranked.filter_map(|(id, belief)| Some((trace(belief), team.place(*id)?)));
    let mut ranked: Vec<(f64, Place)> = ranked.collect();
    by_priority(&mut ranked);
    let places: Vec<Place> = ranked.into_iter().map(|it| it.1).collect();
    let forest = Forest::new(team, &graph, &places);
    let trees = forest.trees().iter();
    trees
        .flat_map(|tree| told(team, tree, leaders, readings))
        .collect()
}

/// By one leader: chains of readings from it on, then where it is.
fn told(
    team: &Team,
    tree: &Tree,
    leaders: &BTreeMap<RobotId, Belief>,
    readings: &Readings,
) -> Poses {
    let mut seen: BTreeMap<RobotId, Reading> = BTreeMap::new();
    for edge in tree.edges() {
        let (parent, child) = (team.id(edge.parent), team.id(edge.child));
        let Some(last) = readings.get(&[parent, child]) else {
            continue;
        };
        let near = seen.get(&parent);
        seen.insert(child, near.map_or(*last, |near| joined(near, last, PAPER)));
    }
    let leader = team.id(tree.leader());
    let belief = leaders.get(&leader);
    let poses = belief.into_iter().flat_map(|belief| {
        let seen = seen.iter();
        seen.map(|(child, it)| ([*child, leader], first(belief, it, PAPER)))
    });
    poses.collect()
}
