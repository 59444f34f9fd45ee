//! One run, with all methods beside one another: leaders, noise and trees are the same.

use std::collections::BTreeMap;

use coloc_estimator::assist::bond::News;
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::assist::team::Team;
use coloc_estimator::{Belief, Covariance3, Motion, Parts, Pose, RobotId};

use super::event::{Poses, Readings, poses};
use super::robot::{Absolute, Child, Leader, Method};
use super::score::Score;

/// Variances of the first errors.
pub(crate) const START: [f64; 3] = [1e-4, 1e-4, 1e-6];

/// A team and what it measures in one run.
pub(crate) trait Scene {
    /// \[s\]
    fn dt_s(&self) -> f64;
    /// How long it is.
    fn steps(&self) -> usize;
    fn leaders(&self) -> &[RobotId];
    fn children(&self) -> &[RobotId];
    /// Where somebody believes to be at first.
    fn start(&self, robot: RobotId) -> Pose;
    /// Where it is; nobody may know.
    fn truth(&self, step: usize, robot: RobotId) -> Option<Pose>;
    /// What the wheels say of the step that ends here.
    fn motion(&self, step: usize, robot: RobotId) -> Motion;
    /// What a leader's receiver and compass say.
    fn absolute(&self, step: usize, leader: RobotId) -> Option<Absolute>;
    /// The number of the event that is at this step, if there is one, and what everybody sees.
    fn event(&self, step: usize) -> Option<(Slot, Readings)>;
    /// Whether what robots see is news, and nothing of it is in what children believe already.
    fn is_news(&self) -> bool {
        true
    }
}

struct Robots<'a> {
    team: Team,
    methods: &'a [Method],
    leaders: BTreeMap<RobotId, Leader>,
    /// By method.
    children: Vec<BTreeMap<RobotId, Child>>,
}

impl<'a> Robots<'a> {
    fn new(scene: &impl Scene, methods: &'a [Method]) -> Option<Self> {
        let covariance = Covariance3::diagonal(START).ok()?;
        let begins = |it: RobotId| Belief::independent(scene.start(it), covariance);
        let (leaders, children) = (scene.leaders(), scene.children());
        let by_method = |method: &Method| {
            let children = children.iter();
            let child = |it: &RobotId| (*it, Child::new(*method, begins(*it)));
            children.map(child).collect()
        };
        Some(Self {
            team: Team::new(leaders, children).ok()?,
            methods,
            leaders: leaders
                .iter()
                .map(|it| (*it, Leader::new(begins(*it))))
                .collect(),
            children: methods.iter().map(by_method).collect(),
        })
    }

    fn step(&mut self, scene: &impl Scene, step: usize) {
        let dt_s = scene.dt_s();
        for (id, leader) in &mut self.leaders {
            leader.drive(&scene.motion(step, *id), dt_s);
            if let Some(absolute) = scene.absolute(step, *id) {
                leader.correct(&absolute);
            }
        }
        for id in scene.children() {
            let motion = scene.motion(step, *id);
            for by_method in &mut self.children {
                if let Some(child) = by_method.get_mut(id) {
                    child.drive(&motion, dt_s);
                }
            }
        }
    }

    fn event(&mut self, (slot, readings): (Slot, &Readings), is_news: bool, score: &mut Score) {
        let leaders = self.leaders.iter();
        let beliefs = leaders.map(|(id, it)| (*id, it.belief)).collect();
        let mut poses = poses(&self.team, &beliefs, readings);
        if !is_news {
            for told in poses.values_mut() {
                told.pose.parts = Parts::dependent(told.pose.parts.total());
            }
        }
        let leaders = self.leaders.values_mut();
        let news: Vec<News> = leaders.map(|it| it.at_event(slot)).collect();
        for (method, by_method) in self.methods.iter().zip(&mut self.children) {
            for (number, (id, child)) in by_method.iter_mut().enumerate() {
                if !is_news {
                    child.belief.make_dependent();
                }
                let leaders = self.leaders.keys().enumerate();
                for (place, leader) in leaders {
                    let said = poses.get(&[*id, *leader]).map(|it| &it.pose);
                    if let Some(heard) = child.hear(place, &news[place], said) {
                        score.innovation(*method, number, place, heard.d2);
                    }
                }
                if is_told(&poses, *id) {
                    child.end_event();
                }
            }
        }
    }

    fn account(&self, scene: &impl Scene, step: usize, score: &mut Score) {
        for (method, by_method) in self.methods.iter().zip(&self.children) {
            for (number, (id, child)) in by_method.iter().enumerate() {
                if let Some(truth) = scene.truth(step, *id) {
                    score.add(*method, number, step, (&child.belief, &truth));
                }
            }
        }
        for (number, (id, leader)) in self.leaders.iter().enumerate() {
            if let Some(truth) = scene.truth(step, *id) {
                score.leader(number, (&leader.belief, &truth));
            }
        }
    }
}

fn is_told(poses: &Poses, child: RobotId) -> bool {
    poses.keys().any(|[it, _]| *it == child)
}

/// How far off everybody was.
pub(crate) fn score(scene: &impl Scene, methods: &[Method]) -> Score {
    play(scene, methods, |robots, step, score| {
        robots.account(scene, step, score);
    })
}

/// What the first child believes after each step, by method.
pub(crate) fn first_child(scene: &impl Scene, methods: &[Method]) -> Vec<Vec<Belief>> {
    let mut beliefs = vec![Vec::new(); methods.len()];
    play(scene, methods, |robots, _, _| {
        for (beliefs, by_method) in beliefs.iter_mut().zip(&robots.children) {
            beliefs.extend(by_method.values().next().map(|child| child.belief));
        }
    });
    beliefs
}

/// All steps; `look` is called after each.
fn play(
    scene: &impl Scene,
    methods: &[Method],
    mut look: impl FnMut(&Robots<'_>, usize, &mut Score),
) -> Score {
    let counts = [scene.children().len(), scene.leaders().len()];
    let mut score = Score::of_run(scene.steps(), counts);
    let Some(mut robots) = Robots::new(scene, methods) else {
        return score;
    };
    for step in 1..=scene.steps() {
        robots.step(scene, step);
        if let Some((slot, readings)) = scene.event(step) {
            robots.event((slot, &readings), scene.is_news(), &mut score);
        }
        look(&robots, step, &mut score);
    }
    score
}
