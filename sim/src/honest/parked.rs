//! Two robots on defaults for an hour: one stands still and gets fixes at 5 Hz, the other drives circles without any, or stands,
//! too. They see and tell one another every ten seconds, through the product's `step` and its history.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Kind, Measurement, Motion, NeighbourPose, OdometryNoise,
    OdometrySample, Origin, Parts, Pose, PositionFix, Report, Settings, Sighting, SlowError, Span,
    Stamp, TickInputs, Verdict,
};

use coloc_estimator::noise::Variance;

use super::table::Table;
use super::{Finding, Form};
use crate::fleet::{Fleet, Letter, id};
use crate::random::{Noise, Purpose};
use crate::sensors::relative;

const PERIOD: Span = Span::from_millis(20);
const TICKS_PER_SECOND: u32 = 50;
/// Ticks from fix to fix, and from exchange to exchange.
const FIX: u32 = 10;
const EXCHANGE: u32 = 500;
const SLOTS: usize = 512;
const FIX_M: f64 = 0.1;
const SIGHTING: [f64; 3] = [0.1, 0.1, 0.017_453_292_519_943_295];
/// What the other one does, and its velocity \[m/s, rad/s\].
const OTHERS: [(&str, [f64; 2]); 2] = [("drives circles", [0.5, 0.1]), ("stands", [0.0; 2])];

/// Of a robot that stands: three σ after an hour \[m, m, rad\].
const CREEP: [f64; 3] = [0.1, 0.1, 0.05];

/// Variance of a velocity, per reference period, that adds up to a third of `in_an_hour`.
fn creep(in_an_hour: f64) -> f64 {
    let sigma = in_an_hour / 3.0;
    sigma * sigma / (3600.0 * PERIOD.as_seconds())
}

/// A robot with two driven wheels, as the daemon has it by default: 2 %/√m and 0.4°/√s.
fn differential() -> OdometryNoise {
    let variance = |a, per_speed, per_turn_rate| Variance {
        a,
        per_speed,
        per_turn_rate,
        ..Variance::default()
    };
    OdometryNoise {
        forward: variance(2e-4, 0.02, 0.005),
        sideways: variance(2e-4, 0.005, 0.005),
        turning: variance(2.3e-3, 0.0, 0.02),
    }
}

/// What became of the messages.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
struct Tally {
    told: u32,
    /// Not a covariance, to the peer.
    refused: u32,
    /// Refused by the gate.
    gated: u32,
    /// Refused for another reason.
    other: u32,
}

impl Tally {
    fn count(&mut self, report: &Report) {
        match report.verdict {
            Verdict::Gated { .. } => self.gated += u32::from(report.source.kind == Kind::Neighbour),
            Verdict::Accepted { .. } => (),
            _ => self.other += 1,
        }
    }
}

/// Both of them, robot 0 parked.
struct Two {
    noise: Noise,
    fleet: Fleet,
    velocity: [f64; 2],
    tick: u32,
    /// Under way to the next tick.
    letters: Vec<Letter>,
    tally: Tally,
}

impl Two {
    /// The other one's velocity \[m/s, rad/s\].
    fn new(seed: u64, velocity: [f64; 2]) -> Self {
        let covariance = Covariance3::diagonal([0.01, 0.01, 0.0025]).unwrap_or_default();
        let at = |robot| {
            let belief = Belief::independent(truth(velocity, 0.0, robot), covariance);
            (Stamp::from_nanos(0), belief)
        };
        Self {
            noise: Noise::new(seed, 3),
            fleet: Fleet::new(Settings::default(), &[at(0), at(1)], SLOTS),
            velocity,
            tick: 0,
            letters: Vec::new(),
            tally: Tally::default(),
        }
    }

    fn run(mut self, seconds: u32) -> Tally {
        for _ in 0..seconds * TICKS_PER_SECOND {
            self.tick += 1;
            (0..2).for_each(|robot| self.tick_of(robot));
        }
        self.tally
    }

    fn stamp(&self) -> Stamp {
        Stamp::from_nanos(PERIOD.as_nanos() * i64::from(self.tick))
    }

    fn tick_of(&mut self, robot: usize) {
        let stamp = self.stamp();
        let mut measurements = vec![self.odometry(robot)];
        if self.tick.is_multiple_of(EXCHANGE) {
            measurements.push(self.sighting(robot));
        }
        if robot == 0 && self.tick.is_multiple_of(FIX) {
            measurements.push(self.fix());
        }
        let mine = |letter: &mut Letter| letter.to == robot;
        let letters: Vec<_> = self.letters.extract_if(.., mine).collect();
        measurements.extend(letters.iter().filter_map(|it| self.taken(it)));
        let inputs = TickInputs {
            stamp,
            measurements: &measurements,
        };
        let (letters, tally) = (&mut self.letters, &mut self.tally);
        self.fleet.tick(
            robot,
            &inputs,
            &mut |letter| letters.push(letter),
            &mut |report| tally.count(report),
        );
    }

    /// As a daemon takes it in: its covariances are checked.
    fn taken(&mut self, letter: &Letter) -> Option<Measurement> {
        self.tally.told += 1;
        let Parts {
            independent,
            dependent,
        } = letter.pose.parts;
        let parts = Parts::from_row_major(independent.to_row_major(), dependent.to_row_major());
        self.tally.refused += u32::from(parts.is_err());
        let pose = letter.pose;
        Some(
            NeighbourPose {
                parts: parts.ok()?,
                ..pose
            }
            .into(),
        )
    }

    fn odometry(&self, robot: usize) -> Measurement {
        let velocity = if robot == 0 { [0.0; 2] } else { self.velocity };
        let stamp = self.stamp();
        let [v, omega] = velocity;
        let motion = if v.abs() + omega.abs() > 0.0 {
            differential().nonholonomic(velocity)
        } else {
            Motion::standstill(CREEP.map(creep))
        };
        OdometrySample {
            source: 0,
            start: stamp - PERIOD,
            stamp,
            motion,
        }
        .into()
    }

    fn sighting(&self, robot: usize) -> Measurement {
        let time_s = self.stamp_s();
        let [own, other] = [robot, 1 - robot].map(|it| truth(self.velocity, time_s, it));
        let exact = relative(&own, &other);
        let mut draws = self
            .noise
            .draws(Purpose::RelativePose, self.tick as usize, robot, 0);
        let [a, b, c] = draws.normals();
        let [x, y, phi] = SIGHTING;
        Sighting {
            stamp: self.stamp(),
            origin: Origin::counted(u64::from(self.tick)),
            observed: id(1 - robot),
            relative: Pose::new(exact.x + x * a, exact.y + y * b, exact.phi + phi * c),
            covariance: Covariance3::diagonal(SIGHTING.map(|it| it * it)).unwrap_or_default(),
        }
        .into()
    }

    fn fix(&self) -> Measurement {
        let Pose { x, y, .. } = truth(self.velocity, self.stamp_s(), 0);
        let [a, b] = self
            .noise
            .draws(Purpose::Fix, self.tick as usize, 0, 0)
            .normals();
        PositionFix {
            stamp: self.stamp(),
            origin: Origin::counted(u64::from(self.tick)),
            position: [x + FIX_M * a, y + FIX_M * b],
            covariance: Covariance2::diagonal([FIX_M * FIX_M; 2]).unwrap_or_default(),
            lever: [0.0; 2],
            slow: SlowError::default(),
        }
        .into()
    }

    fn stamp_s(&self) -> f64 {
        (self.stamp() - Stamp::from_nanos(0)).as_seconds()
    }
}

/// The parked one at the origin; the other on a circle that begins 2 m from it, or at its beginning.
fn truth([v, omega]: [f64; 2], time_s: f64, robot: usize) -> Pose {
    if robot == 0 {
        return Pose::default();
    }
    let (sin, cos) = libm::sincos(omega * time_s);
    let radius = if omega == 0.0 { 0.0 } else { v / omega };
    Pose::new(2.0 + radius * sin, radius * (1.0 - cos), omega * time_s)
}

/// Runs it and holds it to its bar.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let mut table = Table::new([
        "the other one",
        "messages",
        "refused for their covariance",
        "gated",
        "refused otherwise",
    ]);
    let mut all = Vec::new();
    for (name, velocity) in OTHERS {
        let tally = Two::new(form.seed, velocity).run(form.parked_seconds);
        table.row(row(name, tally));
        all.extend(missed(tally));
    }
    Finding {
        title: format!(
            "One parked with fixes at 5 Hz and another one, an exchange every 10 s: {} s",
            form.parked_seconds
        ),
        text: table.text(),
        missed: all,
    }
}

fn row(name: &str, tally: Tally) -> [String; 5] {
    let Tally {
        told,
        refused,
        gated,
        other,
    } = tally;
    let [told, refused, gated, other] = [told, refused, gated, other].map(|it| it.to_string());
    [name.into(), told, refused, gated, other]
}

fn missed(tally: Tally) -> Vec<String> {
    let mut missed = Vec::new();
    if tally.refused > 0 || tally.told == 0 {
        missed.push(format!(
            "{} of {} messages refused for their covariance",
            tally.refused, tally.told
        ));
    }
    if tally.other > 0 {
        missed.push(format!(
            "{} measurements refused, not by a gate",
            tally.other
        ));
    }
    missed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exchange_is_two_messages() {
        let tally = Two::new(1, OTHERS[0].1).run(61);
        assert_eq!((tally.told, tally.refused, tally.other), (12, 0, 0));
        assert!(missed(tally).is_empty());
        assert_eq!(
            missed(Tally {
                refused: 1,
                other: 1,
                ..tally
            })
            .len(),
            2
        );
    }
}
