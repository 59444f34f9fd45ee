//! The robots of MR.CLAM 1, and what they would have measured.

use std::path::Path;

use coloc_estimator::assist::datum::Reading;
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::{Covariance2, Covariance3, Motion, Pose, RobotId};

use super::super::event::Readings;
use super::super::robot::Absolute;
use super::super::run::{START, Scene};
use crate::mrclam::{GridWorld, Recording};
use crate::random::{Draws, Noise, Purpose};
use crate::sensors::relative;
use crate::world::World as _;

/// By their numbers in the recording.
pub(crate) const LEADERS: [RobotId; 2] = [RobotId(1), RobotId(3)];
pub(crate) const CHILDREN: [RobotId; 3] = [RobotId(2), RobotId(4), RobotId(5)];

/// Farther away nobody is seen \[m\].
const SIGHT_M: f64 = 3.0;

/// Steps between events.
const EVERY: usize = 10;

/// Of a sample of the wheels, however fast: v \[m²/s²\] and ω \[rad²/s²\].
const WHEELS: [f64; 2] = [5.075, 0.345];

/// Of a sighting \[m, m, rad\].
const SIGHT: [f64; 3] = [0.05, 0.05, DEGREE];

const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// How good leaders' receivers and compasses are.
pub(crate) struct Case {
    pub(crate) number: usize,
    /// σ \[m, rad\].
    position: f64,
    heading: f64,
    /// Steps between fixes.
    every: usize,
}

pub(crate) const CASES: [Case; 4] = [
    Case::new(5, 0.1, 0.5, 10),
    Case::new(6, 0.1, 0.5, 50),
    Case::new(7, 0.3, 1.5, 10),
    Case::new(8, 0.3, 1.5, 50),
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
}

/// The recording on its grid, straight lines over the gaps of its truth, as its authors' sampler does it.
pub(crate) struct World {
    grid: GridWorld,
    steps: usize,
}

impl World {
    pub(crate) fn read(data: &Path) -> Result<Self, String> {
        let recording = Recording::load(&data.join("mrclam1"));
        let recording = recording.map_err(|error| error.to_string())?;
        let grid = recording.resample_bridging(f64::INFINITY);
        let numbers: Vec<_> = (0..grid.robots())
            .filter_map(|it| grid.number(it))
            .collect();
        if numbers != [1, 2, 3, 4, 5] {
            return Err(format!("robots 1 to 5 are needed, {numbers:?} are there"));
        }
        let steps = grid.steps().saturating_sub(1);
        Ok(Self { grid, steps })
    }

    /// No more than so many steps.
    pub(crate) fn shortened(self, most: impl FnOnce(usize) -> usize) -> Self {
        let steps = most(self.steps);
        Self { steps, ..self }
    }

    pub(crate) fn steps(&self) -> usize {
        self.steps
    }

    /// Since the first moment \[s\].
    pub(crate) fn time_s(&self, step: usize) -> f64 {
        self.grid.time_s(step) - self.grid.start_s()
    }

    fn pose(&self, step: usize, robot: RobotId) -> Option<Pose> {
        self.grid.truth(step, place(robot))
    }
}

fn place(robot: RobotId) -> usize {
    usize::from(robot.0).saturating_sub(1)
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

    fn draws(&self, purpose: Purpose, step: usize, [robot, other]: [RobotId; 2]) -> Draws {
        self.noise.draws(purpose, step, place(robot), place(other))
    }

    fn sighting(&self, step: usize, pair: [RobotId; 2]) -> Option<Reading> {
        let [from, to] = pair.map(|it| self.world.pose(step, it));
        let exact = relative(&from?, &to?);
        if libm::hypot(exact.x, exact.y) > SIGHT_M {
            return None;
        }
        let mut draws = self.draws(Purpose::RelativePose, step, pair);
        let [x, y, phi] = SIGHT.map(|sigma| sigma * draws.normal());
        Some(Reading {
            relative: Pose::new(exact.x + x, exact.y + y, exact.phi + phi),
            covariance: Covariance3::diagonal(SIGHT.map(|sigma| sigma * sigma)).ok()?,
        })
    }
}

impl Scene for Sensors<'_> {
    fn dt_s(&self) -> f64 {
        self.world.grid.dt_s()
    }

    fn steps(&self) -> usize {
        self.world.steps
    }

    fn leaders(&self) -> &[RobotId] {
        &LEADERS
    }

    fn children(&self) -> &[RobotId] {
        &CHILDREN
    }

    fn start(&self, robot: RobotId) -> Pose {
        let truth = self.world.grid.initial(place(robot)).unwrap_or_default();
        let mut draws = self.draws(Purpose::Start, 0, [robot; 2]);
        let [x, y, phi] = START.map(|variance| variance.sqrt() * draws.normal());
        Pose::new(truth.x + x, truth.y + y, truth.phi + phi)
    }

    fn truth(&self, step: usize, robot: RobotId) -> Option<Pose> {
        self.world.pose(step, robot)
    }

    fn motion(&self, step: usize, robot: RobotId) -> Motion {
        Motion::Nonholonomic {
            velocity: self
                .world
                .grid
                .odometry(step.saturating_sub(1), place(robot)),
            noise: Covariance2::diagonal(WHEELS).expect("variances"),
        }
    }

    fn absolute(&self, step: usize, leader: RobotId) -> Option<Absolute> {
        let Case {
            position,
            heading,
            every,
            ..
        } = *self.case;
        if !step.is_multiple_of(every) {
            return None;
        }
        let truth = self.world.pose(step, leader)?;
        let mut draws = self.draws(Purpose::Fix, step, [leader; 2]);
        Some(Absolute {
            position: [truth.x, truth.y].map(|it| it + position * draws.normal()),
            covariance: Covariance2::diagonal([position * position; 2]).ok()?,
            heading: truth.phi + heading * draws.normal(),
            variance: heading * heading,
        })
    }

    fn event(&self, step: usize) -> Option<(Slot, Readings)> {
        if !step.is_multiple_of(EVERY) {
            return None;
        }
        let observers = LEADERS.into_iter().chain(CHILDREN);
        let pairs = observers.flat_map(|a| CHILDREN.map(|b| [a, b]));
        let pairs = pairs.filter(|[a, b]| a != b);
        let readings = pairs.filter_map(|pair| Some((pair, self.sighting(step, pair)?)));
        Some((Slot(i64::try_from(step / EVERY).ok()?), readings.collect()))
    }
}
