//! One robot of an experiment, with the product's estimator.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, FoundSettings, Measurement, Pose, Settings, Slot,
    Start as Known, TickInputs, step,
};

use super::Form;
use super::experiment::{Event, Experiment, Sensor, Start};
use super::outcome::{Outcome, Watch};
use super::world::{World, any_heading, anywhere, stamp, ticks};
use crate::honest::increment::Place;
use crate::random::{Draws, Noise, Purpose};

/// A second at 50 Hz, and fixes of three at 10 Hz.
const SLOTS: usize = 128;

/// σ of a pose that is known \[m, m, rad\].
const KNOWN: [f64; 3] = [0.1, 0.1, 0.05];

/// How long a robot is watched after it was found \[s\].
const AFTER_S: f64 = 60.1;

/// A robot and its world.
#[derive(Clone, Debug)]
pub(super) struct Robot {
    world: World,
    estimator: Estimator<Vec<Slot>>,
    tick: u32,
    words: Vec<Measurement>,
    chance: Draws,
    /// Whether it tells what is decided.
    aloud: bool,
}

impl Robot {
    pub(super) fn new(experiment: &Experiment, form: &Form, robot: usize) -> Self {
        let noise = Noise::new(form.seed, run_of(&experiment.name));
        let mut chance = noise.draws(Purpose::Start, 0, robot, 0);
        let (known, place) = beginning(experiment.start, &mut chance);
        let settings = Settings {
            found: FoundSettings {
                trust_jump: experiment.trust,
                ..FoundSettings::default()
            },
            ..Settings::default()
        };
        let storage = vec![Slot::default(); SLOTS];
        Self {
            world: World::new(experiment, &noise, robot, place),
            estimator: Estimator::starting(settings, stamp(0), &known, storage),
            tick: 0,
            words: Vec::new(),
            chance,
            aloud: form.robot.is_some(),
        }
    }

    /// Drives, hears and steps; `happens` is what happens to it meanwhile.
    fn tick(&mut self, stride: u32, happens: Option<&Event>, watch: &mut Watch) {
        self.words.clear();
        self.words.push(self.world.advance(self.tick, stride));
        self.tick += stride;
        if let Some(event) = happens {
            self.world.suffer(event, self.tick, &mut self.chance);
        }
        self.world.words(self.tick, &mut self.words);
        let inputs = TickInputs {
            stamp: stamp(self.tick),
            measurements: &self.words,
        };
        let outputs = step(&mut self.estimator, &inputs);
        assert_eq!(outputs.folded_early, 0, "the history is too small");
        watch.see(self.tick, stride, &outputs, &self.world.place);
        if self.aloud {
            super::aloud::tell(self.tick, &outputs, &self.world.place);
        }
    }

    /// Until `tick`, of which nobody wants to know more.
    pub(super) fn pass(&mut self, to: u32, stride: u32) {
        let mut watch = Watch::new(0, None, true);
        while self.tick < to {
            self.tick(stride, None, &mut watch);
        }
    }

    pub(super) fn now(&self) -> u32 {
        self.tick
    }

    /// Nobody says anything for so many ticks.
    pub(super) fn silence(&mut self, until: u32) {
        self.world.silence([self.tick + 1, until]);
    }

    /// Those are its sensors from now on.
    pub(super) fn hear(&mut self, sensors: &[Sensor]) {
        self.world.hear(sensors);
    }

    /// From the tick before `event` on: what happens, happens in the first.
    pub(super) fn watched(mut self, experiment: &Experiment, event: u32, pace: Pace) -> Outcome {
        let liar = match experiment.event {
            Event::Lie(number, _) => u16::try_from(number).ok(),
            Event::Nothing | Event::Carried(_) => None,
        };
        let mut happens = Some(&experiment.event);
        let is_ok = self.estimator.finding().state == coloc_estimator::FindingState::Ok;
        let mut watch = Watch::new(event, liar, is_ok);
        let ends = event + ticks(experiment.watched_s);
        let enough = ticks(AFTER_S);
        while self.tick < ends {
            let found_for = watch.found_for(self.tick);
            let stride = pace.stride(self.tick, found_for);
            self.tick(stride, happens.take(), &mut watch);
            if !experiment.to_the_end && found_for.is_some_and(|it| it >= enough) {
                break;
            }
        }
        watch.outcome()
    }
}

/// How long the steps are.
#[derive(Copy, Clone, Debug)]
pub(super) struct Pace {
    stride: u32,
    /// The stride once it was found for some seconds.
    afterwards: u32,
}

/// Until then all is done at full pace \[s\].
const SETTLED_S: f64 = 2.0;

impl Pace {
    pub(super) fn new(form: &Form) -> Self {
        Self {
            stride: form.stride,
            afterwards: form.stride,
        }
    }

    /// At 10 Hz once it was found for two seconds.
    pub(super) fn easing(form: &Form) -> Self {
        Self {
            afterwards: COARSE,
            ..Self::new(form)
        }
    }

    /// Coarse steps begin where the coarse clock ticks, as words do.
    fn stride(self, tick: u32, found_for: Option<u32>) -> u32 {
        let has_settled = found_for.is_some_and(|it| it >= ticks(SETTLED_S));
        if has_settled && tick.is_multiple_of(COARSE) {
            self.afterwards
        } else {
            self.stride
        }
    }
}

/// 10 Hz.
pub(super) const COARSE: u32 = 5;

/// One robot from its start to its end.
pub(super) fn run(experiment: &Experiment, form: &Form, number: usize) -> Outcome {
    let mut robot = Robot::new(experiment, form, number);
    // What happens, happens in the first tick that is watched.
    let event = ticks(experiment.event_s);
    let before = match experiment.event {
        Event::Nothing => event,
        Event::Carried(_) | Event::Lie(..) => event.saturating_sub(form.stride),
    };
    robot.pass(before, form.stride);
    robot.watched(experiment, event, Pace::new(form))
}

/// All chance of an experiment, by its name: rows may come and go without changing the others.
pub(super) fn run_of(name: &str) -> u16 {
    let hash = name.bytes().fold(0x811c_9dc5_u32, |hash, byte| {
        (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
    });
    let [a, b, c, d] = hash.to_le_bytes();
    u16::from_le_bytes([a ^ c, b ^ d])
}

/// What it knows, and where it is.
pub(super) fn beginning(start: Start, chance: &mut Draws) -> (Known, Place) {
    let [x, y] = [0, 1].map(|_| chance.uniform(-50.0, 50.0));
    let heading = any_heading(chance);
    let place = Place {
        position: [x, y],
        heading,
    };
    let off: [f64; 3] = chance.normals();
    let known = |position: [f64; 2]| {
        let covariance = Covariance3::diagonal(KNOWN.map(|it| it * it)).unwrap_or_default();
        let pose = Pose::new(
            position[0] + KNOWN[0] * off[0],
            position[1] + KNOWN[1] * off[1],
            heading + KNOWN[2] * off[2],
        );
        Known::Known(Belief::independent(pose, covariance))
    };
    match start {
        Start::Pose => (known([x, y]), place),
        Start::Position(sigma) => {
            let covariance = Covariance2::diagonal([sigma * sigma; 2]).unwrap_or_default();
            let told = [x + sigma * off[0], y + sigma * off[1]];
            (Known::Position(told, covariance), place)
        }
        Start::Nothing => (Known::Unknown, place),
        Start::Wrong(distance) => {
            let known = known([x, y]);
            let [dx, dy] = anywhere(chance);
            let elsewhere = Place {
                position: [x + distance * dx, y + distance * dy],
                heading: any_heading(chance),
            };
            (known, elsewhere)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::found::{Lie, TrustJump};

    fn outcomes(experiment: &Experiment, robots: usize) -> Vec<Outcome> {
        let form = Form::short(1);
        (0..robots)
            .map(|number| run(experiment, &form, number))
            .collect()
    }

    #[test]
    fn a_robot_is_the_same_again_and_each_is_another() {
        let experiment = Experiment {
            start: Start::Nothing,
            ..Experiment::new("again", 2)
        };
        let once = outcomes(&experiment, 2);
        assert_eq!(once, outcomes(&experiment, 2));
        assert_ne!(once[0], once[1]);
    }

    #[test]
    fn who_knows_nothing_is_found_and_who_is_parked_is_not() {
        let start = Experiment {
            start: Start::Nothing,
            ..Experiment::new("a start", 3)
        };
        assert!(outcomes(&start, 3).iter().all(|it| it.found_s > Some(1.0)));
        let parked = Experiment {
            drive: crate::found::Drive::Parked,
            ..start
        };
        assert!(outcomes(&parked, 3).iter().all(|it| it.found_s.is_none()));
    }

    /// The campaign sees a liar that wins: with trust in the robot a lone one does.
    #[test]
    fn a_lone_liar_wins_or_is_named_as_the_setting_says() {
        let jumps = |trust| Experiment {
            trust,
            event_s: 20.0,
            event: Event::Lie(1, Lie::Shift(30.0)),
            to_the_end: true,
            watched_s: 30.0,
            ..Experiment::new("a jump", 2)
        };
        let robot = outcomes(&jumps(TrustJump::Robot), 2);
        assert!(robot.iter().all(|it| it.wrongly == 1 && it.ends_wrong));
        let receiver = outcomes(&jumps(TrustJump::Receiver), 2);
        assert!(receiver.iter().all(|it| it.followed == 0 && it.liar_at_end));
    }
}
