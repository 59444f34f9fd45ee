//! A team on its way, and what is stated of it.

use std::collections::BTreeMap;

use coloc_estimator::assist::datum::Reading;
use coloc_estimator::assist::team::Team;
use coloc_estimator::assist::tree::Graph;
use coloc_estimator::heading::{self, HeadingNoise};
use coloc_estimator::{
    Belief, Covariance2, Fusion, GlobalPose, Propagation, RobotId, fix, propagate,
};
use serde::Deserialize;

use crate::case::{Rows, Tolerance, covariance, pose, rows, sigma};
use crate::delayed::motion;
use crate::distributed::Said;
use crate::replay::{Account, Child};
use crate::support::read_vectors;
use crate::trees::{place, team_of};
use crate::updates;

pub(super) const PAPER: Propagation = Propagation::Paper;

#[derive(Deserialize)]
pub(super) struct File {
    pub(super) meta: Meta,
    pub(super) steps: Vec<Step>,
}

#[derive(Deserialize)]
pub(super) struct Meta {
    pub(super) dt: f64,
    pub(super) robots: Vec<u16>,
    pub(super) leaders: Vec<u16>,
    pub(super) children: Vec<u16>,
    pub(super) x0: Vec<[f64; 3]>,
    pub(super) P0: Rows,
    pub(super) Q_diag: Vec<f64>,
    pub(super) R_rel: Rows,
    pub(super) R_abs: Vec<Noise>,
    pub(super) gates: Gates,
    pub(super) variants: BTreeMap<String, updates::Fusion>,
    pub(super) ack_timeout: Option<u32>,
    pub(super) close_after: Option<u32>,
}

#[derive(Deserialize)]
pub(super) struct Noise {
    pub(super) robot: u16,
    pub(super) kind: String,
    pub(super) variance: f64,
}

#[derive(Deserialize)]
pub(super) struct Gates {
    pub(super) position: f64,
    pub(super) heading: f64,
}

#[derive(Deserialize)]
pub(super) struct Step {
    pub(super) k: u32,
    pub(super) odometry: Vec<[f64; 2]>,
    #[serde(default)]
    pub(super) absolute: Vec<Absolute>,
    #[serde(default)]
    pub(super) relative: Vec<(u16, u16, f64, f64, f64)>,
    pub(super) event: Option<Arrivals>,
    pub(super) expected: Expected,
}

#[derive(Deserialize)]
pub(super) struct Absolute {
    pub(super) robot: u16,
    pub(super) kind: String,
    pub(super) y: Vec<f64>,
}

#[derive(Deserialize)]
pub(super) struct Arrivals {
    pub(super) arrival: Vec<u16>,
    #[serde(default)]
    pub(super) lost: Vec<usize>,
    #[serde(default)]
    pub(super) ack_lost: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Expected {
    #[serde(default)]
    pub(super) absolute: Vec<(u16, String, f64, bool)>,
    pub(super) leaders: Option<Vec<[f64; 3]>>,
    pub(super) leaders_P: Option<Vec<[f64; 6]>>,
    pub(super) event: Option<Happened>,
    #[serde(default)]
    pub(super) fusions: BTreeMap<String, Vec<LateLine>>,
    #[serde(default)]
    pub(super) sent: Vec<Sent>,
    #[serde(default)]
    pub(super) received: Vec<Vec<serde_json::Value>>,
    pub(super) paper: Option<State>,
    pub(super) split: Option<State>,
    pub(super) split_keep: Option<State>,
}

/// Event, number, kind, from, to, leader, path or bit, steps of arrival.
pub(super) type Sent = (u32, usize, String, u16, u16, u16, Said, Vec<u32>);

#[derive(Deserialize)]
pub(super) struct State {
    pub(super) x: Option<Vec<[f64; 3]>>,
    pub(super) P: Option<Vec<[f64; 6]>>,
    pub(super) P_ind: Option<Vec<[f64; 6]>>,
}

#[derive(Deserialize)]
pub(super) struct Happened {
    #[serde(default)]
    pub(super) order: Vec<u16>,
    #[serde(default)]
    pub(super) trees: Vec<Tree>,
    #[serde(default)]
    pub(super) arrival: Vec<u16>,
    #[serde(default)]
    pub(super) messages: Vec<Vec<serde_json::Value>>,
    #[serde(default)]
    pub(super) points: Vec<Points>,
    #[serde(default)]
    pub(super) fusions: BTreeMap<String, Vec<Line>>,
}

#[derive(Deserialize)]
pub(super) struct Tree {
    pub(super) leader: u16,
    pub(super) poses: Vec<Vec<f64>>,
}

/// Child, n̄, greatest delay, liberate point, when it is fused, when it closes.
pub(super) type Points = (u16, usize, u32, Option<u32>, Option<u32>, Option<u32>);

/// Event, and what a [`Line`] has.
pub(super) type LateLine = (usize, u16, u16, f64, bool, Option<f64>);

/// Child, leader, d², whether it was accepted, α.
pub(super) type Line = (u16, u16, f64, bool, Option<f64>);

impl Expected {
    pub(super) fn state(&self, variant: &str) -> Option<&State> {
        match variant {
            "paper" => self.paper.as_ref(),
            "split" => self.split.as_ref(),
            "split_keep" => self.split_keep.as_ref(),
            other => panic!("variant {other}"),
        }
    }
}

impl Meta {
    pub(super) fn variance(&self, robot: u16, kind: &str) -> f64 {
        let mut all = self.R_abs.iter();
        let found = all.find(|it| it.robot == robot && it.kind == kind);
        found.unwrap().variance
    }
}

/// A team on its way.
pub(super) struct World<'a> {
    pub(super) meta: &'a Meta,
    pub(super) team: Team,
    pub(super) leaders: BTreeMap<u16, Belief>,
    /// By variants, then by numbers.
    pub(super) children: BTreeMap<&'a str, BTreeMap<u16, Child>>,
    pub(super) step: u32,
    pub(super) tolerance: Tolerance,
}

/// The poses that a child gets, each with its leader.
pub(super) type Poses = BTreeMap<u16, Vec<(RobotId, GlobalPose)>>;

impl<'a> World<'a> {
    pub(super) fn new(meta: &'a Meta) -> Self {
        let starts = meta.robots.iter().zip(&meta.x0);
        let start =
            starts.map(|(id, x)| (*id, Belief::independent(pose(*x), covariance(&meta.P0))));
        let start: BTreeMap<u16, Belief> = start.collect();
        let of = |ids: &[u16]| ids.iter().map(|id| (*id, start[id])).collect::<Vec<_>>();
        let variants = meta.variants.iter().map(|(name, fusion)| {
            let children = of(&meta.children).into_iter();
            let children = children.map(|(id, it)| (id, Child::new(it, fusion.rule(), meta.dt)));
            (name.as_str(), children.collect())
        });
        Self {
            meta,
            team: team_of(&meta.leaders, &meta.children),
            leaders: of(&meta.leaders).into_iter().collect(),
            children: variants.collect(),
            step: 0,
            tolerance: Tolerance::new(|_, _| 1e-6, (1e-5, 1e-12)),
        }
    }

    /// All drive, and leaders hear of where they are.
    pub(super) fn advance(&mut self, step: &Step) {
        self.step += 1;
        assert_eq!(self.step, step.k);
        for (id, velocity) in self.meta.robots.iter().zip(&step.odometry) {
            let motion = motion(velocity, &self.meta.Q_diag);
            if let Some(belief) = self.leaders.get_mut(id) {
                *belief = propagate(belief, &motion, self.meta.dt, PAPER);
            }
            for children in self.children.values_mut() {
                if let Some(child) = children.get_mut(id) {
                    child.drive(motion);
                }
            }
        }
        assert_eq!(step.absolute.len(), step.expected.absolute.len());
        for (absolute, stated) in step.absolute.iter().zip(&step.expected.absolute) {
            self.correct(absolute, stated);
        }
        if !step.relative.is_empty() {
            let all = self.children.values_mut().flat_map(BTreeMap::values_mut);
            all.for_each(Child::meet);
        }
    }

    pub(super) fn correct(&mut self, it: &Absolute, stated: &(u16, String, f64, bool)) {
        let variance = self.meta.variance(it.robot, &it.kind);
        let belief = self.leaders.get_mut(&it.robot).unwrap();
        let update = match it.kind.as_str() {
            "position" => {
                let noise = Covariance2::diagonal([variance; 2]).unwrap();
                let gate = self.meta.gates.position;
                fix::update(belief, [it.y[0], it.y[1]], &noise, gate)
            }
            "heading" => {
                let noise = HeadingNoise::white(variance);
                heading::update(belief, it.y[0], &noise, self.meta.gates.heading)
            }
            other => panic!("{other}"),
        };
        *belief = update.belief;
        let found = (it.robot, it.kind.as_str(), update.accepted);
        assert_eq!(found, (stated.0, stated.1.as_str(), stated.3));
        let name = format!("step {}: d² of {}", self.step, it.robot);
        self.tolerance
            .within(&name, update.d2 - stated.2, 1e-4 * stated.2);
    }

    pub(super) fn readings(&self, step: &Step) -> (Graph, BTreeMap<(u16, u16), Reading>) {
        let mut graph = Graph::default();
        let mut readings = BTreeMap::new();
        for (observer, observed, x, y, phi) in &step.relative {
            graph.see(place(&self.team, *observer), place(&self.team, *observed));
            let reading = Reading {
                relative: pose([*x, *y, *phi]),
                covariance: covariance(&self.meta.R_rel),
            };
            readings.insert((*observer, *observed), reading);
        }
        (graph, readings)
    }

    /// Children fuse poses of the event at step `at`: what is heard of it, by variants.
    pub(super) fn fuse(
        &mut self,
        at: usize,
        poses: &Poses,
    ) -> BTreeMap<String, Vec<(u16, Account)>> {
        let mut accounts = BTreeMap::new();
        for (name, children) in &mut self.children {
            let account: &mut Vec<_> = accounts.entry((*name).to_owned()).or_default();
            for (id, poses) in poses.iter().filter(|it| !it.1.is_empty()) {
                let fused = children.get_mut(id).unwrap().fuse(at, poses);
                account.extend(fused.into_iter().map(|it| (*id, it)));
            }
        }
        accounts
    }

    pub(super) fn check_fusion(&mut self, found: (u16, RobotId, &Fusion), stated: &Line) {
        let (child, RobotId(leader), fusion) = found;
        let (stated_child, stated_leader, d2, accepted, alpha) = *stated;
        let name = format!("step {}: child {child}, leader {leader}", self.step);
        assert_eq!((child, leader), (stated_child, stated_leader), "{name}");
        assert_eq!(fusion.accepted, accepted, "{name}");
        if let Some(alpha) = alpha {
            self.tolerance
                .within(&format!("{name}: α"), fusion.alpha - alpha, 1e-4);
        }
        if alpha.is_none_or(|it| (1e-3..=1.0 - 1e-3).contains(&it)) {
            self.tolerance
                .within(&format!("{name}: d²"), fusion.d2 - d2, 1e-4 * d2);
        }
    }

    /// Fused at once.
    pub(super) fn fuse_now(&mut self, poses: &Poses, stated: &BTreeMap<String, Vec<Line>>) {
        let accounts = self.fuse(self.step as usize, poses);
        for (variant, account) in accounts {
            let stated = &stated[&variant];
            assert_eq!(account.len(), stated.len(), "step {}", self.step);
            for ((child, (_, leader, fusion)), line) in account.iter().zip(stated) {
                self.check_fusion((*child, *leader, fusion), line);
            }
        }
    }

    pub(super) fn compare(&mut self, expected: &Expected) -> usize {
        let leaders: Vec<Belief> = self.leaders.values().copied().collect();
        let stated = State {
            x: expected.leaders.clone(),
            P: expected.leaders_P.clone(),
            P_ind: None,
        };
        self.compare_all("leaders", &leaders, &stated);
        let variants: Vec<&str> = self.children.keys().copied().collect();
        let mut compared = usize::from(stated.P.is_some());
        for variant in variants {
            let children = self.children[variant].values();
            let beliefs: Vec<Belief> = children.map(|it| it.belief).collect();
            if let Some(stated) = expected.state(variant) {
                self.compare_all(variant, &beliefs, stated);
                compared += usize::from(stated.P.is_some());
            }
        }
        compared
    }

    pub(super) fn compare_all(
        &mut self,
        who: &str,
        beliefs: &[Belief],
        State { x, P, P_ind }: &State,
    ) {
        for (index, belief) in beliefs.iter().enumerate() {
            let name = format!("step {}, {who} {index}", self.step);
            if let Some(x) = x {
                self.tolerance.pose(&name, &belief.pose, x[index], [0.0; 3]);
            }
            let Some(P) = P else { continue };
            let total = rows(P[index]);
            let of = (sigma(&total), sigma(&total));
            let found = belief.total().matrix();
            self.tolerance.matrix(&name, &found, &total, of);
            if let Some(P_ind) = P_ind {
                let found = belief.parts.independent.matrix();
                let name = format!("{name}: P_ind");
                self.tolerance
                    .matrix(&name, &found, &rows(P_ind[index]), of);
            }
        }
    }

    /// y*, R* and `R_ind`, as many of them as are stated.
    pub(super) fn compare_datum(&mut self, said: &GlobalPose, stated: &[f64]) {
        let name = format!("step {}: datum", self.step);
        let six = |at: usize| rows(stated[at..at + 6].try_into().unwrap());
        if stated.len() < 9 {
            return;
        }
        self.tolerance
            .pose(&name, &said.pose, stated[..3].try_into().unwrap(), [0.0; 3]);
        let of = (sigma(&six(3)), sigma(&six(3)));
        self.tolerance
            .matrix(&name, &said.total().matrix(), &six(3), of);
        if stated.len() == 15 {
            let independent = said.parts.independent.matrix();
            self.tolerance.matrix(&name, &independent, &six(9), of);
        }
    }
}

/// The numbers of a line of which the first `skipped` are something else.
pub(super) fn numbers(line: &[serde_json::Value], skipped: usize) -> Vec<f64> {
    let rest = line.iter().skip(skipped);
    rest.map(|it| it.as_f64().unwrap()).collect()
}

pub(super) fn run(file: &str, mut event: impl FnMut(&mut World, &Step)) {
    let Some(File { meta, steps }) = read_vectors::<File>(file) else {
        return;
    };
    let mut world = World::new(&meta);
    let mut compared = 0;
    for step in &steps {
        world.advance(step);
        event(&mut world, step);
        compared += world.compare(&step.expected);
    }
    assert!(steps.len() == 1000 && compared > 60, "{compared}");
    world.tolerance.report(file);
}
