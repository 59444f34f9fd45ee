//! What the pictures of `docs/leaders.md` show: the first child in one run of a case, and who sees whom at an event.

use std::path::Path;

use coloc_estimator::assist::team::Team;
use coloc_estimator::assist::tree::{Forest, Graph as Sights};
use coloc_estimator::{Belief, Pose, RobotId};

use super::super::robot::Method;
use super::super::run::{Scene as _, first_child};
use super::super::score::{error, nees};
use super::world::{CASES, CHILDREN, LEADERS, Sensors, World};

/// The recording, and where all chance comes from.
pub struct Run {
    world: World,
    seed: u64,
}

/// The first child by one method.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// As the tables call it.
    pub method: &'static str,
    /// After each step of which somebody knows the truth.
    pub moments: Vec<Moment>,
}

/// After one step.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Moment {
    /// \[s\]
    pub time_s: f64,
    /// Estimate minus truth `[x, y, φ]` \[m, m, rad\].
    pub error: [f64; 3],
    /// 3σ \[m, m, rad\].
    pub three_sigma: [f64; 3],
    /// Normalised squared error: 3 on average, if it is honest.
    pub nees: f64,
}

/// An event. Robots by their numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    /// Where they are \[m\].
    pub places: Vec<(u16, [f64; 2])>,
    /// Who sees whom, of what is of use: no leader is looked at.
    pub seen: Vec<[u16; 2]>,
    /// Each leader's tree, where leaders are equally sure: from whom to whom.
    pub trees: Vec<(u16, Vec<[u16; 2]>)>,
}

impl Run {
    /// Of MR.CLAM 1 in the folder `data`.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub fn read(data: &Path, seed: u64) -> Result<Self, String> {
        World::read(data).map(|world| Self { world, seed })
    }

    /// No longer than so many steps.
    #[must_use]
    pub fn shortened(self, steps: usize) -> Self {
        let world = self.world.shortened(|most| most.min(steps));
        Self { world, ..self }
    }

    /// The first child (robot 2) in a case, 5 to 8, by each method; nothing in any other case.
    #[must_use]
    pub fn tracks(&self, case: usize) -> Vec<Track> {
        let Some(case) = CASES.iter().find(|it| it.number == case) else {
            return Vec::new();
        };
        let sensors = Sensors::new(&self.world, self.seed, 0, case);
        let beliefs = first_child(&sensors, &Method::ALL);
        let track = |(method, beliefs): (Method, Vec<Belief>)| {
            let moment = |(step, belief): (usize, Belief)| {
                let truth = sensors.truth(step, CHILDREN[0])?;
                Some(self.moment(step, &belief, &truth))
            };
            Track {
                method: method.name(),
                moments: (1..).zip(beliefs).filter_map(moment).collect(),
            }
        };
        Method::ALL.into_iter().zip(beliefs).map(track).collect()
    }

    fn moment(&self, step: usize, belief: &Belief, truth: &Pose) -> Moment {
        let error = error(belief, truth);
        Moment {
            time_s: self.world.time_s(step),
            error: error.into(),
            three_sigma: belief.total().variances().map(|it| 3.0 * it.sqrt()),
            nees: nees(belief, &error),
        }
    }

    /// The first event from then on \[s\]; `None` after the last.
    #[must_use]
    pub fn graph(&self, time_s: f64) -> Option<Graph> {
        let sensors = Sensors::new(&self.world, self.seed, 0, &CASES[0]);
        let mut later = (1..=self.world.steps()).filter(|it| self.world.time_s(*it) >= time_s);
        let (step, readings) = later.find_map(|step| Some((step, sensors.event(step)?.1)))?;
        let team = Team::new(&LEADERS, &CHILDREN).ok()?;
        let mut sights = Sights::default();
        for [from, to] in readings.keys() {
            sights.see(team.place(*from)?, team.place(*to)?);
        }
        let ranked: Vec<_> = LEADERS.iter().filter_map(|it| team.place(*it)).collect();
        let forest = Forest::new(&team, &sights, &ranked);
        let tree = |tree: &coloc_estimator::assist::tree::Tree| {
            let edges = tree.edges().iter();
            let edges = edges.map(|it| [it.parent, it.child].map(|place| team.id(place).0));
            (team.id(tree.leader()).0, edges.collect())
        };
        let place = |robot: &RobotId| {
            let pose = sensors.truth(step, *robot)?;
            Some((robot.0, [pose.x, pose.y]))
        };
        Some(Graph {
            places: LEADERS.iter().chain(&CHILDREN).filter_map(place).collect(),
            seen: readings.keys().map(|pair| pair.map(|it| it.0)).collect(),
            trees: forest.trees().iter().map(tree).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::recordings;

    #[test]
    fn a_track_has_every_method_and_a_tree_goes_by_what_is_seen() {
        let Some(data) = recordings(None) else {
            println!("SKIPPED: no recordings; set COLOC_DATA to the folder that holds mrclam1");
            return;
        };
        let run = Run::read(&data, 1).expect("the recording").shortened(500);
        let tracks = run.tracks(5);
        assert_eq!(tracks.len(), 4);
        for track in &tracks {
            assert!(track.moments.len() > 400, "{}", track.method);
            let mean: f64 = track.moments.iter().map(|it| it.nees).sum();
            assert!(mean / 500.0 < 12.0, "{}: {mean}", track.method);
        }
        assert!(run.tracks(4).is_empty());
        let graph = run.graph(2.0).expect("an event");
        assert_eq!((graph.places.len(), graph.trees.len()), (5, 2));
        let mut edges = graph.trees.iter().flat_map(|(_, edges)| edges);
        assert!(edges.all(|edge| graph.seen.contains(edge)));
        assert_eq!(run.graph(1e6), None);
    }
}
