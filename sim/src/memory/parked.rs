//! Robots that stand for an hour with a receiver whose error is a Gauss–Markov process and a little white noise.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, Measurement, Motion, OdometrySample, Origin, Pose,
    PositionFix, Settings, Slot, SlowError, Span, Stamp, TickInputs, step,
};
use rayon::prelude::*;

use super::{CHI2_2_95, Form};
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use crate::random::{Draws, Noise, Purpose};

/// σ of the slow error \[m\] and how long it lasts \[s\].
const RECEIVERS: [(f64, f64); 2] = [(1.0, 60.0), (3.0, 600.0)];

/// σ of what is new in every fix, as a part of the slow error's.
const WHITE: f64 = 0.3;

const SECONDS: u32 = 3600;

/// It is looked at so often, and not before it has heard fixes for so long \[s\].
const LOOKED_AT: u32 = 30;
const SETTLED: u32 = 60;

/// σ of what is known at the start \[m, rad\].
const START: [f64; 2] = [5.0, 0.1];

/// A robot that stands may creep so far in an hour, 3 σ \[m, m, rad\]: the daemon's default.
const CREEP: [f64; 3] = [0.1, 0.1, 0.05];

/// The share of the bar.
const BAR: f64 = 0.07;

/// What the estimator is told of the receiver.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Told {
    /// What it is.
    Memory,
    /// That all of its error is new in every fix.
    White,
}

/// How often robots were outside of their ellipse, and how large that is.
#[derive(Copy, Clone, Debug, Default)]
struct Tally {
    looks: u32,
    outside: u32,
    /// Σ of the error's square and of the variance that is claimed, of x and y \[m²\].
    square: f64,
    claimed: f64,
}

impl Tally {
    fn look(&mut self, belief: &Belief) {
        let p = belief.total();
        let rows = p.to_row_major();
        let (xx, xy, yy) = (rows[0], rows[1], rows[4]);
        let Pose { x, y, .. } = belief.pose; // The truth is the origin.
        let determinant = xx * yy - xy * xy;
        let nees = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant;
        self.looks += 1;
        self.outside += u32::from(nees > CHI2_2_95);
        self.square += 0.5 * (x * x + y * y);
        self.claimed += 0.5 * (xx + yy);
    }

    fn with(self, other: Self) -> Self {
        Self {
            looks: self.looks + other.looks,
            outside: self.outside + other.outside,
            square: self.square + other.square,
            claimed: self.claimed + other.claimed,
        }
    }

    fn share(&self) -> f64 {
        f64::from(self.outside) / f64::from(self.looks)
    }

    fn root(&self, sum: f64) -> f64 {
        (sum / f64::from(self.looks)).sqrt()
    }
}

/// A receiver and the robot that has it.
struct Robot {
    estimator: Estimator<Vec<Slot>>,
    draws: Draws,
    slow: [f64; 2],
    sigma_m: f64,
    /// Kept of the slow error from fix to fix.
    kept: f64,
    covariance: Covariance2,
    error: SlowError,
    count: u64,
}

impl Robot {
    fn new(form: &Form, run: u16, (sigma_m, memory_s): (f64, f64), told: Told) -> Self {
        let mut draws = Noise::new(form.seed, run).draws(Purpose::Fix, 0, 0, 0);
        let [x, y, phi] = draws.normals();
        let [away, turned] = START;
        let pose = Pose::new(away * x, away * y, turned * phi);
        let variances = [away * away, away * away, turned * turned];
        let covariance = Covariance3::diagonal(variances).unwrap_or_default();
        let belief = Belief::independent(pose, covariance);
        let slots = vec![Slot::default(); 64];
        let (variance, white) = (sigma_m * sigma_m, (WHITE * sigma_m).powi(2));
        let (error, claimed) = match told {
            Told::Memory => {
                let memory = Span::from_seconds(memory_s);
                (SlowError { variance, memory }, white)
            }
            Told::White => (SlowError::default(), white + variance),
        };
        Self {
            estimator: Estimator::new(Settings::default(), Stamp::default(), belief, slots),
            slow: draws.normals().map(|it: f64| sigma_m * it),
            draws,
            sigma_m,
            kept: (-1.0 / (f64::from(form.fixes_per_s) * memory_s)).exp(),
            covariance: Covariance2::diagonal([claimed; 2]).unwrap_or_default(),
            error,
            count: 0,
        }
    }

    fn stand(mut self, form: &Form) -> Tally {
        let period = Span::from_seconds(1.0 / f64::from(form.fixes_per_s));
        let mut tally = Tally::default();
        for second in 1..=SECONDS {
            for _ in 0..form.fixes_per_s {
                self.count += 1;
                let before = Stamp::default() + Span::from_nanos(self.nanos(period, 1));
                let now = Stamp::default() + Span::from_nanos(self.nanos(period, 0));
                let measurements = [stands(before, now), self.fix(now)];
                let inputs = TickInputs {
                    stamp: now,
                    measurements: &measurements,
                };
                step(&mut self.estimator, &inputs);
            }
            if second >= SETTLED && second.is_multiple_of(LOOKED_AT) {
                let now = Stamp::default() + Span::from_nanos(self.nanos(period, 0));
                tally.look(&self.estimator.extrapolated(now).belief);
            }
        }
        tally
    }

    fn nanos(&self, period: Span, back: u64) -> i64 {
        let count = i64::try_from(self.count - back).unwrap_or_default();
        period.as_nanos() * count
    }

    fn fix(&mut self, stamp: Stamp) -> Measurement {
        let new = self.sigma_m * (1.0 - self.kept * self.kept).sqrt();
        let [a, b, c, d] = self.draws.normals();
        let [x, y] = self.slow;
        self.slow = [self.kept * x + new * a, self.kept * y + new * b];
        let [x, y] = self.slow;
        let white = WHITE * self.sigma_m;
        PositionFix {
            stamp,
            origin: Origin::counted(self.count),
            position: [x + white * c, y + white * d],
            covariance: self.covariance,
            lever: [0.0; 2],
            slow: self.error,
        }
        .into()
    }
}

/// The wheels say that it stands.
fn stands(start: Stamp, stamp: Stamp) -> Measurement {
    let reference = Settings::default().odometry.reference_period.as_seconds();
    let creep = |in_an_hour: f64| (in_an_hour / 3.0).powi(2) / (3600.0 * reference);
    OdometrySample {
        source: 0,
        start,
        stamp,
        motion: Motion::standstill(CREEP.map(creep)),
    }
    .into()
}

fn tally(form: &Form, receiver: (f64, f64), told: Told) -> Tally {
    let robots = (0..form.robots).into_par_iter();
    let tallies: Vec<_> = robots
        .map(|run| Robot::new(form, run, receiver, told).stand(form))
        .collect();
    tallies.into_iter().fold(Tally::default(), Tally::with)
}

/// Runs it and holds it to its bar.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let mut table = Table::new([
        "slow error",
        "told",
        "outside of 95 %",
        "off, rms per axis (m)",
        "σ claimed (m)",
    ]);
    let mut missed = Vec::new();
    for receiver in RECEIVERS {
        let name = format!("{} m, {} s", receiver.0, receiver.1);
        for (told, words) in [
            (Told::Memory, "with its memory"),
            (Told::White, "as new in every fix"),
        ] {
            let tally = tally(form, receiver, told);
            table.row([
                name.clone(),
                words.into(),
                percent(tally.share()),
                digits(tally.root(tally.square)),
                digits(tally.root(tally.claimed)),
            ]);
            if told == Told::Memory && tally.share() > BAR {
                missed.push(format!("{name}: {} outside", percent(tally.share())));
            }
        }
    }
    Finding {
        title: format!(
            "Parked for an hour, {} robots, {} fixes a second",
            form.robots, form.fixes_per_s
        ),
        text: table.text(),
        missed,
    }
}
