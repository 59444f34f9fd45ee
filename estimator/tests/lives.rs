//! Whole lives through the step, of robots that know where they are and of robots that look for themselves, with every kind of
//! input, levers and slow errors: no part of what they publish or tell loses its sign.
#![allow(clippy::unwrap_used, clippy::cast_precision_loss)] // A test may panic; numbers are small.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, FindingState, HeadingFix, HeadingOf, Measurement,
    NeighbourPose, OdometryNoise, OdometrySample, Origin, Parts, Pose, PoseSaid, PositionFix,
    RobotId, Settings, Sighting, Slot, SlowError, Span, Stamp, Start, TickInputs, step,
};

const LIVES: u64 = 3000;
const TICKS: i64 = 400;
const PERIOD: Span = Span::from_millis(20);

/// The least that an eigenvalue may be, of its part's trace: rounding of two additions.
const BAR: f64 = -1e-14;

/// xorshift64*: enough to make trouble, the same each time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// In [−1, 1).
    fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.next().is_multiple_of(n)
    }

    /// From `least` to `most`, each power of ten as often.
    fn size(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf(0.5 + 0.5 * self.signed())
    }

    fn pair(&mut self, reach: f64) -> [f64; 2] {
        [reach * self.signed(), reach * self.signed()]
    }

    fn covariance(&mut self) -> Covariance3 {
        let (position, heading) = (self.size(1e-3, 10.0), self.size(1e-4, 3.0));
        let sigma = [position, position, heading];
        Covariance3::diagonal(sigma.map(|it| it * it)).unwrap()
    }
}

type Measure = fn(&mut Life) -> Measurement;

/// A robot that drives about.
struct Life {
    random: Random,
    estimator: Estimator<Vec<Slot>>,
    truth: Pose,
    tick: i64,
    /// How good its sensors are.
    fix_m: f64,
    heading_rad: f64,
    slow: SlowError,
    lever: [f64; 2],
}

impl Life {
    fn new(seed: u64) -> Self {
        let mut random = Random(0x0da7_a5e7 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let start = match random.next() % 4 {
            0 => Start::Unknown,
            1 => Start::Position([0.0; 2], Covariance2::diagonal([1.0; 2]).unwrap()),
            _ => Start::Known(Belief::independent(Pose::default(), random.covariance())),
        };
        let slots = vec![Slot::default(); 512];
        let slow_sigma = random.size(0.01, 3.0);
        let is_slow = random.one_in(2);
        Self {
            estimator: Estimator::starting(Settings::default(), Stamp::default(), &start, slots),
            truth: Pose::default(),
            tick: 0,
            fix_m: random.size(1e-3, 3.0),
            heading_rad: random.size(1e-3, 1.0),
            slow: SlowError {
                variance: f64::from(u8::from(is_slow)) * slow_sigma * slow_sigma,
                memory: Span::from_millis(60_000),
            },
            lever: random.pair(2.0),
            random,
        }
    }

    fn now(&self) -> Stamp {
        Stamp::from_nanos(self.tick * PERIOD.as_nanos())
    }

    fn origin(&self, source: u16) -> Origin {
        Origin {
            source,
            ..Origin::counted(self.tick.unsigned_abs())
        }
    }

    fn drive(&mut self) -> Measurement {
        let start = self.now();
        self.tick += 1;
        let velocity = [1.5 * self.random.signed(), 2.0 * self.random.signed()];
        let way = velocity.map(|it| it * PERIOD.as_seconds());
        let heading = self.truth.phi + 0.5 * way[1];
        self.truth = Pose::new(
            self.truth.x + way[0] * heading.cos(),
            self.truth.y + way[0] * heading.sin(),
            self.truth.phi + way[1],
        );
        OdometrySample {
            source: 0,
            start,
            stamp: self.now(),
            motion: OdometryNoise::paper().nonholonomic(velocity),
        }
        .into()
    }

    fn fix(&mut self) -> Measurement {
        let (sin, cos) = self.truth.phi.sin_cos();
        let [ahead, left] = self.lever;
        let [dx, dy] = self.random.pair(self.fix_m);
        let variance = self.fix_m * self.fix_m;
        PositionFix {
            stamp: self.now(),
            origin: self.origin(0),
            position: [
                self.truth.x + ahead * cos - left * sin + dx,
                self.truth.y + ahead * sin + left * cos + dy,
            ],
            covariance: Covariance2::diagonal([variance; 2]).unwrap(),
            lever: self.lever,
            slow: self.slow,
        }
        .into()
    }

    fn heading(&mut self) -> Measurement {
        HeadingFix {
            stamp: self.now(),
            origin: self.origin(0),
            heading_rad: self.truth.phi + self.heading_rad * self.random.signed(),
            variance: self.heading_rad * self.heading_rad,
            slow: SlowError::default(),
            of: HeadingOf::Body,
        }
        .into()
    }

    /// As somebody has it who may be quite wrong.
    fn told(&mut self) -> Pose {
        let reach = if self.random.one_in(20) { 50.0 } else { 0.3 };
        let [dx, dy] = self.random.pair(reach);
        Pose::new(self.truth.x + dx, self.truth.y + dy, self.truth.phi)
    }

    fn neighbour(&mut self) -> Measurement {
        NeighbourPose {
            stamp: self.now(),
            origin: self.origin(3),
            pose: self.told(),
            parts: Parts {
                independent: self.random.covariance(),
                dependent: self.random.covariance(),
            },
        }
        .into()
    }

    fn sighting(&mut self) -> Measurement {
        let [x, y] = self.random.pair(5.0);
        Sighting {
            stamp: self.now(),
            origin: self.origin(0),
            observed: RobotId(2),
            relative: Pose::new(x, y, 3.0 * self.random.signed()),
            covariance: self.random.covariance(),
        }
        .into()
    }

    fn pose(&mut self) -> Measurement {
        PoseSaid {
            stamp: self.now(),
            origin: self.origin(0),
            pose: self.told(),
            covariance: self.random.covariance(),
            set: self.random.one_in(2),
        }
        .into()
    }

    /// What arrives in a tick.
    fn inputs(&mut self) -> Vec<Measurement> {
        let mut inputs = vec![self.drive()];
        if self.random.one_in(300) {
            let [dx, dy] = self.random.pair(50.0); // Somebody carries it.
            self.truth = Pose::new(self.truth.x + dx, self.truth.y + dy, dx);
        }
        let kinds: [(u64, Measure); 5] = [
            (10, Self::fix),
            (25, Self::heading),
            (25, Self::neighbour),
            (20, Self::sighting),
            (400, Self::pose),
        ];
        for (one_in, measure) in kinds {
            if self.random.one_in(one_in) {
                inputs.push(measure(self));
            }
        }
        inputs
    }
}

/// The least eigenvalue over the trace; of nothing, 0. What is no number is the least of all.
fn least(part: &Covariance3) -> f64 {
    let matrix = part.matrix();
    let trace = matrix.trace();
    if trace == 0.0 {
        return 0.0;
    }
    let least = matrix.symmetric_eigenvalues().min() / trace;
    if least.is_nan() {
        f64::NEG_INFINITY
    } else {
        least
    }
}

/// What became of all lives.
#[derive(Debug, Default)]
struct Tally {
    looking: u64,
    known: u64,
    told: u64,
    /// Least of all, in which life and tick.
    independent: (f64, u64, i64),
    dependent: (f64, u64, i64),
}

impl Tally {
    fn look(&mut self, parts: &Parts, place: (u64, i64)) {
        for (part, seen) in [
            (&parts.independent, &mut self.independent),
            (&parts.dependent, &mut self.dependent),
        ] {
            let least = least(part);
            if least < seen.0 {
                *seen = (least, place.0, place.1);
            }
        }
    }
}

#[test]
fn no_part_of_what_is_published_or_told_loses_its_sign() {
    let mut tally = Tally::default();
    for seed in 1..=LIVES {
        let mut life = Life::new(seed);
        for _ in 0..TICKS {
            let measurements = life.inputs();
            let (stamp, place) = (life.now(), (seed, life.tick));
            let inputs = TickInputs {
                stamp,
                measurements: &measurements,
            };
            let outputs = step(&mut life.estimator, &inputs);
            tally.look(&outputs.estimate.belief.parts, place);
            for told in outputs.outgoing {
                tally.look(&told.parts, place);
                tally.told += 1;
            }
            if outputs.finding.state == FindingState::Ok {
                tally.known += 1;
            } else {
                tally.looking += 1;
            }
        }
    }
    println!("{tally:?}");
    assert!(tally.looking > 50_000 && tally.known > 50_000 && tally.told > 5_000);
    assert!(tally.independent.0 >= BAR && tally.dependent.0 >= BAR);
}
