//! Whole estimators through everything that they can be told, at random: what they publish and tell has the sign of a covariance.
//!
//! Fixes of antennas off the axle, headings and courses, slow errors, poses that are set, neighbours and sightings come in an order at
//! random, late at times, with covariances of any rank, to robots that know where they are and to robots that look for themselves.

use coloc_estimator::settings::Criterion;
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, FoundSettings, HeadingFix, HeadingOf, Measurement,
    NeighbourPose, OdometrySample, Origin, Parts, Pose, PoseSaid, PositionFix, RobotId, Settings,
    Sighting, Slot, SlowError, Span, Stamp, TickInputs, step,
};
use rayon::prelude::*;

use super::Form;
use super::signs::{LIFE, Tally, belief, decade, motion, plane, pose, spread};
use crate::random::{Draws, Noise, Purpose};

/// The history of one robot.
const SLOTS: usize = 64;

/// Of a variance, what every axis has by itself: nobody may say a pose of which something is certain.
const REGULAR: f64 = 1e-3;

pub(super) fn run(form: &Form) -> Tally {
    let noise = Noise::new(form.seed, 2);
    let robots = form.operations.div_ceil(2 * u64::from(LIFE));
    let robots = usize::try_from(robots).unwrap_or(usize::MAX);
    (0..robots)
        .into_par_iter()
        .map(|number| Robot::new(&noise, number).live())
        .reduce(Tally::default, Tally::and)
}

struct Robot {
    draws: Draws,
    estimator: Estimator<Vec<Slot>>,
    now_ms: i64,
    said: u64,
    tally: Tally,
    place: [usize; 2],
}

impl Robot {
    fn new(noise: &Noise, number: usize) -> Self {
        let mut draws = noise.draws(Purpose::Ordeal, 1, number & 0xffff, number >> 16);
        let start: Belief = belief(&mut draws);
        let estimator = Estimator::new(
            settings(&mut draws),
            at(0),
            start,
            vec![Slot::default(); SLOTS],
        );
        Self {
            draws,
            estimator,
            now_ms: 0,
            said: 0,
            tally: Tally::default(),
            place: [number, 0],
        }
    }

    fn live(mut self) -> Tally {
        for _ in 0..LIFE {
            self.place[1] += 1;
            self.tick();
        }
        self.tally
    }

    fn tick(&mut self) {
        let before_ms = self.now_ms;
        self.now_ms += 1 + self.whole(200.0);
        let mut said = Vec::new();
        if self.draws.happens(0.9) {
            let odometry = OdometrySample {
                source: 0,
                start: at(before_ms),
                stamp: at(self.now_ms),
                motion: motion(&mut self.draws),
            };
            said.push(odometry.into());
            self.tally.steps += 1;
        }
        self.hear(&mut said);
        let inputs = TickInputs {
            stamp: at(self.now_ms),
            measurements: &said,
        };
        let outputs = step(&mut self.estimator, &inputs);
        let parts = outputs.estimate.belief.parts;
        let told: Vec<Parts> = outputs.outgoing.iter().map(|it| it.parts).collect();
        self.tally.look(&parts, self.place);
        for parts in &told {
            self.told(parts);
        }
    }

    fn told(&mut self, parts: &Parts) {
        self.tally.conversions += 1;
        self.tally.look(parts, self.place);
        let [independent, dependent] =
            [parts.independent, parts.dependent].map(|part| part.to_row_major());
        if Parts::from_row_major(independent, dependent).is_err() {
            self.tally.refused += 1;
        }
    }

    fn hear(&mut self, said: &mut Vec<Measurement>) {
        let late_ms = if self.draws.happens(0.3) {
            self.whole(300.0)
        } else {
            0
        };
        let stamp = at((self.now_ms - late_ms).max(1));
        let here = self.estimator.extrapolated(at(self.now_ms)).belief.pose;
        if self.draws.happens(0.3) {
            said.extend(self.fix(stamp, &here));
        }
        if self.draws.happens(0.15) {
            said.push(self.heading(stamp, &here));
        }
        if self.draws.happens(0.05) {
            said.push(self.pose_said(stamp, &here));
        }
        if self.draws.happens(0.2) {
            said.push(self.neighbour(stamp, &here));
        }
        if self.draws.happens(0.2) {
            said.push(self.sighting(stamp));
        }
    }

    fn fix(&mut self, stamp: Stamp, here: &Pose) -> Option<Measurement> {
        let size = decade(&mut self.draws, -3.0, 2.0);
        let covariance: Covariance2 = plane(&mut self.draws, size);
        let [a, b] = self.draws.normals();
        let fix = PositionFix {
            stamp,
            origin: self.origin(),
            position: [here.x + size * a, here.y + size * b],
            covariance,
            lever: self.lever(),
            slow: self.slow(2.0),
        };
        self.tally.fixes += 1;
        covariance
            .variances()
            .iter()
            .all(|it| *it > 0.0)
            .then_some(fix.into())
    }

    fn heading(&mut self, stamp: Stamp, here: &Pose) -> Measurement {
        let sigma = decade(&mut self.draws, -5.0, 1.0);
        let of = if self.draws.happens(0.3) {
            HeadingOf::Course {
                least_m_s: self.draws.uniform(0.0, 1.0),
                lever: self.lever(),
            }
        } else {
            HeadingOf::Body
        };
        self.tally.fixes += 1;
        HeadingFix {
            stamp,
            origin: self.origin(),
            heading_rad: here.phi + sigma * self.draws.normal(),
            variance: sigma * sigma,
            slow: self.slow(0.0),
            of,
        }
        .into()
    }

    fn pose_said(&mut self, stamp: Stamp, here: &Pose) -> Measurement {
        let [size, heading] = self.sizes();
        self.tally.messages += 1;
        PoseSaid {
            stamp,
            origin: self.origin(),
            pose: self.about(here, size, heading),
            covariance: self.regular(size, heading),
            set: self.draws.happens(0.3),
        }
        .into()
    }

    fn neighbour(&mut self, stamp: Stamp, here: &Pose) -> Measurement {
        let [size, heading] = self.sizes();
        self.tally.messages += 1;
        NeighbourPose {
            stamp,
            origin: Origin {
                source: 2,
                ..self.origin()
            },
            pose: self.about(here, size, heading),
            parts: Parts {
                independent: self.regular(size, heading),
                dependent: spread(&mut self.draws, [size, size, heading]),
            },
        }
        .into()
    }

    fn sighting(&mut self, stamp: Stamp) -> Measurement {
        let [size, heading] = self.sizes();
        Sighting {
            stamp,
            origin: self.origin(),
            observed: RobotId(2),
            relative: pose(&mut self.draws, 20.0),
            covariance: self.regular(size, heading),
        }
        .into()
    }

    fn sizes(&mut self) -> [f64; 2] {
        [
            decade(&mut self.draws, -3.0, 1.0),
            decade(&mut self.draws, -5.0, 0.5),
        ]
    }

    fn about(&mut self, here: &Pose, size: f64, heading: f64) -> Pose {
        let [a, b] = self.draws.normals();
        Pose::new(
            here.x + size * a,
            here.y + size * b,
            here.phi + heading * self.draws.normal(),
        )
    }

    fn regular(&mut self, size: f64, heading: f64) -> Covariance3 {
        let spread = spread(&mut self.draws, [size, size, heading]);
        let least = [size, size, heading].map(|it| REGULAR * it * it);
        let floor = nalgebra::Matrix3::from_diagonal(&least.into());
        Covariance3::new(spread.matrix() + floor).unwrap_or(spread)
    }

    fn lever(&mut self) -> [f64; 2] {
        if self.draws.happens(0.5) {
            return [0.0; 2];
        }
        [self.draws.uniform(-2.0, 2.0), self.draws.uniform(-1.0, 1.0)]
    }

    fn slow(&mut self, largest: f64) -> SlowError {
        if self.draws.happens(0.7) {
            return SlowError::default();
        }
        SlowError {
            variance: decade(&mut self.draws, -4.0, largest),
            memory: Span::from_millis(1 + self.whole(100_000.0)),
        }
    }

    fn origin(&mut self) -> Origin {
        self.said += 1;
        Origin::counted(self.said)
    }

    #[allow(clippy::cast_possible_truncation)] // Of small numbers.
    fn whole(&mut self, below: f64) -> i64 {
        self.draws.uniform(0.0, below) as i64
    }
}

fn at(ms: i64) -> Stamp {
    Stamp::from_nanos(1_000_000 * ms)
}

/// With a gate or without, with finding or without.
fn settings(draws: &mut Draws) -> Settings {
    let mut settings = Settings::default();
    if draws.happens(0.3) {
        settings.found = FoundSettings::OFF;
    }
    if draws.happens(0.5) {
        settings.position_gate = f64::INFINITY;
        settings.heading_gate = f64::INFINITY;
        settings.fusion.gate = f64::INFINITY;
    }
    if draws.happens(0.3) {
        settings.fusion.criterion = Criterion::Determinant;
    }
    settings.fusion.damping = draws.uniform(0.05, 1.0);
    settings
}
