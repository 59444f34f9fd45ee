//! What the demo's robots live in, and where everybody is at any time.

use coloc_daemon::config::Motion;
use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use coloc_sim::random::{Noise, Purpose};
use coloc_sim::sensors::{Fix, Sighting};
use coloc_sim::{Scenario, Sensors, StepInputs, World};

use super::DemoError;
use super::lead::{COMPASS_SIGMA_RAD, Lead};
use super::robot_file::name;
use super::scene::{Camera, Eyes, Glance, Help, Part, Scene};
use super::table::Shown;
use super::tale::Tale;
use crate::args::DemoArgs;

/// Of what a receiver that jumped says the picture shows a part \[s\].
const LIES_PERIOD_S: f64 = 0.4;

/// Nobody drives so far in a step: there is no way between the two places.
const CARRIED_M: f64 = 1.0;

/// A fix, as a receiver gives it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Received {
    pub(crate) robot: usize,
    /// Which one of the robot's.
    pub(crate) receiver: u16,
    pub(crate) position: [f64; 2],
    /// It has jumped.
    pub(crate) is_lie: bool,
}

/// The truth, and the sensors that look at it.
pub(crate) struct Stage {
    scene: Scene,
    seed: u64,
    /// From when to when nobody reaches anybody \[s\].
    cut_s: Option<[f64; 2]>,
}

impl Stage {
    /// The scene that `args` ask for.
    pub(crate) fn new(args: &DemoArgs) -> Result<Self, DemoError> {
        let stage = Self {
            scene: Scene::new(args)?,
            seed: args.seed,
            cut_s: args.partition,
        };
        stage.check(args.length_s())?;
        Ok(stage)
    }

    pub(super) fn world(&self) -> &(dyn World + Send + 'static) {
        self.scene.world.as_ref()
    }

    fn check(&self, seconds: f64) -> Result<(), DemoError> {
        let refuse = |reason| Err(DemoError::World(reason));
        if self.robots() > self.world().robots() {
            return refuse(format!(
                "{} robots were recorded: use --robots 1 to {0}",
                self.world().robots()
            ));
        }
        if seconds > self.length_s() {
            return refuse(format!(
                "the recording ends after {} s: use --seconds up to that",
                self.length_s()
            ));
        }
        let lost = (0..self.robots()).find(|&robot| self.world().initial(robot).is_none());
        lost.map_or(Ok(()), |robot| {
            refuse(format!(
                "the truth of robot {} is nowhere in the recording",
                robot + 1
            ))
        })
    }

    #[allow(clippy::cast_precision_loss)] // Steps of a run.
    fn length_s(&self) -> f64 {
        self.world().steps().saturating_sub(1) as f64 * self.world().dt_s()
    }

    /// Robots of the team, numbered from 0 here.
    pub(crate) fn robots(&self) -> usize {
        self.scene.parts.len()
    }

    /// As a person would say it.
    pub(crate) fn description(&self) -> &str {
        &self.scene.description
    }

    /// Length of a step \[ns\].
    #[allow(clippy::cast_possible_truncation)] // A fraction of a second.
    pub(crate) fn step_ns(&self) -> i64 {
        (self.world().dt_s() * 1e9).round() as i64
    }

    /// Length of a step \[s\].
    pub(crate) fn step_s(&self) -> f64 {
        self.world().dt_s()
    }

    /// What the sensors are like.
    pub(crate) fn scenario(&self) -> &Scenario {
        &self.scene.sensors
    }

    /// By what robots see one another.
    pub(crate) fn eyes(&self) -> &Eyes {
        &self.scene.eyes
    }

    /// What cameras see at that step.
    pub(crate) fn glances(&self, camera: &Camera, step: usize) -> Vec<Glance> {
        let all = 0..self.robots();
        let truth = |robot| Some((robot, self.world().truth(step, robot)?));
        let there: Vec<_> = all.filter_map(truth).collect();
        let pairs = there.iter().flat_map(|a| there.iter().map(move |b| (a, b)));
        pairs
            .filter_map(|((a, from), (b, seen))| camera.glance(step, (*a, from), (*b, seen)))
            .collect()
    }

    /// Whether nobody reaches anybody then.
    pub(crate) fn is_cut(&self, time_s: f64) -> bool {
        self.cut_s
            .is_some_and(|[from_s, until_s]| (from_s..=until_s).contains(&time_s))
    }

    /// What the daemons believe of the wheels.
    pub(crate) fn motion(&self) -> Motion {
        self.scene.wheels.motion()
    }

    /// What everybody has to go by, and what is expected of them.
    pub(crate) fn parts(&self) -> &[Part] {
        &self.scene.parts
    }

    fn is_told(&self, robot: usize) -> bool {
        let part = self.parts().get(robot);
        part.is_some_and(|part| part.help != Help::Nobody)
    }

    /// Whether the observer is given what it sees, to tell the robot that is seen.
    pub(crate) fn is_told_of(&self, sighting: &Sighting) -> bool {
        sighting.observer < self.robots() && self.is_told(sighting.observed)
    }

    /// Who leads, if anybody does.
    pub(crate) fn lead(&self) -> Option<&Lead> {
        self.scene.lead.as_ref()
    }

    /// Whether the robot does.
    pub(crate) fn leads(&self, robot: usize) -> bool {
        self.lead().is_some_and(|it| it.leaders().contains(&robot))
    }

    /// Whether the observer looks at whom it could see.
    pub(crate) fn is_looked_at(&self, sighting: &Sighting) -> bool {
        let (observer, observed) = (sighting.observer, sighting.observed);
        self.lead()
            .is_none_or(|lead| lead.looks_at(observer, observed))
    }

    /// Whether the robot's daemon is dead at that step.
    #[allow(clippy::cast_precision_loss)] // Steps of a run.
    pub(crate) fn is_gone(&self, robot: usize, step: usize) -> bool {
        let time_s = step as f64 * self.step_s();
        let gone = self.lead().filter(|_| robot == 0);
        gone.is_some_and(|lead| lead.gone_s.contains(&time_s))
    }

    /// What a leader's compass says, as often as its receiver says something \[rad\].
    pub(crate) fn heading(&self, fix: &Received, step: usize) -> Option<f64> {
        self.lead()?;
        let truth = self.world().truth(step, fix.robot)?;
        let noise = Noise::new(self.seed, 0);
        let mut draws = noise.draws(Purpose::Compass, step, fix.robot, 0);
        Some(wrap(truth.phi + COMPASS_SIGMA_RAD * draws.normal()))
    }

    /// What it is about, in a line.
    pub(crate) fn story(&self) -> String {
        let tales = self.tales();
        if tales.is_empty() {
            self.story_of_help()
        } else {
            format!("{}.", tales.join("; "))
        }
    }

    /// The same for a terminal, a line for each robot to which something happens.
    pub(crate) fn story_in_lines(&self) -> String {
        let tales = self.tales();
        if tales.is_empty() {
            self.story_of_help()
        } else {
            tales.join("\n")
        }
    }

    fn tales(&self) -> Vec<String> {
        let parts = self.parts().iter().enumerate();
        let tale = |(robot, part): (usize, &Part)| {
            let words = part.tale?.words();
            Some(format!("{} {words}", name(robot + 1)))
        };
        parts.filter_map(tale).collect()
    }

    fn story_of_help(&self) -> String {
        if let Some(lead) = self.lead() {
            return lead.story();
        }
        match self.eyes() {
            Eyes::Poses => {}
            Eyes::Scans(_) => return "All that robots know of one another is what coloc-laser finds in their scans.".into(),
            Eyes::Camera(_) => return "All that robots know of one another is range and bearing from cameras that look ahead.".into(),
        }
        let untold = self.parts().iter().position(|it| it.help == Help::Nobody);
        let but =
            untold.map(|robot| format!("; {} is seen too, and told nothing", name(robot + 1)));
        format!(
            "Who is seen learns from who sees it{}.",
            but.unwrap_or_default()
        )
    }

    /// What is told of a robot beside how it is helped.
    pub(crate) fn tale(&self, robot: usize) -> Option<Tale> {
        self.parts().get(robot)?.tale
    }

    /// What the live table sets beside the poses.
    pub(crate) fn shown(&self) -> Shown {
        if self.parts().iter().any(|it| it.tale.is_some()) {
            Shown::States
        } else {
            Shown::Wheels
        }
    }

    /// What the receivers say of what the sensors make of the truth.
    pub(crate) fn received(&self, inputs: &StepInputs, received: &mut Vec<Received>) {
        received.clear();
        for fix in &inputs.fixes {
            received.push(self.as_told(fix, 0, inputs.step));
            let tale = self.tale(fix.robot);
            if tale.is_some_and(|tale| tale.receivers() > 1) {
                let others = Sensors::new(self.world(), &self.scene.sensors, self.seed, 1);
                let fixes = others.at(inputs.step).fixes;
                let own = fixes.iter().find(|it| it.robot == fix.robot);
                received.extend(own.map(|fix| self.as_told(fix, 1, inputs.step)));
            }
        }
    }

    #[allow(clippy::cast_precision_loss)] // Steps of a run.
    fn as_told(&self, fix: &Fix, receiver: u16, step: usize) -> Received {
        let time_s = step as f64 * self.step_s();
        let lie = self
            .tale(fix.robot)
            .and_then(|tale| tale.lie_m(receiver, time_s));
        let [x, y] = lie.unwrap_or_default();
        Received {
            robot: fix.robot,
            receiver,
            position: [fix.position[0] + x, fix.position[1] + y],
            is_lie: lie.is_some(),
        }
    }

    /// Where receivers that jumped have the robot, now and then until `until_s`.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A minute or two.
    pub(crate) fn lies(&self, robot: usize, until_s: f64) -> Vec<(f64, f64)> {
        let (sensors, mut inputs) = (self.sensors(), StepInputs::default());
        let (mut received, mut lies) = (Vec::new(), Vec::new());
        if self.tale(robot).is_none() {
            return lies;
        }
        let period = (LIES_PERIOD_S / self.step_s()).round() as usize;
        let steps = (until_s / self.step_s()) as usize;
        for step in (period..=steps).step_by(period.max(1)) {
            sensors.fill(step, &mut inputs);
            self.received(&inputs, &mut received);
            let own = received.iter().filter(|it| it.robot == robot && it.is_lie);
            lies.extend(own.map(|it| (it.position[0], it.position[1])));
        }
        lies
    }

    /// The sensors of the team.
    pub(crate) fn sensors(&self) -> Sensors<'_, dyn World + Send> {
        Sensors::new(self.world(), &self.scene.sensors, self.seed, 0)
    }

    /// Where the robot begins.
    pub(crate) fn initial(&self, robot: usize) -> Pose {
        self.world().initial(robot).unwrap_or_default()
    }

    /// Where the robot is `time_s` after the start, between steps on a straight line, if it drives; before the start where it begins.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Not negative, and saturates.
    pub(crate) fn truth_at(&self, robot: usize, time_s: f64) -> Option<Pose> {
        let steps = (time_s / self.world().dt_s()).max(0.0);
        let (step, part) = (steps.floor() as usize, steps.fract());
        let here = self.world().truth(step, robot)?;
        if part == 0.0 {
            return Some(here);
        }
        let there = self.world().truth(step + 1, robot)?;
        let is_driven = (there.x - here.x).hypot(there.y - here.y) < CARRIED_M;
        Some(if is_driven {
            between(&here, &there, part)
        } else {
            here
        })
    }
}

fn between(a: &Pose, b: &Pose, part: f64) -> Pose {
    let turn = wrap(b.phi - a.phi);
    Pose::new(
        a.x + part * (b.x - a.x),
        a.y + part * (b.y - a.y),
        a.phi + part * turn,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::scene::SceneName;

    fn args() -> DemoArgs {
        DemoArgs {
            fleet: false,
            namespaces: false,
            loss: 0.0,
            delay_ms: 0.0,
            partition: None,
            wrong_clock: None,
            correct_offset: false,
            robots: Some(2),
            seconds: Some(5.0),
            seed: 3,
            scene: SceneName::Meet,
            data: None,
            laser: false,
            camera: false,
            leaders: None,
            mode: coloc_daemon::config::AssistMode::default(),
            out: None,
            json: false,
        }
    }

    #[test]
    fn between_steps_the_truth_is_on_the_line_and_turns_the_short_way() {
        let pose = between(&Pose::new(0.0, 1.0, 3.1), &Pose::new(1.0, 1.0, -3.1), 0.5);
        assert!((pose.x - 0.5).abs() < 1e-12 && (pose.y - 1.0).abs() < 1e-12);
        assert!(pose.phi.abs() > 3.1, "{}", pose.phi);
    }

    #[test]
    fn before_the_start_everybody_stands_where_they_begin() {
        let stage = Stage::new(&args()).unwrap();
        assert_eq!(stage.truth_at(1, -0.7), Some(stage.initial(1)));
        assert_ne!(stage.truth_at(1, 4.0), Some(stage.initial(1)));
    }

    #[test]
    fn a_folder_without_a_recording_is_refused_by_name() {
        let data = Some("/nonexistent".into());
        let error = Stage::new(&DemoArgs { data, ..args() })
            .err()
            .expect("refused");
        assert!(error.to_string().contains("/nonexistent"), "{error}");
    }
}
