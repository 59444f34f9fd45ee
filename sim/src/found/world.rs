//! What a robot does, and what is said of it.

use coloc_estimator::{
    Covariance2, Covariance3, Measurement, Motion, NeighbourPose, OdometrySample, Origin, Parts,
    Pose, PositionFix, SlowError, Span, Stamp,
};

use super::experiment::{Drive, Event, Experiment, Lie, Sensor, Speaks, Tail, Wheels};
use crate::honest::increment::{Increment, Place};
use crate::random::{Draws, Noise, Purpose};

/// A tick of the whole campaign.
pub(super) const TICK: Span = Span::from_millis(20);
pub(super) const TICKS_PER_SECOND: u32 = 50;

/// For so long a turning rate is held \[s\].
const STRETCH_S: u32 = 5;
const FASTEST: f64 = 0.3;

/// Where the robot really is, and what it hears.
#[derive(Clone, Debug)]
pub(super) struct World {
    pub(super) place: Place,
    drive: Drive,
    wheels: Wheels,
    way: Draws,
    turns: Draws,
    /// `[v, ω]` \[m/s, rad/s\].
    velocity: [f64; 2],
    sources: Vec<Source>,
    silence: [u32; 2],
}

/// One who speaks.
#[derive(Clone, Debug)]
struct Source {
    number: u16,
    sensor: Sensor,
    slow: [f64; 2],
    spoken: u64,
    draws: Draws,
    liar: Option<Liar>,
}

/// What it says instead.
#[derive(Clone, Debug)]
struct Liar {
    lie: Lie,
    /// Where the robot was when it began, and when \[m, s\].
    origin: [f64; 2],
    since_s: f64,
    direction: [f64; 2],
    words: u32,
}

pub(super) fn seconds(tick: u32) -> f64 {
    f64::from(tick) / f64::from(TICKS_PER_SECOND)
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Seconds of this campaign fit.
pub(super) fn ticks(seconds: f64) -> u32 {
    (seconds * f64::from(TICKS_PER_SECOND)).round() as u32
}

pub(super) fn stamp(tick: u32) -> Stamp {
    Stamp::from_nanos(TICK.as_nanos() * i64::from(tick))
}

impl World {
    pub(super) fn new(experiment: &Experiment, noise: &Noise, robot: usize, place: Place) -> Self {
        let source = |(at, sensor): (usize, &Sensor)| Source::new(at + 1, *sensor, noise, robot);
        Self {
            place,
            drive: experiment.drive,
            wheels: experiment.wheels,
            way: noise.draws(Purpose::TrueWay, 0, robot, 0),
            turns: noise.draws(Purpose::Turns, 0, robot, 0),
            velocity: [0.0; 2],
            sources: experiment.sensors.iter().enumerate().map(source).collect(),
            silence: experiment.silence_s.map(ticks),
        }
    }

    /// Other sensors under the same numbers.
    pub(super) fn hear(&mut self, sensors: &[Sensor]) {
        for (source, sensor) in self.sources.iter_mut().zip(sensors) {
            source.sensor = *sensor;
        }
    }

    /// Nobody speaks any more until that tick.
    pub(super) fn silence(&mut self, ticks: [u32; 2]) {
        self.silence = ticks;
    }

    /// From `tick` on for `stride` ticks: drives, and says what the wheels say.
    pub(super) fn advance(&mut self, tick: u32, stride: u32) -> Measurement {
        let stretch = STRETCH_S * TICKS_PER_SECOND;
        if tick.is_multiple_of(stretch) {
            self.velocity = self.drive.velocity(tick / stretch, &mut self.turns);
        }
        let dt_s = seconds(stride);
        let rates = self.wheels.per_second(self.velocity);
        let [v, omega] = self.velocity;
        let increment = Increment::new([v * dt_s, 0.0, omega * dt_s], rates.map(|it| it * dt_s));
        increment.drive(&mut self.place, &mut self.way);
        let noise = rates.map(|it| it / TICK.as_seconds());
        OdometrySample {
            source: 0,
            start: stamp(tick),
            stamp: stamp(tick + stride),
            motion: Motion::Holonomic {
                velocity: [v, 0.0, omega],
                noise: Covariance3::diagonal(noise).unwrap_or_default(),
            },
        }
        .into()
    }

    /// All that is said at `tick`.
    pub(super) fn words(&mut self, tick: u32, words: &mut Vec<Measurement>) {
        if (self.silence[0]..self.silence[1]).contains(&tick) {
            return;
        }
        for source in &mut self.sources {
            if tick.is_multiple_of(source.sensor.every) {
                words.push(source.word(tick, &self.place));
            }
        }
    }

    /// The event of an experiment.
    pub(super) fn suffer(&mut self, event: &Event, tick: u32, draws: &mut Draws) {
        match *event {
            Event::Nothing => {}
            Event::Carried([near, far]) => {
                let distance = near * (draws.uniform(0.0, 1.0) * (far / near).ln()).exp();
                let [x, y] = anywhere(draws);
                self.place.position[0] += distance * x;
                self.place.position[1] += distance * y;
                self.place.heading = any_heading(draws);
            }
            Event::Lie(number, lie) => {
                let liar = Liar {
                    lie,
                    origin: self.place.position,
                    since_s: seconds(tick),
                    direction: anywhere(draws),
                    words: 0,
                };
                let sources = self.sources.iter_mut();
                for source in sources.filter(|it| usize::from(it.number) == number) {
                    source.liar = Some(liar.clone());
                }
            }
        }
    }
}

pub(super) fn any_heading(draws: &mut Draws) -> f64 {
    draws.uniform(-std::f64::consts::PI, std::f64::consts::PI)
}

pub(super) fn anywhere(draws: &mut Draws) -> [f64; 2] {
    let (sin, cos) = any_heading(draws).sin_cos();
    [cos, sin]
}

impl Drive {
    /// In a stretch.
    fn velocity(self, stretch: u32, turns: &mut Draws) -> [f64; 2] {
        let turn = turns.uniform(-FASTEST, FASTEST);
        let begin_s = f64::from(stretch * STRETCH_S);
        match self {
            Self::Wander(speed) => [speed, turn],
            Self::Straight(speed) => [speed, 0.0],
            Self::StopAndGo if stretch % 2 == 1 => [0.0; 2],
            Self::SpinFirst if begin_s < 10.0 => [0.0, 0.5],
            Self::Pausing([from, to]) if (from..to).contains(&begin_s) => [0.0; 2],
            Self::Parked => [0.0; 2],
            Self::StopAndGo | Self::SpinFirst | Self::Pausing(_) => [1.0, turn],
        }
    }
}

impl Wheels {
    /// Variances that a second adds ahead, to the side, and to the heading \[m², m², rad²\].
    fn per_second(self, [v, omega]: [f64; 2]) -> [f64; 3] {
        let [v, omega] = [v.abs(), omega.abs()];
        match self {
            Self::Sane => {
                let minute = 3.0_f64.to_radians().powi(2) / 60.0;
                [
                    0.02 * 0.02 * v,
                    0.005 * 0.005 * v,
                    minute * v + 0.02 * 0.02 * omega,
                ]
            }
            Self::Paper => [0.02 * 5.075 * v * v, 0.0, 0.02 * 0.345],
        }
    }
}

impl Source {
    fn new(number: usize, sensor: Sensor, noise: &Noise, robot: usize) -> Self {
        let mut draws = noise.draws(Purpose::Fix, 0, robot, number);
        let slow = draws.normals().map(|it: f64| sensor.slow_m * it);
        Self {
            number: u16::try_from(number).unwrap_or(u16::MAX),
            sensor,
            slow,
            spoken: 0,
            draws,
            liar: None,
        }
    }

    fn word(&mut self, tick: u32, place: &Place) -> Measurement {
        self.wander();
        let Sensor { white_m, .. } = self.sensor;
        let mut told = *place;
        if let Some(liar) = &mut self.liar {
            liar.tell(&mut told, seconds(tick));
        }
        let scale = white_m * self.sensor.tail.scale(&mut self.draws);
        let [a, b] = self.draws.normals();
        let [x, y] = told.position;
        let position = [x + self.slow[0] + scale * a, y + self.slow[1] + scale * b];
        self.spoken += 1;
        let origin = Origin {
            source: self.number,
            session: 0,
            sequence: self.spoken,
        };
        match self.sensor.kind {
            Speaks::Fix => self.fix(tick, origin, position),
            Speaks::Neighbour(sigma) => {
                let heading = told.heading + sigma * self.draws.normal();
                self.pose(tick, origin, position, heading, sigma)
            }
        }
    }

    fn wander(&mut self) {
        let Sensor {
            slow_m,
            memory_s,
            every,
            ..
        } = self.sensor;
        if slow_m > 0.0 && self.spoken > 0 {
            let kept = (-seconds(every) / memory_s).exp();
            let added = slow_m * (1.0 - kept * kept).sqrt();
            let [a, b] = self.draws.normals();
            self.slow = [
                kept * self.slow[0] + added * a,
                kept * self.slow[1] + added * b,
            ];
        }
    }

    fn fix(&self, tick: u32, origin: Origin, position: [f64; 2]) -> Measurement {
        let Sensor {
            white_m,
            slow_m,
            memory_s,
            ..
        } = self.sensor;
        PositionFix {
            stamp: stamp(tick),
            origin,
            position,
            covariance: Covariance2::diagonal([white_m * white_m; 2]).unwrap_or_default(),
            lever: [0.0; 2],
            slow: SlowError {
                variance: slow_m * slow_m,
                memory: Span::from_seconds(memory_s),
            },
        }
        .into()
    }

    fn pose(
        &self,
        tick: u32,
        origin: Origin,
        [x, y]: [f64; 2],
        heading: f64,
        sigma: f64,
    ) -> Measurement {
        let [white, slow] = [self.sensor.white_m, self.sensor.slow_m].map(|it| it * it);
        let independent = [white, white, sigma * sigma];
        NeighbourPose {
            stamp: stamp(tick),
            origin,
            pose: Pose::new(x, y, heading),
            parts: Parts {
                independent: Covariance3::diagonal(independent).unwrap_or_default(),
                dependent: Covariance3::diagonal([slow, slow, 0.0]).unwrap_or_default(),
            },
        }
        .into()
    }
}

impl Tail {
    /// By how much the next error is larger than a normal one of the claimed σ.
    fn scale(self, draws: &mut Draws) -> f64 {
        match self {
            Self::Mixed(share, times) if draws.happens(share) => times,
            Self::Gaussian | Self::Mixed(..) => 1.0,
            Self::Student => {
                let squares: f64 = draws.normals::<4>().iter().map(|it| it * it).sum();
                // χ²₄/4 below; the variance of t₄ is 2.
                (4.0 / squares / 2.0).sqrt()
            }
        }
    }
}

impl Liar {
    fn tell(&mut self, told: &mut Place, now_s: f64) {
        self.words += 1;
        let [dx, dy] = self.direction;
        let shift = |told: &mut Place, by: f64| {
            told.position[0] += by * dx;
            told.position[1] += by * dy;
        };
        match self.lie {
            Lie::Shift(by) => shift(told, by),
            Lie::ShiftFor(by, words) if self.words <= words => shift(told, by),
            Lie::PlaceFor(by, words) if self.words <= words => {
                told.position = self.origin;
                shift(told, by);
            }
            Lie::ShiftFor(..) | Lie::PlaceFor(..) => {}
            Lie::Drift(speed) => shift(told, speed * (now_s - self.since_s)),
            Lie::Turn(by) => {
                let (sin, cos) = by.sin_cos();
                let [x, y] = [0, 1].map(|i| told.position[i] - self.origin[i]);
                told.position[0] = self.origin[0] + cos * x - sin * y;
                told.position[1] = self.origin[1] + sin * x + cos * y;
                told.heading += by;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_long_and_students_variance_is_what_is_claimed() {
        let mut draws = Noise::new(3, 0).draws(Purpose::Fix, 0, 0, 0);
        let mut variance = |tail: Tail| {
            let n = 200_000;
            let squares = (0..n).map(|_| (tail.scale(&mut draws) * draws.normal()).powi(2));
            squares.sum::<f64>() / f64::from(n)
        };
        assert!((variance(Tail::Gaussian) - 1.0).abs() < 0.02);
        assert!((variance(Tail::Mixed(0.05, 5.0)) - 2.2).abs() < 0.1);
        assert!((variance(Tail::Student) - 1.0).abs() < 0.1);
    }
}
