//! A filter for each pair of MR.CLAM's robots, and what it publishes.

use coloc_estimator::{RobotId, Span, Stamp};
use coloc_track::comparator::{Printed, Traditional};
use coloc_track::manager::Odometry;
use coloc_track::{
    Config, Gates, Linear, Manager, Published, Rate, Reading, Rules, Seen, Sensor, Sensors,
    Sighting, SlowErrors, State, Status, Track, publish,
};
use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use coloc_estimator::angle::wrap;

use super::recorded::{Recorded, Subject};
use super::{CHI2_2_95, CHI2_3_95, FORWARD, Form, REFERENCE_S, TURNING};
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use crate::world::World;

/// The errors are taken every so many steps of the grid.
const EVERY: usize = 5;

/// What is slow of a camera's errors.
const SLOW: SlowErrors = SlowErrors {
    range_sigma: 0.045,
    range_tau_s: 6.0,
    bearing_sigma: 0.013,
    bearing_tau_s: 10.0,
};

/// A row of the table.
#[derive(Copy, Clone, Debug)]
struct Method {
    name: &'static str,
    filter: Filter,
    reciprocal: bool,
    /// Of each recording: share published, RMS of the heading, share of the published outside, of the confirmed positions outside.
    reference: [[f64; 4]; 2],
    /// What is published must be honest.
    is_honest: bool,
}

#[derive(Copy, Clone, Debug, PartialEq)]
enum Filter {
    Printed,
    Traditional,
    Linear,
    LinearSlow,
}

const METHODS: [Method; 5] = [
    Method {
        name: "PLKF as printed",
        filter: Filter::Printed,
        reciprocal: false,
        reference: [[0.277, 0.80, 0.38, 0.23], [0.258, 0.87, 0.36, 0.21]],
        is_honest: false,
    },
    Method {
        name: "traditional EKF",
        filter: Filter::Traditional,
        reciprocal: false,
        reference: [[0.277, 0.80, 0.38, 0.23], [0.260, 0.87, 0.36, 0.21]],
        is_honest: false,
    },
    Method {
        name: "linear start",
        filter: Filter::Linear,
        reciprocal: false,
        reference: [[0.116, 0.22, 0.17, 0.19], [0.111, 0.27, 0.17, 0.14]],
        is_honest: false,
    },
    Method {
        name: "linear start, slow errors as states",
        filter: Filter::LinearSlow,
        reciprocal: false,
        reference: [[0.076, 0.19, 0.017, 0.045], [0.066, 0.18, 0.024, 0.039]],
        is_honest: true,
    },
    Method {
        name: "the same with reciprocal bearings",
        filter: Filter::LinearSlow,
        reciprocal: true,
        reference: [[0.230, 0.14, 0.034, 0.050], [0.289, 0.10, 0.011, 0.035]],
        is_honest: true,
    },
];

/// Within this of what a row is known to come to; there is no chance in it.
const WITHIN: f64 = 0.10;
/// Half a unit of the last digit of the figures that are known.
const ROUNDING: [f64; 4] = [0.0005, 0.005, 0.005, 0.005];
/// No more of what is published honestly is outside of its 95 %.
const MOST_OUTSIDE: f64 = 0.05;

/// What is told of all pairs of a recording.
#[derive(Copy, Clone, Debug, Default)]
struct Sums {
    confirmed: f64,
    position_outside: f64,
    published: f64,
    heading_squares: f64,
    heading_variances: f64,
    pose_outside: f64,
}

impl Sums {
    fn push(&mut self, track: &Track, truth: &Vector3<f64>) {
        if track.status == Status::Tentative {
            return;
        }
        let error = track.state.position() - truth.xy();
        self.confirmed += 1.0;
        self.position_outside += f64::from(u8::from(nees(&track.state, &error) > CHI2_2_95));
        if let Published::Pose(state) = publish(track) {
            self.push_pose(&state, truth);
        }
    }

    fn push_pose(&mut self, state: &State, truth: &Vector3<f64>) {
        let ([x, y, phi], covariance) = state.relative_pose();
        let error = Vector3::new(x - truth.x, y - truth.y, wrap(phi - truth.z));
        let nees = covariance
            .cholesky()
            .map_or(f64::INFINITY, |root| error.dot(&root.solve(&error)));
        self.published += 1.0;
        self.heading_squares += error.z * error.z;
        self.heading_variances += covariance.m33;
        self.pose_outside += f64::from(u8::from(nees > CHI2_3_95));
    }

    fn plus(self, b: Self) -> Self {
        Self {
            confirmed: self.confirmed + b.confirmed,
            position_outside: self.position_outside + b.position_outside,
            published: self.published + b.published,
            heading_squares: self.heading_squares + b.heading_squares,
            heading_variances: self.heading_variances + b.heading_variances,
            pose_outside: self.pose_outside + b.pose_outside,
        }
    }

    /// As a [`Method::reference`].
    fn figures(&self) -> [f64; 4] {
        [
            self.published / self.confirmed,
            (self.heading_squares / self.published).sqrt(),
            self.pose_outside / self.published,
            self.position_outside / self.confirmed,
        ]
    }
}

fn nees(state: &State, error: &Vector2<f64>) -> f64 {
    state
        .position_covariance()
        .cholesky()
        .map_or(f64::INFINITY, |root| error.dot(&root.solve(error)))
}

impl Method {
    fn sensors(&self) -> Sensors {
        let slow = (self.filter == Filter::LinearSlow).then_some(SLOW);
        let camera = Sensor {
            slow,
            ..Sensor::default()
        };
        Sensors::new(&[camera]).unwrap_or_default()
    }

    fn config(&self) -> Config {
        let gates = match self.filter {
            Filter::Printed | Filter::Traditional => Gates::OPEN,
            Filter::Linear | Filter::LinearSlow => Gates::default(),
        };
        Config {
            gates,
            ..Config::default()
        }
    }

    /// Variances of range and bearing.
    fn white(&self, range_m: f64) -> [f64; 2] {
        let [relative, bearing] = match self.filter {
            Filter::LinearSlow => [0.006, 0.006],
            _ => [SLOW.range_sigma, 0.014],
        };
        let along = relative * range_m;
        [along * along + 0.005 * 0.005, bearing * bearing]
    }

    /// What `observer` is given of a recording, in its order.
    fn given(&self, recorded: &Recorded, observer: usize) -> Vec<Sighting> {
        let number = |it: usize| RobotId(u16::try_from(it).unwrap_or(u16::MAX));
        let all = recorded.among_robots().enumerate();
        let given = all.filter_map(|(sequence, it)| {
            let Subject::Robot(subject) = it.subject else {
                return None;
            };
            let seen = if it.observer == observer {
                Seen::Neighbour {
                    id: Some(number(subject)),
                    sensor: 0,
                    reading: Reading::RangeBearing {
                        range_m: it.range_m,
                        bearing_rad: it.bearing_rad,
                        white: self.white(it.range_m),
                    },
                }
            } else if subject == observer && self.reciprocal {
                Seen::Reciprocal {
                    id: number(it.observer),
                    bearing_rad: it.bearing_rad,
                    variance: 0.006 * 0.006 + SLOW.bearing_sigma * SLOW.bearing_sigma,
                }
            } else {
                return None;
            };
            Some(Sighting {
                stamp: at(it.time_s),
                sequence: sequence as u64,
                seen,
            })
        });
        given.collect()
    }

    fn run(&self, recorded: &Recorded, observer: usize) -> Sums {
        match self.filter {
            Filter::Printed => self.run_by(recorded, observer, Printed),
            Filter::Traditional => self.run_by(recorded, observer, Traditional),
            Filter::Linear | Filter::LinearSlow => self.run_by(recorded, observer, Linear),
        }
    }

    fn run_by(&self, recorded: &Recorded, observer: usize, rules: impl Rules) -> Sums {
        let (world, storage) = (&recorded.world, vec![None; world_size(recorded)]);
        let (config, sensors) = (self.config(), self.sensors());
        let mut manager = Manager::with_rules(config, sensors, at(0.0), storage, rules);
        let mut given = self.given(recorded, observer);
        let (mut rest, mut sums) = (given.as_mut_slice(), Sums::default());
        for step in 1..recorded.steps {
            let now = at(world.time_s(step) - world.start_s());
            let count = rest.iter().take_while(|it| it.stamp <= now).count();
            let (image, later) = rest.split_at_mut(count);
            rest = later;
            let rates: Vec<_> = (0..world.robots())
                .map(|robot| rate(world.odometry(step - 1, robot)))
                .collect();
            let neighbours: Vec<_> = (0u16..).map(RobotId).zip(rates.iter().copied()).collect();
            let odometry = Odometry {
                observer: Some(rates[observer]),
                neighbours: &neighbours,
            };
            manager.step(now, &odometry, image, |_, _| ());
            if step % EVERY == 0 {
                for track in manager.tracks() {
                    if let Some(truth) = relative(recorded, step, observer, track.id) {
                        sums.push(track, &truth);
                    }
                }
            }
        }
        sums
    }
}

fn world_size(recorded: &Recorded) -> usize {
    recorded.world.robots()
}

fn at(time_s: f64) -> Stamp {
    Stamp::default() + Span::from_seconds(time_s)
}

pub(super) fn rate([v, omega]: [f64; 2]) -> Rate {
    let variances = Vector3::new(FORWARD * v * v, 0.0, TURNING);
    Rate {
        velocity: Vector3::new(v, 0.0, omega),
        covariance_per_s: Matrix3::from_diagonal(&variances) * REFERENCE_S,
    }
}

/// Where the one truly is to the other.
fn relative(
    recorded: &Recorded,
    step: usize,
    observer: usize,
    id: RobotId,
) -> Option<Vector3<f64>> {
    let own = recorded.world.truth(step, observer)?;
    let seen = recorded.world.truth(step, usize::from(id.0))?;
    let (sin, cos) = own.phi.sin_cos();
    let (dx, dy) = (seen.x - own.x, seen.y - own.y);
    Some(Vector3::new(
        cos * dx + sin * dy,
        cos * dy - sin * dx,
        wrap(seen.phi - own.phi),
    ))
}

/// Runs all rows.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let title = "Tracks of all pairs (MR.CLAM, the robots' own cameras)";
    let recordings = match form.recordings(title) {
        Ok(recordings) => recordings,
        Err(finding) => return finding,
    };
    let mut table = Table::new([
        "recording",
        "method",
        "published of confirmed time",
        "heading RMS (stated), rad",
        "published outside",
        "confirmed position outside",
    ]);
    let mut missed = Vec::new();
    for (index, recorded) in recordings.iter().enumerate() {
        for method in &METHODS {
            let sums = (0..world_size(recorded))
                .into_par_iter()
                .map(|observer| method.run(recorded, observer))
                .reduce(Sums::default, Sums::plus);
            let [published, heading, outside, position] = sums.figures();
            let stated = (sums.heading_variances / sums.published).sqrt();
            table.row([
                recorded.title(),
                method.name.into(),
                percent(published),
                format!("{} ({})", digits(heading), digits(stated)),
                percent(outside),
                percent(position),
            ]);
            judge(method, recorded, index, sums.figures(), &mut missed);
        }
    }
    Finding {
        title: title.into(),
        text: table.text(),
        missed,
    }
}

fn judge(
    method: &Method,
    recorded: &Recorded,
    index: usize,
    figures: [f64; 4],
    missed: &mut Vec<String>,
) {
    let name = format!("recording {}, {}", recorded.title(), method.name);
    let [.., outside, _] = figures;
    if method.is_honest && outside > MOST_OUTSIDE {
        missed.push(format!(
            "{name}: {} of the published outside",
            percent(outside)
        ));
    }
    let known = method.reference[index].into_iter().zip(ROUNDING);
    for (found, (known, rounding)) in figures.into_iter().zip(known) {
        if (found - known).abs() > WITHIN * known + rounding {
            missed.push(format!("{name}: {found:.3} for {known}"));
        }
    }
}
