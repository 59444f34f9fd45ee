//! One run of a case, with all methods beside one another: leader, noise and trees are the same.

use std::collections::BTreeMap;

use coloc_estimator::assist::cross;
use coloc_estimator::assist::datum::{Reading, first, joined};
use coloc_estimator::assist::fusion::Rule;
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::assist::team::{Place, Team};
use coloc_estimator::assist::transition::{Bond, Past, Transitions, driven, fixed, turned};
use coloc_estimator::assist::tree::{Forest, Graph, Tree};
use coloc_estimator::heading::{self, HeadingNoise};
use coloc_estimator::{
    Belief, Covariance3, FusionSettings, GlobalPose, Motion, Propagation, RobotId, fix, propagate,
};

use super::Form;
use super::score::Score;
use super::world::{ABSOLUTE_EVERY, Case, ROBOTS, START, STEP_S, Sensors, World};

/// χ² with one, two and three degrees of freedom, 99.9 %.
const GATES: [f64; 3] = [
    10.827_566_170_662_733,
    13.815_510_557_964_274,
    16.266_236_196_238_13,
];

const PAPER: Propagation = Propagation::Paper;

/// What a child does with a pose.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    /// Takes it as news.
    Kalman,
    /// Takes the leader's error as dependent.
    Split,
    /// Tracks its correlation with the leader's error.
    Cross,
}

impl Method {
    pub(crate) const ALL: [Self; 3] = [Self::Kalman, Self::Split, Self::Cross];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Kalman => "leader-kf",
            Self::Split => "leader-split",
            Self::Cross => "leader-cross",
        }
    }
}

/// A child by one method.
struct Child {
    method: Method,
    belief: Belief,
    bond: Bond,
}

/// What a leader says at an event.
struct Word {
    leader: cross::Leader,
    past: Past,
    slot: Slot,
}

impl Child {
    fn drive(&mut self, motion: &Motion) {
        let [v, _, _] = motion.velocity();
        self.bond
            .go_on(&driven(self.belief.pose.phi, [STEP_S * v, 0.0]));
        self.belief = propagate(&self.belief, motion, STEP_S, PAPER);
    }

    fn hear(&mut self, said: &GlobalPose, word: &Word) {
        let gate = GATES[2];
        let rule = match self.method {
            Method::Kalman => Rule::Kalman { gate },
            Method::Split => split(gate),
            Method::Cross => return self.cross(said, word),
        };
        self.belief = rule.fuse_all(&self.belief, &[(RobotId(0), *said)], |_, _| {});
    }

    fn cross(&mut self, said: &GlobalPose, word: &Word) {
        let Some(before) = self.bond.at_event(word.slot, &word.past).copied() else {
            let only = [(RobotId(0), *said)];
            self.belief = split(GATES[2]).fuse_all(&self.belief, &only, |_, _| {});
            return;
        };
        let crossed = cross::update(&self.belief, &before, &word.leader, said, GATES[2]);
        self.bond.set(crossed.with_this(&before));
        self.belief = crossed.update.belief;
    }
}

fn split(gate: f64) -> Rule {
    Rule::Split {
        settings: FusionSettings {
            gate,
            ..FusionSettings::paper()
        },
        reset: true,
    }
}

struct Leader {
    belief: Belief,
    transitions: Transitions,
}

impl Leader {
    fn drive(&mut self, motion: &Motion) {
        let [v, _, _] = motion.velocity();
        let by = driven(self.belief.pose.phi, [STEP_S * v, 0.0]);
        self.transitions.go_on(&by);
        self.belief = propagate(&self.belief, motion, STEP_S, PAPER);
    }

    fn correct(&mut self, sensors: &Sensors, step: usize, world: &World) {
        let (at, noise, heading, variance) = sensors.absolute(step, &world.poses[0]);
        let update = fix::update(&self.belief, at, &noise, GATES[1]);
        if update.accepted {
            self.transitions.go_on(&fixed(&self.belief, &noise));
        }
        self.belief = update.belief;
        let white = HeadingNoise::white(variance);
        let update = heading::update(&self.belief, heading, &white, GATES[0]);
        if update.accepted {
            self.transitions.go_on(&turned(&self.belief, variance));
        }
        self.belief = update.belief;
    }
}

/// Robots have the numbers of their places.
fn team() -> Team {
    let children = [1, 2, 3, 4].map(RobotId);
    Team::new(&[RobotId(0)], &children).expect("a team")
}

fn readings(sensors: &Sensors, step: usize, world: &World) -> BTreeMap<[usize; 2], Reading> {
    let pairs = (0..ROBOTS).flat_map(|a| (1..ROBOTS).map(move |b| [a, b]));
    let pairs = pairs.filter(|[a, b]| a != b);
    pairs
        .filter_map(|pair| Some((pair, sensors.sighting(step, world, pair)?)))
        .collect()
}

/// Who is seen by whom, as the leader composes it: each child's pose.
fn poses(
    team: &Team,
    leader: &Belief,
    readings: &BTreeMap<[usize; 2], Reading>,
) -> [Option<GlobalPose>; ROBOTS] {
    let places: Vec<Place> = (0..5).filter_map(|it| team.place(RobotId(it))).collect();
    let number = |place| usize::from(team.id(place).0);
    let mut graph = Graph::default();
    for [observer, observed] in readings.keys() {
        graph.see(places[*observer], places[*observed]);
    }
    let forest = Forest::new(team, &graph, &places[..1]);
    let mut seen: [Option<Reading>; ROBOTS] = [None; ROBOTS];
    for edge in forest.trees().iter().flat_map(Tree::edges) {
        let (parent, child) = (number(edge.parent), number(edge.child));
        let last = readings[&[parent, child]];
        seen[child] = Some(seen[parent].map_or(last, |near| joined(&near, &last, PAPER)));
    }
    seen.map(|it| it.map(|reading| first(leader, &reading, PAPER)))
}

/// How far off everybody was in one run.
pub(crate) fn score(case: &Case, form: &Form, run: u16) -> Score {
    let mut world = World::new();
    let sensors = Sensors::new(form.seed, run, case);
    let covariance = Covariance3::diagonal(START).expect("variances");
    let begins = |robot: usize, world: &World| {
        Belief::independent(sensors.start(robot, &world.poses[robot]), covariance)
    };
    let mut leader = Leader {
        belief: begins(0, &world),
        transitions: Transitions::default(),
    };
    let mut children = Method::ALL.map(|method| {
        [1, 2, 3, 4].map(|robot| Child {
            method,
            belief: begins(robot, &world),
            bond: Bond::default(),
        })
    });
    let (team, mut score) = (team(), Score::of_run(form.steps));
    for step in 1..=form.steps {
        world.drive();
        leader.drive(&sensors.motion(step, 0));
        for robot in 1..ROBOTS {
            let motion = sensors.motion(step, robot);
            for by_method in &mut children {
                by_method[robot - 1].drive(&motion);
            }
        }
        if step % ABSOLUTE_EVERY == 0 {
            leader.correct(&sensors, step, &world);
        }
        if step % case.every == 0 {
            let readings = readings(&sensors, step, &world);
            let word = Word {
                leader: cross::Leader {
                    pose: leader.belief.pose,
                    covariance: leader.belief.total(),
                },
                past: leader.transitions.at_event(),
                slot: Slot(i64::try_from(step / case.every).expect("few steps")),
            };
            let poses = poses(&team, &leader.belief, &readings);
            for child in children.iter_mut().flatten().zip(poses[1..].iter().cycle()) {
                if let (child, Some(said)) = child {
                    child.hear(said, &word);
                }
            }
        }
        for (method, by_method) in children.iter().enumerate() {
            for (number, child) in by_method.iter().enumerate() {
                score.add(
                    (method, number, step),
                    &child.belief,
                    &world.poses[number + 1],
                );
            }
        }
    }
    score
}
