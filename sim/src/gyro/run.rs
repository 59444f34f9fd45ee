//! Robots that live through a row, with a gyro and without.

use coloc_estimator::angle::wrap;
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimate, Estimator, GYRO_SAMPLES, GyroSample, Measurement,
    NeighbourPose, Origin, Pose, PositionFix, RobotId, Settings, Sighting, Slot, SlowError,
    TickInputs, WithGyro, step,
};

use super::Row;
use super::world::{Doing, RATE_HZ, World, settings, stamp};
use crate::random::{Noise, Purpose};

const SECONDS: u32 = 600;
const TEAM: usize = 3;

/// Of the start \[m, m, rad\], and of sightings.
const START: [f64; 3] = [0.1, 0.1, 0.01];
const SIGHTING: [f64; 3] = [0.1, 0.1, 0.0175];
const FIX_M: f64 = 0.3;

/// A slip that is named so long after it ended is named all the same \[s\].
const AFTER_S: f64 = 1.5;

/// How many of how many.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Share {
    hits: f64,
    all: f64,
}

/// A sum of squares.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Squares {
    sum: f64,
    count: f64,
}

/// What came of robots.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Outcome {
    /// Of the heading at the end \[rad\].
    pub(super) with_gyro: Squares,
    pub(super) wheels: Squares,
    pub(super) outside: Share,
    pub(super) wheels_outside: Share,
    /// Of the bias, beyond 3 σ: after 5 s, after 30 s, at the end.
    pub(super) bias: [Share; 3],
    pub(super) bias_sigma: Squares,
    pub(super) slips: u32,
    pub(super) named: u32,
    delays_s: Vec<f64>,
    pub(super) false_alarms: u32,
    seconds: u32,
}

impl Share {
    fn count(&mut self, hit: bool) {
        self.hits += f64::from(u8::from(hit));
        self.all += 1.0;
    }

    pub(super) fn value(&self) -> f64 {
        self.hits / self.all.max(1.0)
    }

    /// Whether it is more than `most`, by `chance` σ where `follow` of them are one.
    pub(super) fn beyond(&self, most: f64, follow: f64, chance: f64) -> bool {
        let sigma = (most * (1.0 - most) * follow / self.all.max(1.0)).sqrt();
        self.value() > most + chance * sigma
    }

    fn and(self, other: Self) -> Self {
        Self {
            hits: self.hits + other.hits,
            all: self.all + other.all,
        }
    }
}

impl Squares {
    fn add(&mut self, value: f64) {
        self.sum += value * value;
        self.count += 1.0;
    }

    pub(super) fn rms(&self) -> f64 {
        (self.sum / self.count).sqrt()
    }

    fn and(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            count: self.count + other.count,
        }
    }
}

impl Outcome {
    pub(super) fn and(mut self, other: &Self) -> Self {
        self.with_gyro = self.with_gyro.and(other.with_gyro);
        self.wheels = self.wheels.and(other.wheels);
        self.outside = self.outside.and(other.outside);
        self.wheels_outside = self.wheels_outside.and(other.wheels_outside);
        for (own, other) in self.bias.iter_mut().zip(other.bias) {
            *own = own.and(other);
        }
        self.bias_sigma = self.bias_sigma.and(other.bias_sigma);
        self.slips += other.slips;
        self.named += other.named;
        self.delays_s.extend(&other.delays_s);
        self.false_alarms += other.false_alarms;
        self.seconds += other.seconds;
        self
    }

    pub(super) fn ratio(&self) -> f64 {
        self.with_gyro.rms() / self.wheels.rms()
    }

    /// Until a slip was named, the median \[s\].
    pub(super) fn delay_s(&self) -> f64 {
        let mut sorted = self.delays_s.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    }

    pub(super) fn hours(&self) -> u32 {
        self.seconds / 3600
    }
}

/// A robot with two estimators, of which one hears no gyro.
struct Robot {
    world: World,
    with_gyro: Estimator<WithGyro<Vec<Slot>, Vec<GyroSample>>>,
    wheels: Estimator<Vec<Slot>>,
    heard: Vec<Measurement>,
    slipping: Slipping,
}

/// What was said of slip.
#[derive(Copy, Clone, Debug, Default)]
struct Slipping {
    began_s: Option<f64>,
    named: bool,
    quiet_from_s: f64,
    told: bool,
}

pub(super) fn live(row: &Row, seed: u64, run: u16) -> Outcome {
    let noise = Noise::new(seed, run);
    let count = if row.team { TEAM } else { 1 };
    let mut robots: Vec<_> = (0..count).map(|it| Robot::new(row, &noise, it)).collect();
    let mut outcome = Outcome::default();
    for tick in 1..=SECONDS * RATE_HZ {
        for robot in &mut robots {
            robot.world.tick(tick, &mut robot.heard);
        }
        measure(row, &noise, tick, &mut robots);
        let mut words = Vec::new();
        for (number, robot) in robots.iter_mut().enumerate() {
            let estimates = robot.step(tick, number, &mut words);
            robot.look(row, tick, &estimates, &mut outcome);
        }
        for (to, word) in words {
            robots[to].heard.push(word);
        }
    }
    outcome
}

/// Fixes, and who sees whom.
fn measure(row: &Row, noise: &Noise, tick: u32, robots: &mut [Robot]) {
    let is_time = |every_s: u32| tick.is_multiple_of(every_s * RATE_HZ);
    let sequence = u64::from(tick);
    if row.fixes_s.is_some_and(is_time)
        && let Some(first) = robots.first_mut()
    {
        let mut draws = noise.draws(Purpose::Fix, tick as usize, 0, 0);
        let position = first
            .world
            .place
            .position
            .map(|it| it + FIX_M * draws.normal());
        first.heard.push(Measurement::Fix(PositionFix {
            stamp: stamp(tick),
            origin: Origin::counted(sequence),
            position,
            covariance: Covariance2::diagonal([FIX_M * FIX_M; 2]).unwrap_or_default(),
            lever: [0.0; 2],
            slow: SlowError::default(),
        }));
    }
    if !is_time(1) {
        return;
    }
    let poses: Vec<_> = robots.iter().map(|it| it.world.pose()).collect();
    for (by, robot) in robots.iter_mut().enumerate() {
        for (seen, pose) in poses.iter().enumerate().filter(|(seen, _)| *seen != by) {
            let mut draws = noise.draws(Purpose::RelativePose, tick as usize, by, seen);
            let [x, y, phi] = SIGHTING.map(|sigma| sigma * draws.normal());
            let relative = between(&poses[by], pose);
            robot.heard.push(Measurement::Sighting(Sighting {
                stamp: stamp(tick),
                origin: Origin::counted(sequence),
                observed: id(seen),
                relative: Pose::new(relative.x + x, relative.y + y, relative.phi + phi),
                covariance: squared(SIGHTING),
            }));
        }
    }
}

fn between(from: &Pose, to: &Pose) -> Pose {
    let (sin, cos) = from.phi.sin_cos();
    let [x, y] = [to.x - from.x, to.y - from.y];
    Pose::new(cos * x + sin * y, cos * y - sin * x, to.phi - from.phi)
}

fn id(robot: usize) -> RobotId {
    RobotId(u16::try_from(robot).unwrap_or(u16::MAX))
}

fn squared(sigma: [f64; 3]) -> Covariance3 {
    Covariance3::diagonal(sigma.map(|it| it * it)).unwrap_or_default()
}

impl Robot {
    fn new(row: &Row, noise: &Noise, robot: usize) -> Self {
        let mut draws = noise.draws(Purpose::Start, 0, robot, 0);
        let mut world = World::new(row, noise, robot);
        let [x, y, heading] = START.map(|sigma| sigma * draws.normal());
        let start = Pose::new(0.0, 3.0 * f64::from(id(robot).0), 0.0);
        world.place.position = [start.x + x, start.y + y];
        world.place.heading = heading;
        let belief = Belief::independent(start, squared(START));
        let slots = vec![Slot::default(); 256];
        let wheels = Estimator::new(Settings::default(), stamp(0), belief, slots.clone());
        let settings = Settings {
            gyro: Some(settings()),
            ..Settings::default()
        };
        let samples = vec![GyroSample::default(); GYRO_SAMPLES];
        let with_gyro = Estimator::new(settings, stamp(0), belief, WithGyro { slots, samples });
        Self {
            world,
            with_gyro,
            wheels,
            heard: Vec::new(),
            slipping: Slipping::default(),
        }
    }

    /// With the gyro, and without. What is told of sightings is the one's with.
    fn step(
        &mut self,
        tick: u32,
        number: usize,
        words: &mut Vec<(usize, Measurement)>,
    ) -> [Estimate; 2] {
        let inputs = TickInputs {
            stamp: stamp(tick),
            measurements: &self.heard,
        };
        let outputs = step(&mut self.with_gyro, &inputs);
        words.extend(outputs.outgoing.iter().map(|told| {
            let word = Measurement::Neighbour(NeighbourPose {
                stamp: told.stamp,
                origin: Origin {
                    source: id(number).0,
                    ..Origin::counted(u64::from(tick))
                },
                pose: told.pose,
                parts: told.parts,
            });
            (usize::from(told.to.0), word)
        }));
        let with_gyro = outputs.estimate;
        let wheels = step(&mut self.wheels, &inputs).estimate;
        self.heard.clear();
        [with_gyro, wheels]
    }

    fn look(&mut self, row: &Row, tick: u32, estimates: &[Estimate; 2], outcome: &mut Outcome) {
        let [with_gyro, wheels] = estimates;
        let (error, outside) = self.error(with_gyro);
        let (wheels_error, wheels_outside) = self.error(wheels);
        let gyro = with_gyro
            .gyro
            .unwrap_or_else(|| unreachable!("it is configured"));
        if tick.is_multiple_of(10 * RATE_HZ) {
            outcome.outside.count(outside);
            outcome.wheels_outside.count(wheels_outside);
        }
        let sigma = gyro.bias_variance.sqrt();
        let beyond = (gyro.bias - self.world.bias).abs() > 3.0 * sigma;
        for (share, second) in outcome.bias.iter_mut().zip([5, 30, SECONDS]) {
            if tick == second * RATE_HZ {
                share.count(beyond);
            }
        }
        if tick == SECONDS * RATE_HZ {
            outcome.with_gyro.add(error);
            outcome.wheels.add(wheels_error);
            outcome.bias_sigma.add(sigma);
            outcome.seconds += SECONDS;
        }
        let now_s = f64::from(tick) / f64::from(RATE_HZ);
        let slips = Doing::at(row, tick).slips;
        self.slipping
            .look(now_s, slips, gyro.slipping_since.is_some(), outcome);
    }

    fn error(&self, estimate: &Estimate) -> (f64, bool) {
        let error = wrap(estimate.belief.pose.phi - self.world.place.heading);
        let [_, _, variance] = estimate.belief.total().variances();
        (error, error.abs() > 1.96 * variance.sqrt())
    }
}

impl Slipping {
    fn look(&mut self, now_s: f64, slips: bool, told: bool, outcome: &mut Outcome) {
        match (slips, self.began_s) {
            (true, None) => {
                (self.began_s, self.named) = (Some(now_s), false);
                outcome.slips += 1;
            }
            (false, Some(_)) => {
                (self.began_s, self.quiet_from_s) = (None, now_s + AFTER_S);
            }
            _ => {}
        }
        if told
            && let Some(began_s) = self.began_s
            && !self.named
        {
            self.named = true;
            outcome.named += 1;
            outcome.delays_s.push(now_s - began_s);
        }
        if told && !self.told && !slips && now_s > self.quiet_from_s {
            outcome.false_alarms += 1;
        }
        self.told = told;
    }
}
