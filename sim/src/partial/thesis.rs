//! The thesis' simulation of its tracker, §5.3, in the plane: one observer, one neighbour, and four ways to begin.
//!
//! Half a minute, readings at 10 Hz (7 mm, 3.6 mrad), odometry of both at 100 Hz (5 %, 5°/s). Counted is with how many readings the RMS
//! error over the runs is below 1.05 times the largest of a filter that begins with the truth, of the heading and of the position.

use std::f64::consts::PI;

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use coloc_track::comparator::{Printed, Traditional};
use coloc_track::{
    Core, Gates, Heading, Increment, Linear, Reading, Rules, Sensor, Sensors, State,
};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::{CHI2_2_95, CHI2_3_95, Form};
use crate::campaign::Finding;
use crate::honest::table::{Table, percent};
use crate::random::{Draws, Noise, Purpose};

/// Of the whole campaign.
const RUNS: u16 = 1000;
/// Of the reference.
const SET: usize = 50;
const DT_S: f64 = 0.01;
const STEPS: usize = 3000;
const EVERY: usize = 10;
const READINGS: usize = STEPS / EVERY;
const RANGE_SIGMA_M: f64 = 0.007;
const BEARING_SIGMA: f64 = 0.0036;
/// Of v, relative, and of ω.
const VELOCITY_SIGMA: f64 = 0.05;
const TURNING_SIGMA: f64 = 5.0 * PI / 180.0;
/// Of a position that is not known \[m²\], and of a pose that is.
const ANYWHERE: f64 = 4.0;
const KNOWN: [f64; 3] = [1e-4, 1e-4, 1e-4];
/// Of a heading that is not known.
const ANY_HEADING: f64 = PI * PI / 3.0;
/// Reached where the error is below this part of a known start's largest.
const REACHED: f64 = 1.05;
/// A heading is one once it is known to this.
const READY: f64 = 0.35;

/// What is known at the start.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Begins {
    /// The truth.
    Known,
    /// A wrong pose.
    Unknown,
    /// The first reading's position, and a wrong heading.
    Position,
    /// The heading, and a wrong position.
    Heading,
    /// The first reading's position, and no heading.
    Linear,
}

/// What the errors of all runs come to, reading by reading.
#[derive(Clone)]
struct Course {
    heading: Vec<f64>,
    position: Vec<f64>,
    outside: f64,
    /// Standard deviation of that from one set of [`SET`] runs to the next.
    of_set: f64,
}

/// One world: the truth at each reading, and what is measured.
struct World {
    start: Vector3<f64>,
    /// Velocities as measured, `[v, ω]`, of observer and neighbour.
    odometry: Vec<[[f64; 2]; 2]>,
    truth: Vec<Vector3<f64>>,
    readings: Vec<[f64; 2]>,
    guess: Vector3<f64>,
}

#[allow(clippy::cast_precision_loss)] // Thousands of steps.
fn velocities(step: usize) -> [[f64; 2]; 2] {
    let t = step as f64 * DT_S;
    let observer = [0.3 + 0.1 * (0.5 * t).sin(), 0.25 * (0.3 * t).sin()];
    let seen = [0.4 + 0.1 * (0.4 * t).cos(), 0.2 + 0.2 * (0.2 * t).sin()];
    [observer, seen]
}

fn increment([v, omega]: [f64; 2], is_noisy: bool) -> Increment {
    let (along, turn) = (VELOCITY_SIGMA * v * DT_S, TURNING_SIGMA * DT_S);
    let variances = Vector3::new(along * along, 0.0, turn * turn);
    let share = f64::from(u8::from(is_noisy));
    Increment {
        displacement: Vector3::new(v, 0.0, omega) * DT_S,
        covariance: Matrix3::from_diagonal(&variances) * share,
    }
}

fn anywhere(draws: &mut Draws) -> Vector3<f64> {
    Vector3::new(
        draws.uniform(2.0, 6.0),
        draws.uniform(-3.0, 3.0),
        draws.uniform(-PI, PI),
    )
}

impl World {
    fn new(seed: u64, run: u16) -> Self {
        let noise = Noise::new(seed, run);
        let mut draws = noise.draws(Purpose::Start, 0, 0, 0);
        let (start, guess) = (anywhere(&mut draws), anywhere(&mut draws));
        let mut state = State {
            core: Core::Heading,
            ..State::default()
        };
        state.mean.fixed_rows_mut::<3>(0).copy_from(&start);
        let (mut odometry, mut truth, mut readings) = (Vec::new(), Vec::new(), Vec::new());
        for step in 0..STEPS {
            let velocity = velocities(step);
            let [own, other] = velocity.map(|it| increment(it, false));
            state.predict(&own, &other, std::iter::empty(), 0.0);
            let mut draws = noise.draws(Purpose::Odometry, step, 0, 0);
            odometry.push(velocity.map(|[v, omega]| {
                let [a, b] = draws.normals();
                [v * (1.0 + VELOCITY_SIGMA * a), omega + TURNING_SIGMA * b]
            }));
            if (step + 1).is_multiple_of(EVERY) {
                let [a, b] = noise.draws(Purpose::RelativePose, step, 0, 0).normals();
                let at = state.position();
                truth.push(Vector3::new(at.x, at.y, state.mean[2]));
                readings.push([
                    at.norm() + RANGE_SIGMA_M * a,
                    at.y.atan2(at.x) + BEARING_SIGMA * b,
                ]);
            }
        }
        Self {
            start,
            odometry,
            truth,
            readings,
            guess,
        }
    }

    /// The state before the first step; `None`: it begins with the first reading.
    fn begun(&self, begins: Begins) -> Option<State> {
        let (mean, variances) = match begins {
            Begins::Known => (self.start, KNOWN),
            Begins::Unknown => (self.guess, [ANYWHERE, ANYWHERE, ANY_HEADING]),
            Begins::Heading => (
                Vector3::new(self.guess.x, self.guess.y, self.start.z),
                [ANYWHERE, ANYWHERE, KNOWN[2]],
            ),
            Begins::Position | Begins::Linear => return None,
        };
        let mut state = State {
            core: Core::Heading,
            ..State::default()
        };
        state.mean.fixed_rows_mut::<3>(0).copy_from(&mean);
        for (place, variance) in variances.into_iter().enumerate() {
            state.covariance[(place, place)] = variance;
        }
        Some(state)
    }

    /// The errors of a filter, and whether they are outside, reading by reading.
    fn run(&self, rules: &impl Rules, begins: Begins) -> Vec<(Vector3<f64>, bool)> {
        let sensors = Sensors::new(&[Sensor {
            mount: Pose::default(),
            slow: None,
        }])
        .unwrap_or_default();
        let mut state = self.begun(begins);
        let mut errors = Vec::new();
        for (index, (reading, truth)) in self.readings.iter().zip(&self.truth).enumerate() {
            for velocity in &self.odometry[EVERY * index..EVERY * (index + 1)] {
                let [own, other] = velocity.map(|it| increment(it, true));
                if let Some(state) = &mut state {
                    rules.predict(state, &own, &other, &sensors, DT_S);
                }
            }
            let learnt = self.learn(rules, state.as_ref(), *reading, &sensors, begins);
            errors.push(held(&learnt, truth));
            state = Some(learnt);
        }
        errors
    }

    fn learn(
        &self,
        rules: &impl Rules,
        state: Option<&State>,
        [range_m, bearing_rad]: [f64; 2],
        sensors: &Sensors,
        begins: Begins,
    ) -> State {
        let white = [RANGE_SIGMA_M * RANGE_SIGMA_M, BEARING_SIGMA * BEARING_SIGMA];
        let Some(mut state) = state.copied() else {
            let mut begun = rules.start(range_m, bearing_rad, white, sensors, 0);
            if begins == Begins::Position {
                begun.mean[2] = self.guess.z;
            }
            return begun;
        };
        let reading = Reading::RangeBearing {
            range_m,
            bearing_rad,
            white,
        };
        rules.update(&mut state, &reading, sensors, 0, &Gates::OPEN);
        if state.core == Core::Linear && state.heading_of().is_ready(READY) {
            state.convert();
        }
        state
    }
}

/// The error of a state, and whether it is outside of its 95 %: of the position alone where there is no heading.
fn held(state: &State, truth: &Vector3<f64>) -> (Vector3<f64>, bool) {
    let position = state.position() - truth.xy();
    match state.core {
        Core::Heading => {
            let (_, covariance) = state.relative_pose();
            let error = Vector3::new(position.x, position.y, wrap(state.mean[2] - truth.z));
            let nees = covariance
                .cholesky()
                .map_or(f64::INFINITY, |root| error.dot(&root.solve(&error)));
            (error, nees > CHI2_3_95)
        }
        Core::Linear => {
            let Heading { heading_rad, .. } = state.heading_of();
            let nees = state
                .position_covariance()
                .cholesky()
                .map_or(f64::INFINITY, |root| position.dot(&root.solve(&position)));
            let error = Vector3::new(position.x, position.y, wrap(heading_rad - truth.z));
            (error, nees > CHI2_2_95)
        }
    }
}

impl Course {
    fn of(worlds: &[World], rules: &(impl Rules + Sync), begins: Begins) -> Self {
        let mut course = Self {
            heading: vec![0.0; READINGS],
            position: vec![0.0; READINGS],
            outside: 0.0,
            of_set: f64::NAN,
        };
        let runs: Vec<_> = worlds.par_iter().map(|it| it.run(rules, begins)).collect();
        course.of_set = deviation(&runs);
        for run in runs {
            for (index, (error, outside)) in run.into_iter().enumerate() {
                course.heading[index] += error.z * error.z;
                course.position[index] += error.x * error.x + error.y * error.y;
                course.outside += f64::from(u8::from(outside));
            }
        }
        #[allow(clippy::cast_precision_loss)] // Tens of worlds, hundreds of readings.
        let (runs, readings) = (worlds.len() as f64, READINGS as f64);
        for sums in [&mut course.heading, &mut course.position] {
            for sum in sums.iter_mut() {
                *sum = (*sum / runs).sqrt();
            }
        }
        course.outside /= runs * readings;
        course
    }
}

/// Standard deviation of the share outside from one set of [`SET`] runs to the next; NaN of fewer than two sets.
#[allow(clippy::cast_precision_loss)] // Tens of sets, thousands of readings.
fn deviation(runs: &[Vec<(Vector3<f64>, bool)>]) -> f64 {
    let share = |set: &[Vec<(Vector3<f64>, bool)>]| {
        let outside = set.iter().flatten().filter(|(_, outside)| *outside).count();
        outside as f64 / (set.len() * READINGS) as f64
    };
    let shares: Vec<f64> = runs.chunks_exact(SET).map(share).collect();
    let count = shares.len() as f64;
    let mean = shares.iter().sum::<f64>() / count;
    let squares: f64 = shares.iter().map(|it| (it - mean) * (it - mean)).sum();
    (squares / (count - 1.0)).sqrt()
}

/// With how many readings `errors` are below what `known` come to at most; `None`: never.
fn reached(errors: &[f64], known: &[f64]) -> Option<usize> {
    let limit = REACHED * known.iter().copied().fold(0.0, f64::max);
    errors.iter().position(|it| *it < limit).map(|it| it + 1)
}

/// A way to begin, and the share outside that each filter is known to come to.
struct Row {
    name: &'static str,
    begins: Begins,
    printed: f64,
    traditional: f64,
}

const ROWS: [Row; 3] = [
    Row {
        name: "nothing known",
        begins: Begins::Unknown,
        printed: 0.206,
        traditional: 0.268,
    },
    Row {
        name: "position first, heading unknown",
        begins: Begins::Position,
        printed: 0.208,
        traditional: 0.209,
    },
    Row {
        name: "heading known, position not",
        begins: Begins::Heading,
        printed: 0.077,
        traditional: 0.183,
    },
];

/// What the linear start is known to come to.
const LINEAR_OUTSIDE: f64 = 0.051;
/// Within this of a known share, as points, of [`RUNS`]; of fewer what chance allows beside it.
const WITHIN: f64 = 0.03;
const CHANCE: f64 = 0.05;
/// The linear start is so many times as fast, at least.
const SOONER: usize = 5;

/// Runs it.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let runs = RUNS.min(form.runs);
    let within = if runs < RUNS { WITHIN + CHANCE } else { WITHIN };
    let worlds: Vec<World> = (0..runs)
        .into_par_iter()
        .map(|run| World::new(form.seed, run))
        .collect();
    let known = Course::of(&worlds, &Printed, Begins::Known);
    let mut table = Table::new([
        "start",
        "filter",
        "readings until the heading is known",
        "the position",
        "outside",
        "of fifty runs ±",
    ]);
    let (mut missed, mut rivals) = (Vec::new(), Vec::new());
    let mut tell = |name: &str, filter: &str, course: &Course, stated: f64| {
        let heading = reached(&course.heading, &known.heading);
        let number = |it: Option<usize>| it.map_or("never".into(), |it| it.to_string());
        let position = number(reached(&course.position, &known.position));
        table.row([
            name.into(),
            filter.into(),
            number(heading),
            position,
            percent(course.outside),
            if course.of_set.is_nan() {
                "–".into()
            } else {
                percent(course.of_set)
            },
        ]);
        if (course.outside - stated).abs() > within {
            missed.push(format!(
                "{name}, {filter}: {} outside",
                percent(course.outside)
            ));
        }
        heading.unwrap_or(READINGS)
    };
    for row in &ROWS {
        let printed = Course::of(&worlds, &Printed, row.begins);
        let traditional = Course::of(&worlds, &Traditional, row.begins);
        let readings = [
            tell(row.name, "PLKF as printed", &printed, row.printed),
            tell(row.name, "traditional EKF", &traditional, row.traditional),
        ];
        if row.begins == Begins::Unknown {
            rivals.extend(readings);
        }
    }
    let linear = Course::of(&worlds, &Linear, Begins::Linear);
    let own = tell("nothing known", "linear start", &linear, LINEAR_OUTSIDE);
    if rivals.iter().any(|it| *it < SOONER * own) {
        missed.push(format!(
            "the linear start takes {own} readings, the others {rivals:?}"
        ));
    }
    Finding {
        title: "The thesis' simulation of its tracker, in the plane".into(),
        text: table.text(),
        missed,
    }
}
