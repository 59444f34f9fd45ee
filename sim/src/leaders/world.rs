//! Where the robots are, and what they measure.

use coloc_estimator::assist::datum::Reading;
use coloc_estimator::{Covariance2, Covariance3, Motion, Pose};

use crate::random::{Draws, Noise, Purpose};

/// The leader, and four children.
pub(crate) const ROBOTS: usize = 5;

/// \[s\]
pub(crate) const STEP_S: f64 = 0.01;

/// Farther away nobody is seen \[m\].
const SIGHT_M: f64 = 10.0;

/// σ of v, as a part of it, and of ω \[rad/s\], in each step.
const FORWARD: f64 = 0.05;
const TURNING: f64 = 5.0 * DEGREE;

/// Steps between the leader's fixes and headings.
pub(crate) const ABSOLUTE_EVERY: usize = 10;

/// Of the leader's receiver \[m\] and compass \[rad\].
const POSITION: f64 = 0.1;
const HEADING: f64 = 0.5 * DEGREE;

/// Variances of the first errors.
pub(crate) const START: [f64; 3] = [1e-4, 1e-4, 1e-6];

const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// How well and how often robots see.
pub(crate) struct Case {
    pub(crate) number: usize,
    /// σ of a sighting \[m, rad\].
    position: f64,
    heading: f64,
    /// Steps between events.
    pub(crate) every: usize,
}

pub(crate) const CASES: [Case; 4] = [
    Case::new(1, 0.05, 1.0, 10),
    Case::new(2, 0.05, 1.0, 100),
    Case::new(3, 0.15, 3.0, 10),
    Case::new(4, 0.15, 3.0, 100),
];

impl Case {
    const fn new(number: usize, position: f64, degrees: f64, every: usize) -> Self {
        Self {
            number,
            position,
            heading: degrees * DEGREE,
            every,
        }
    }

    fn covariance(&self) -> Covariance3 {
        let (p, h) = (self.position * self.position, self.heading * self.heading);
        Covariance3::diagonal([p, p, h]).expect("variances")
    }
}

/// A way in circles: centre, radius, first angle, and which way.
struct Circle([f64; 2], f64, f64, f64);

const SPEED: f64 = 0.3;

const CIRCLES: [Circle; 4] = [
    Circle([10.0, 9.5], 2.0, 0.0, 1.0),
    Circle([6.5, 12.5], 3.0, 1.0, 1.0),
    Circle([13.5, 12.5], 3.0, 2.0, -1.0),
    Circle([10.0, 16.5], 1.5, 3.0, 1.0),
];

/// The truth.
#[derive(Copy, Clone)]
pub(crate) struct World {
    pub(crate) poses: [Pose; ROBOTS],
}

/// What robots do: v and ω.
fn velocity(robot: usize) -> [f64; 2] {
    match robot.checked_sub(1) {
        None => [0.0; 2],
        Some(child) => {
            let Circle(_, radius, _, way) = CIRCLES[child];
            [SPEED, way * SPEED / radius]
        }
    }
}

impl World {
    pub(crate) fn new() -> Self {
        let leader = Pose::new(10.0, 3.0, core::f64::consts::FRAC_PI_2);
        let mut poses = [leader; ROBOTS];
        for (pose, Circle([x, y], radius, angle, way)) in poses[1..].iter_mut().zip(&CIRCLES) {
            let (sin, cos) = libm::sincos(*angle);
            let heading = angle + way * core::f64::consts::FRAC_PI_2;
            *pose = Pose::new(x + radius * cos, y + radius * sin, heading);
        }
        Self { poses }
    }

    pub(crate) fn drive(&mut self) {
        for (robot, pose) in self.poses.iter_mut().enumerate() {
            let [v, omega] = velocity(robot);
            let (sin, cos) = libm::sincos(pose.phi);
            *pose = Pose::new(
                pose.x + STEP_S * v * cos,
                pose.y + STEP_S * v * sin,
                pose.phi + STEP_S * omega,
            );
        }
    }
}

/// All chance of a run.
pub(crate) struct Sensors<'a> {
    noise: Noise,
    case: &'a Case,
}

impl<'a> Sensors<'a> {
    pub(crate) fn new(seed: u64, run: u16, case: &'a Case) -> Self {
        Self {
            noise: Noise::new(seed, run),
            case,
        }
    }

    fn draws(&self, purpose: Purpose, step: usize, robot: usize, other: usize) -> Draws {
        self.noise.draws(purpose, step, robot, other)
    }

    /// Where a robot believes to be at first.
    pub(crate) fn start(&self, robot: usize, truth: &Pose) -> Pose {
        let mut draws = self.draws(Purpose::Start, 0, robot, 0);
        let [x, y, phi] = START.map(|variance| variance.sqrt() * draws.normal());
        Pose::new(truth.x + x, truth.y + y, truth.phi + phi)
    }

    /// What the wheels say of a step, in ν and Q.
    pub(crate) fn motion(&self, step: usize, robot: usize) -> Motion {
        let mut draws = self.draws(Purpose::Odometry, step, robot, 0);
        let [v, omega] = velocity(robot);
        let sigma = FORWARD * v;
        let noise = Covariance2::diagonal([sigma * sigma, TURNING * TURNING]);
        Motion::Nonholonomic {
            velocity: [v + sigma * draws.normal(), omega + TURNING * draws.normal()],
            noise: noise.expect("variances"),
        }
    }

    /// The leader's fix and heading, each with its noise.
    pub(crate) fn absolute(&self, step: usize, truth: &Pose) -> ([f64; 2], Covariance2, f64, f64) {
        let mut draws = self.draws(Purpose::Fix, step, 0, 0);
        let at = [truth.x, truth.y].map(|it| it + POSITION * draws.normal());
        let noise = Covariance2::diagonal([POSITION * POSITION; 2]).expect("variances");
        let heading = truth.phi + HEADING * draws.normal();
        (at, noise, heading, HEADING * HEADING)
    }

    /// What one robot sees of another, if it is near enough.
    pub(crate) fn sighting(
        &self,
        step: usize,
        world: &World,
        [observer, observed]: [usize; 2],
    ) -> Option<Reading> {
        let (from, to) = (&world.poses[observer], &world.poses[observed]);
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        if libm::hypot(dx, dy) > SIGHT_M {
            return None;
        }
        let (sin, cos) = libm::sincos(from.phi);
        let mut draws = self.draws(Purpose::RelativePose, step, observer, observed);
        let Case {
            position, heading, ..
        } = *self.case;
        Some(Reading {
            relative: Pose::new(
                cos * dx + sin * dy + position * draws.normal(),
                cos * dy - sin * dx + position * draws.normal(),
                to.phi - from.phi + heading * draws.normal(),
            ),
            covariance: self.case.covariance(),
        })
    }
}
