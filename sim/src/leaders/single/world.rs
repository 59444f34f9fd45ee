//! Where the robots are, and what they measure.

use coloc_estimator::assist::datum::Reading;
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::{Covariance2, Covariance3, Motion, Pose, RobotId};

use super::super::event::Readings;
use super::super::robot::Absolute;
use super::super::run::{START, Scene};
use crate::random::{Draws, Noise, Purpose};

/// The leader, and four children.
const ROBOTS: usize = 5;
const LEADER: [RobotId; 1] = [RobotId(0)];
const CHILDREN: [RobotId; 4] = [RobotId(1), RobotId(2), RobotId(3), RobotId(4)];

/// \[s\]
const STEP_S: f64 = 0.01;

/// How long the thesis's runs are.
pub(crate) const STEPS: usize = 90_000;

/// Farther away nobody is seen \[m\].
const SIGHT_M: f64 = 10.0;

/// σ of v, as a part of it, and of ω \[rad/s\], in each step.
const FORWARD: f64 = 0.05;
const TURNING: f64 = 5.0 * DEGREE;

/// Steps between the leader's fixes and headings.
const ABSOLUTE_EVERY: usize = 10;

/// Of the leader's receiver \[m\] and compass \[rad\].
const POSITION: f64 = 0.1;
const HEADING: f64 = 0.5 * DEGREE;

const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// How well and how often robots see.
pub(crate) struct Case {
    pub(crate) number: usize,
    /// σ of a sighting \[m, rad\].
    position: f64,
    heading: f64,
    /// Steps between events.
    every: usize,
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

/// The truth, step by step.
pub(crate) struct World(Vec<[Pose; ROBOTS]>);

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
    /// So many steps after the first moment.
    pub(crate) fn new(steps: usize) -> Self {
        let mut poses = first();
        let mut all = vec![poses];
        for _ in 0..steps {
            drive(&mut poses);
            all.push(poses);
        }
        Self(all)
    }

    fn steps(&self) -> usize {
        self.0.len().saturating_sub(1)
    }

    fn pose(&self, step: usize, robot: usize) -> &Pose {
        &self.0[step][robot]
    }
}

fn first() -> [Pose; ROBOTS] {
    let leader = Pose::new(10.0, 3.0, core::f64::consts::FRAC_PI_2);
    let mut poses = [leader; ROBOTS];
    for (pose, Circle([x, y], radius, angle, way)) in poses[1..].iter_mut().zip(&CIRCLES) {
        let (sin, cos) = libm::sincos(*angle);
        let heading = angle + way * core::f64::consts::FRAC_PI_2;
        *pose = Pose::new(x + radius * cos, y + radius * sin, heading);
    }
    poses
}

fn drive(poses: &mut [Pose; ROBOTS]) {
    for (robot, pose) in poses.iter_mut().enumerate() {
        let [v, omega] = velocity(robot);
        let (sin, cos) = libm::sincos(pose.phi);
        *pose = Pose::new(
            pose.x + STEP_S * v * cos,
            pose.y + STEP_S * v * sin,
            pose.phi + STEP_S * omega,
        );
    }
}

/// A run, with all its chance.
pub(crate) struct Sensors<'a> {
    world: &'a World,
    noise: Noise,
    case: &'a Case,
}

impl<'a> Sensors<'a> {
    pub(crate) fn new(world: &'a World, seed: u64, run: u16, case: &'a Case) -> Self {
        Self {
            world,
            noise: Noise::new(seed, run),
            case,
        }
    }

    fn draws(&self, purpose: Purpose, step: usize, robot: usize, other: usize) -> Draws {
        self.noise.draws(purpose, step, robot, other)
    }

    /// What one robot sees of another, if it is near enough.
    fn sighting(&self, step: usize, [observer, observed]: [usize; 2]) -> Option<Reading> {
        let (from, to) = (
            self.world.pose(step, observer),
            self.world.pose(step, observed),
        );
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

impl Scene for Sensors<'_> {
    fn dt_s(&self) -> f64 {
        STEP_S
    }

    fn steps(&self) -> usize {
        self.world.steps()
    }

    fn leaders(&self) -> &[RobotId] {
        &LEADER
    }

    fn children(&self) -> &[RobotId] {
        &CHILDREN
    }

    fn start(&self, robot: RobotId) -> Pose {
        let robot = usize::from(robot.0);
        let truth = self.world.pose(0, robot);
        let mut draws = self.draws(Purpose::Start, 0, robot, 0);
        let [x, y, phi] = START.map(|variance| variance.sqrt() * draws.normal());
        Pose::new(truth.x + x, truth.y + y, truth.phi + phi)
    }

    fn truth(&self, step: usize, robot: RobotId) -> Option<Pose> {
        Some(*self.world.pose(step, usize::from(robot.0)))
    }

    /// In ν and Q.
    fn motion(&self, step: usize, robot: RobotId) -> Motion {
        let robot = usize::from(robot.0);
        let mut draws = self.draws(Purpose::Odometry, step, robot, 0);
        let [v, omega] = velocity(robot);
        let sigma = FORWARD * v;
        let noise = Covariance2::diagonal([sigma * sigma, TURNING * TURNING]);
        Motion::Nonholonomic {
            velocity: [v + sigma * draws.normal(), omega + TURNING * draws.normal()],
            noise: noise.expect("variances"),
        }
    }

    fn absolute(&self, step: usize, leader: RobotId) -> Option<Absolute> {
        if !step.is_multiple_of(ABSOLUTE_EVERY) {
            return None;
        }
        let truth = self.world.pose(step, usize::from(leader.0));
        let mut draws = self.draws(Purpose::Fix, step, 0, 0);
        Some(Absolute {
            position: [truth.x, truth.y].map(|it| it + POSITION * draws.normal()),
            covariance: Covariance2::diagonal([POSITION * POSITION; 2]).expect("variances"),
            heading: truth.phi + HEADING * draws.normal(),
            variance: HEADING * HEADING,
        })
    }

    fn event(&self, step: usize) -> Option<(Slot, Readings)> {
        if !step.is_multiple_of(self.case.every) {
            return None;
        }
        let pairs = (0..ROBOTS).flat_map(|a| CHILDREN.map(|b| [a, usize::from(b.0)]));
        let pairs = pairs.filter(|[a, b]| a != b);
        let slot = i64::try_from(step / self.case.every).ok()?;
        let id = |robot| u16::try_from(robot).map_or(LEADER[0], RobotId);
        let readings = pairs.filter_map(|pair| Some((pair.map(id), self.sighting(step, pair)?)));
        Some((Slot(slot), readings.collect()))
    }
}
