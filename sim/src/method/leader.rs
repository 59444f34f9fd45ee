//! Leaders and children: robots with a receiver tell all others where they are, through chains of sightings ([`crate::leaders`]).
//!
//! All sightings of one step are an event. Leaders know all of them; what they say of a child takes the way of the sightings that it is
//! made of, and is lost where one of them would be, and late by what all of them would be. A child puts what is late into its step, and
//! goes through all since again. A team without a receiver tells nothing.

use std::collections::{BTreeMap, VecDeque};

use coloc_estimator::assist::bond::News;
use coloc_estimator::assist::datum::Reading;
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::assist::team::Team;
use coloc_estimator::{Belief, GlobalPose, Motion, Pose, RobotId};
use nalgebra::Matrix3;

use super::wheels::Wheels;
use super::{FilterSettings, Innovation, Method, Sensor};
use crate::leaders::event::{Readings, Told, poses};
pub(crate) use crate::leaders::robot::Method as Fusion;
use crate::leaders::robot::{Child, Heard, Leader};
use crate::sensors::StepInputs;

/// So many sightings is the longest chain whose news are waited for.
const LONGEST_CHAIN: usize = 4;

/// A team of them.
#[derive(Clone, Debug)]
pub struct Leaders {
    settings: FilterSettings,
    /// `None`: nobody tells anybody anything.
    team: Option<Team>,
    heads: BTreeMap<RobotId, Leader>,
    children: BTreeMap<RobotId, Listener>,
    wheels: Vec<Wheels>,
    under_way: Vec<Letter>,
    /// How many there were.
    events: i64,
}

/// A child with what it needs for what comes late.
#[derive(Clone, Debug)]
struct Listener {
    child: Child,
    /// The last steps, the latest last.
    past: VecDeque<Step>,
}

#[derive(Clone, Debug)]
struct Step {
    number: usize,
    /// The child before it.
    before: Child,
    motion: Motion,
    /// By the leader's place.
    heard: BTreeMap<usize, (News, GlobalPose)>,
}

#[derive(Clone, Debug)]
struct Letter {
    arrives: usize,
    step: usize,
    to: RobotId,
    place: usize,
    news: News,
    pose: GlobalPose,
}

fn id(robot: usize) -> RobotId {
    RobotId(u16::try_from(robot).unwrap_or(u16::MAX))
}

fn index(robot: RobotId) -> usize {
    usize::from(robot.0)
}

impl Leaders {
    /// A team that begins at `initial`.
    pub(crate) fn new(fusion: Fusion, settings: FilterSettings, initial: &[Belief]) -> Self {
        let leads = |robot: usize| settings.receivers.contains(&robot);
        let robots = || initial.iter().enumerate();
        let heads: BTreeMap<_, _> = robots()
            .filter(|it| leads(it.0))
            .map(|(robot, belief)| (id(robot), Leader::new(*belief)))
            .collect();
        let children: BTreeMap<_, _> = robots()
            .filter(|it| !leads(it.0))
            .map(|(robot, belief)| (id(robot), Listener::new(Child::new(fusion, *belief))))
            .collect();
        let ids = [
            heads.keys().copied().collect::<Vec<_>>(),
            children.keys().copied().collect(),
        ];
        Self {
            team: Team::new(&ids[0], &ids[1]).ok(),
            heads,
            children,
            wheels: vec![Wheels::default(); initial.len()],
            under_way: Vec::new(),
            events: 0,
            settings,
        }
    }

    fn drive(&mut self, inputs: &StepInputs) {
        let (settings, dt_s) = (&self.settings, self.settings.dt_s);
        for (robot, (wheels, reported)) in self.wheels.iter_mut().zip(&inputs.odometry).enumerate()
        {
            let motion = wheels.motion(*reported, settings);
            if let Some(leader) = self.heads.get_mut(&id(robot)) {
                leader.drive(&motion, dt_s);
            }
            if let Some(child) = self.children.get_mut(&id(robot)) {
                child.drive(inputs.step, motion, settings);
            }
        }
    }

    fn fix(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        for fix in &inputs.fixes {
            if let Some(leader) = self.heads.get_mut(&id(fix.robot)) {
                let heard = leader.fix(fix.position, &self.settings.fix);
                log(innovation(Sensor::Fix, fix.robot, heard));
            }
        }
    }

    fn event(&mut self, inputs: &StepInputs) {
        let Some(team) = self.team.filter(|_| !inputs.sightings.is_empty()) else {
            return;
        };
        self.events += 1;
        let covariance = self.settings.relative;
        let arrival = |pair: &[RobotId; 2]| {
            let mut seen = inputs.sightings.iter();
            let seen = seen.find(|it| [id(it.observer), id(it.observed)] == *pair)?;
            Some(seen.arrives?.saturating_sub(inputs.step))
        };
        let readings: Readings = inputs
            .sightings
            .iter()
            .map(|it| {
                let relative = it.relative;
                let reading = Reading {
                    relative,
                    covariance,
                };
                ([id(it.observer), id(it.observed)], reading)
            })
            .collect();
        let beliefs = self.heads.iter().map(|(id, it)| (*id, it.belief));
        let poses = poses(&team, &beliefs.collect(), &readings);
        for (place, (leader, it)) in self.heads.iter_mut().enumerate() {
            let news = it.at_event(Slot(self.events));
            let told = poses.iter().filter(|([_, by], _)| by == leader);
            for ([to, _], Told { pose, by }) in told {
                let Some(late) = by.iter().map(arrival).sum::<Option<usize>>() else {
                    continue;
                };
                self.under_way.push(Letter {
                    arrives: inputs.step + late,
                    step: inputs.step,
                    to: *to,
                    place,
                    news,
                    pose: *pose,
                });
            }
        }
    }

    /// What arrives at this step, each event's in the order of the leaders.
    fn deliver(&mut self, now: usize, log: &mut dyn FnMut(Innovation)) {
        let arrived = self.under_way.extract_if(.., |it| it.arrives <= now);
        let mut arrived: Vec<Letter> = arrived.collect();
        arrived.sort_by_key(|it| (it.to, it.step, it.place));
        for letters in arrived.chunk_by(|a, b| (a.to, a.step) == (b.to, b.step)) {
            if let Some(listener) = self.children.get_mut(&letters[0].to) {
                let robot = index(letters[0].to);
                let mut log = |heard| log(innovation(Sensor::Neighbour, robot, heard));
                listener.hear(letters, self.settings.dt_s, &mut log);
            }
        }
    }
}

fn innovation(sensor: Sensor, robot: usize, Heard { accepted, d2 }: Heard) -> Innovation {
    Innovation {
        sensor,
        robot,
        accepted,
        d2,
    }
}

impl Listener {
    fn new(child: Child) -> Self {
        Self {
            child,
            past: VecDeque::new(),
        }
    }

    fn drive(&mut self, number: usize, motion: Motion, settings: &FilterSettings) {
        self.past.push_back(Step {
            number,
            before: self.child.clone(),
            motion,
            heard: BTreeMap::new(),
        });
        if self.past.len() > LONGEST_CHAIN * settings.longest_delay + 1 {
            self.past.pop_front();
        }
        self.child.drive(&motion, settings.dt_s);
    }

    /// Letters of one event; `log` hears of them alone.
    fn hear(&mut self, letters: &[Letter], dt_s: f64, log: &mut dyn FnMut(Heard)) {
        let Some(event) = self.past.iter().position(|it| it.number == letters[0].step) else {
            return; // Nobody remembers.
        };
        let news = |it: &Letter| (it.place, (it.news, it.pose));
        self.past[event].heard.extend(letters.iter().map(news));
        let is_new = |place: usize| letters.iter().any(|it| it.place == place);
        let mut child = self.past[event].before.clone();
        for (age, step) in self.past.iter_mut().skip(event).enumerate() {
            step.before = child.clone();
            child.drive(&step.motion, dt_s);
            for (place, (news, pose)) in &step.heard {
                let heard = child.hear(*place, news, Some(pose));
                if let Some(heard) = heard.filter(|_| age == 0 && is_new(*place)) {
                    log(heard);
                }
            }
            if !step.heard.is_empty() {
                child.end_event();
            }
        }
        self.child = child;
    }
}

impl Method for Leaders {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        self.drive(inputs);
        self.fix(inputs, log);
        self.event(inputs);
        self.deliver(inputs.step, log);
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        let robot = id(robot);
        let leader = self.heads.get(&robot).map(|it| it.belief);
        let child = || self.children.get(&robot).map(|it| it.child.belief);
        let belief = leader.or_else(child).unwrap_or_default();
        (belief.pose, belief.total().matrix())
    }
}

#[cfg(test)]
mod tests {
    use coloc_estimator::Covariance3;

    use super::*;
    use crate::scenario::Scenario;
    use crate::sensors::Sensors;
    use crate::synthetic::{Synthetic, SyntheticConfig};
    use crate::world::World as _;

    const FUSIONS: [Fusion; 3] = [Fusion::Kalman, Fusion::Split, Fusion::Default];
    /// Without sightings at the end, so that all that is late is there.
    const STEPS: usize = 400;
    const LAST_SIGHTINGS: usize = 300;

    /// What robots believe after some seconds on a radio that does this to the sightings of a step.
    fn after(fusion: Fusion, radio: impl Fn(&mut StepInputs)) -> Vec<(Pose, Matrix3<f64>)> {
        let world = Synthetic::new(&SyntheticConfig {
            seconds: 10.0,
            ..SyntheticConfig::default()
        });
        let scenario = Scenario::named("delayed").expect("a scenario");
        let settings = FilterSettings::new(&scenario, world.dt_s());
        let p0 = Covariance3::diagonal([0.0025, 0.0025, 0.001]).expect("positive");
        let begin = |robot| Belief::independent(world.initial(robot).expect("known"), p0);
        let initial: Vec<Belief> = (0..5).map(begin).collect();
        let mut team = Leaders::new(fusion, settings, &initial);
        let sensors = Sensors::new(&world, &scenario, 5, 0);
        for step in 1..STEPS {
            let mut inputs = sensors.at(step);
            if step > LAST_SIGHTINGS {
                inputs.sightings.clear();
            }
            radio(&mut inputs);
            team.step(&inputs, &mut |_| ());
        }
        (0..5).map(|robot| team.estimate(robot)).collect()
    }

    fn at_once(inputs: &mut StepInputs) {
        for seen in &mut inputs.sightings {
            seen.arrives = Some(inputs.step);
        }
    }

    #[test]
    fn what_comes_late_is_put_in_its_place_to_the_last_bit() {
        let late = |inputs: &mut StepInputs| {
            for (number, seen) in inputs.sightings.iter_mut().enumerate() {
                seen.arrives = Some(inputs.step + (7 * number + inputs.step) % 20);
            }
        };
        for fusion in FUSIONS {
            assert_eq!(after(fusion, late), after(fusion, at_once), "{fusion:?}");
        }
    }

    #[test]
    fn children_whose_news_are_lost_are_less_sure_and_leaders_are_not() {
        let lost = |inputs: &mut StepInputs| {
            for seen in &mut inputs.sightings {
                seen.arrives = None;
            }
        };
        for fusion in FUSIONS {
            let (without, with) = (after(fusion, lost), after(fusion, at_once));
            for robot in 0..5 {
                let [without, with] = [&without, &with].map(|it| it[robot].1.trace());
                if robot < 2 {
                    assert!((without - with).abs() < 1e-15, "{robot}");
                } else {
                    assert!(
                        without > 1.5 * with,
                        "{fusion:?}, {robot}: {without} {with}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_team_without_a_receiver_goes_on_alone() {
        let scenario = Scenario::paper();
        let settings = FilterSettings {
            receivers: Vec::new(),
            ..FilterSettings::new(&scenario, 0.02)
        };
        let team = Leaders::new(Fusion::Split, settings, &[Belief::default(); 2]);
        assert!(team.team.is_none() && team.children.len() == 2);
    }
}
