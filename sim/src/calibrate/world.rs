//! Robots whose truth is known, and the drives from which it is to be found.

use std::f64::consts::TAU;

use coloc_calibrate::{Coefficients, Drive, Fix, Gyro, Receiver, Robot, State, Way, Wheels};

use crate::random::{Draws, Noise, Purpose};

/// A piece of a drive.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Leg {
    /// How long \[s\].
    pub seconds: f64,
    /// Mean speed \[m/s\].
    pub speed_mps: f64,
    /// Turning rate \[rad/s\].
    pub turn_radps: f64,
}

/// What a robot has, and how it drives.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// For people.
    pub name: &'static str,
    /// One after another.
    pub legs: Vec<Leg>,
    /// Whether fixes come.
    pub fixes: bool,
    /// Whether it has a gyro.
    pub gyro: bool,
}

/// Intervals of the wheels \[s\].
const DT_S: f64 = 0.1;

/// Intervals of them between fixes.
const FIX_EVERY: usize = 2;

/// The speed goes up and down by this part of itself, in so many seconds.
const WAVE: f64 = 0.5;
const WAVE_S: f64 = 9.0;

const fn leg(seconds: f64, speed_mps: f64, turn_radps: f64) -> Leg {
    Leg {
        seconds,
        speed_mps,
        turn_radps,
    }
}

impl Course {
    /// What the documentation asks for: stand, straight, loops both ways, slow and fast, stand.
    #[must_use]
    pub fn whole() -> Self {
        let legs = vec![
            leg(30.0, 0.0, 0.0),
            leg(40.0, 1.0, 0.0),
            leg(30.0, 0.6, 0.6),
            leg(20.0, 0.0, 1.0),
            leg(30.0, 2.0, 0.0),
            leg(30.0, 0.6, -0.6),
            leg(20.0, 0.0, -1.0),
            leg(40.0, 0.2, 0.0),
            leg(30.0, 1.0, 0.3),
            leg(30.0, 1.0, -0.3),
            leg(90.0, 0.0, 0.0),
        ];
        Self {
            name: "the whole drive",
            legs,
            fixes: true,
            gyro: true,
        }
    }

    /// Straight ahead, with stops at both ends.
    #[must_use]
    pub fn straight() -> Self {
        Self {
            name: "straight ahead",
            legs: vec![
                leg(30.0, 0.0, 0.0),
                leg(150.0, 1.0, 0.0),
                leg(30.0, 0.0, 0.0),
            ],
            ..Self::whole()
        }
    }

    /// Without a stop.
    #[must_use]
    pub fn never_still() -> Self {
        let whole = Self::whole();
        Self {
            name: "without a stop",
            legs: whole.legs.into_iter().filter(Leg::moves).collect(),
            ..Self::whole()
        }
    }

    /// Without fixes: there is no metre but the wheels', and no radian but the gyro's.
    #[must_use]
    pub fn without_fixes() -> Self {
        Self {
            name: "without fixes",
            fixes: false,
            ..Self::whole()
        }
    }

    /// Wheels and nothing else.
    #[must_use]
    pub fn alone() -> Self {
        Self {
            name: "without fixes or gyro",
            gyro: false,
            ..Self::without_fixes()
        }
    }
}

impl Leg {
    fn moves(&self) -> bool {
        self.speed_mps != 0.0 || self.turn_radps != 0.0
    }
}

/// What is configured before anything is known.
#[must_use]
pub fn configured(course: &Course) -> Robot {
    let noise = |per_s, per_m, per_rad| Coefficients {
        per_s,
        per_m,
        per_rad,
        ..Coefficients::default()
    };
    let receiver = Receiver {
        sigma_m: 0.01,
        slow_sigma_m: 0.05,
        slow_time_s: 6.0,
        ..Receiver::default()
    };
    Robot {
        wheels: Wheels::axle(0.5),
        noise: [
            noise(0.0, 5e-4, 0.0),
            noise(0.0, 5e-4, 0.0),
            noise(4.6e-5, 0.0, 1e-3),
        ],
        standing: [3e-4, 3e-4, 1e-7],
        missing: [1.0; 3],
        gyro: course.gyro.then_some(Gyro {
            scale: 1.0,
            bias_radps: 0.0,
            per_s: 3e-6,
        }),
        receivers: if course.fixes { vec![receiver] } else { vec![] },
        heading_rad: 0.0,
    }
}

/// A robot that is not quite as configured.
#[must_use]
pub fn true_robot(configured: &Robot, draws: &mut Draws) -> Robot {
    let mut it = configured.clone();
    it.wheels.scale += 0.02 * draws.normal();
    it.wheels.difference += 0.01 * draws.normal();
    it.wheels.span_m *= 1.0 + 0.04 * draws.normal();
    let mut times = |value: &mut f64, sigma: f64| *value *= (sigma * draws.normal()).exp();
    for noise in &mut it.noise {
        times(&mut noise.per_s, 0.5);
        times(&mut noise.per_m, 0.5);
        times(&mut noise.per_rad, 0.5);
    }
    let mut grown = 1.0;
    times(&mut grown, 0.4);
    it.standing[0] *= grown;
    it.standing[1] *= grown;
    it.standing[2] *= grown;
    if let Some(gyro) = &mut it.gyro {
        times(&mut gyro.per_s, 0.5);
        gyro.scale += 0.02 * draws.normal();
        gyro.bias_radps += 0.03 * draws.normal();
    }
    for receiver in &mut it.receivers {
        let [a, b, c, forward, left] = draws.normals();
        receiver.sigma_m *= (0.3 * a).exp();
        receiver.slow_sigma_m *= (0.3 * b).exp();
        receiver.slow_time_s *= (0.3 * c).exp();
        receiver.lever_m = [0.3 * forward, 0.3 * left];
        receiver.delay_s = draws.uniform(-0.05, 0.3);
    }
    it.heading_rad = draws.uniform(0.0, TAU);
    it
}

/// The pose, and the slow error of the receiver.
#[derive(Copy, Clone, Debug, Default)]
struct Truth {
    position: [f64; 2],
    heading: f64,
    slow: [f64; 2],
}

impl Truth {
    /// Along an arc.
    fn drive(&mut self, [ahead, left, turn]: [f64; 3]) {
        let (begin, end) = (self.heading, self.heading + turn);
        let (sin, cos) = if turn.abs() < 1e-6 {
            (begin.sin(), begin.cos())
        } else {
            (
                (begin.cos() - end.cos()) / turn,
                (end.sin() - begin.sin()) / turn,
            )
        };
        self.position[0] += cos * ahead - sin * left;
        self.position[1] += sin * ahead + cos * left;
        self.heading = end;
    }

    fn antenna(&self, [forward, left]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.heading.sin_cos();
        let [x, y] = self.position;
        [
            x + cos * forward - sin * left,
            y + sin * forward + cos * left,
        ]
    }
}

/// Run number `run`: a robot, and what it read on its way.
#[must_use]
pub fn drive(course: &Course, seed: u64, run: u16) -> (Robot, Drive) {
    let noise = Noise::new(seed, run);
    let draws = |step| noise.draws(Purpose::Calibration, step, 0, 0);
    let robot = true_robot(&configured(course), &mut draws(0));
    let mut truth = Truth {
        position: [3.0, -2.0],
        heading: robot.heading_rad,
        ..Truth::default()
    };
    if let Some(receiver) = robot.receivers.first() {
        truth.slow = draws(1).normals().map(|it: f64| it * receiver.slow_sigma_m);
    }
    let (mut ways, mut fixes) = (Vec::new(), Vec::new());
    for (index, leg) in intervals(course).enumerate() {
        let mut draws = draws(index + 2);
        let way = read(&robot, leg, index);
        let first = moved(&robot, &way, &mut truth, &mut draws);
        if let Some(receiver) = robot.receivers.first() {
            forget(receiver, &mut truth, &mut draws);
            if index % FIX_EVERY == FIX_EVERY - 1 {
                fixes.push(fix(receiver, &way, &truth, &mut draws));
            }
        }
        let turned = first + moved(&robot, &way, &mut truth, &mut draws);
        let gyro = robot.gyro.as_ref();
        ways.push(Way {
            gyro: gyro.map(|gyro| turning(gyro, turned, &mut draws)),
            ..way
        });
    }
    (robot, Drive::new(ways, fixes))
}

/// The legs, interval by interval.
fn intervals(course: &Course) -> impl Iterator<Item = Leg> {
    let of_leg = |leg: &Leg| {
        let (leg, count) = (*leg, leg.seconds / DT_S);
        (0_u32..)
            .take_while(move |it| f64::from(*it) < count)
            .map(move |_| leg)
    };
    course
        .legs
        .clone()
        .into_iter()
        .flat_map(move |leg| of_leg(&leg))
}

/// What the wheels read in an interval.
fn read(robot: &Robot, leg: Leg, index: usize) -> Way {
    let start_s = DT_S * f64::from(u32::try_from(index).unwrap_or(u32::MAX));
    let wave = 1.0 + WAVE * (TAU * start_s / WAVE_S).sin();
    let (way, turn) = (leg.speed_mps * wave * DT_S, leg.turn_radps * wave * DT_S);
    let half = 0.5 * turn * robot.wheels.span_m;
    Way {
        start_s,
        end_s: start_s + DT_S,
        read: [way - half, way + half],
        state: if leg.moves() {
            State::Rolling
        } else {
            State::Standing
        },
        gyro: None,
    }
}

/// Half the interval of a robot whose wheels read that: how far it has turned.
fn moved(robot: &Robot, way: &Way, truth: &mut Truth, draws: &mut Draws) -> f64 {
    let [ahead, turn] = robot.wheels.held(way.read).map(|it| 0.5 * it);
    let dt_s = 0.5 * DT_S;
    let of = |it: &Coefficients| it.per_s * dt_s + it.per_m * ahead.abs() + it.per_rad * turn.abs();
    let variances = match way.state {
        State::Standing => robot.standing.map(|it| it * dt_s),
        _ => [0, 1, 2].map(|it: usize| of(&robot.noise[it])),
    };
    let [forward, sideways, turning] = variances.map(|it| it.sqrt() * draws.normal());
    truth.drive([ahead + forward, sideways, turn + turning]);
    turn + turning
}

/// What a gyro reads of a turn in an interval.
fn turning(gyro: &Gyro, turned: f64, draws: &mut Draws) -> f64 {
    let off = (gyro.per_s * DT_S).sqrt() * draws.normal();
    (turned - off) / gyro.scale + gyro.bias_radps * DT_S
}

/// The slow error an interval later.
fn forget(receiver: &Receiver, truth: &mut Truth, draws: &mut Draws) {
    let kept = (-DT_S / receiver.slow_time_s).exp();
    let new = receiver.slow_sigma_m * (1.0 - kept * kept).sqrt();
    truth.slow = truth.slow.map(|it| it * kept + new * draws.normal());
}

/// A fix of the middle of an interval.
fn fix(receiver: &Receiver, way: &Way, truth: &Truth, draws: &mut Draws) -> Fix {
    let antenna = truth.antenna(receiver.lever_m);
    let noise: [f64; 2] = draws.normals();
    Fix {
        receiver: 0,
        stamp_s: 0.5 * (way.start_s + way.end_s) + receiver.delay_s,
        position: [0, 1]
            .map(|it: usize| antenna[it] + truth.slow[it] + receiver.sigma_m * noise[it]),
    }
}
