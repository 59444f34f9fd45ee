//! One event, as all leaders compose it: which leader tells which child what.

use std::collections::BTreeMap;

use coloc_estimator::assist::datum::{Reading, first, joined};
use coloc_estimator::assist::team::{Place, Team};
use coloc_estimator::assist::tree::{Forest, Graph, Tree, by_priority};
use coloc_estimator::{Belief, GlobalPose, RobotId};

use super::robot::PAPER;

/// What robots see, by observer and observed.
pub(crate) type Readings = BTreeMap<[RobotId; 2], Reading>;

/// What a leader says of a child.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Told {
    pub(crate) pose: GlobalPose,
    /// The readings that it is made of, from the leader on.
    pub(crate) by: Vec<[RobotId; 2]>,
}

/// All of that, by child and leader.
pub(crate) type Poses = BTreeMap<[RobotId; 2], Told>;

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
    let leader = team.id(tree.leader());
    let Some(belief) = leaders.get(&leader) else {
        return Poses::new();
    };
    let mut seen: BTreeMap<RobotId, (Reading, Vec<[RobotId; 2]>)> = BTreeMap::new();
    for edge in tree.edges() {
        let pair = [team.id(edge.parent), team.id(edge.child)];
        let Some(last) = readings.get(&pair) else {
            continue;
        };
        let (reading, mut by) = seen.get(&pair[0]).map_or_else(
            || (*last, Vec::new()),
            |(near, by)| (joined(near, last, PAPER), by.clone()),
        );
        by.push(pair);
        seen.insert(pair[1], (reading, by));
    }
    let all = seen.into_iter().map(|(child, (reading, by))| {
        let pose = first(belief, &reading, PAPER);
        ([child, leader], Told { pose, by })
    });
    all.collect()
}
