//! A million ticks of whatever may come: always finite, always a covariance, never more memory.
#![allow(clippy::unwrap_used)] // A test may panic.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, Measurement, Motion, NeighbourPose,
    OdometrySample, Origin, Parts, Pose, PositionFix, RobotId, Settings, Sighting, Slot, SlowError,
    Span, Stamp, TickInputs, TickOutputs, Verdict, step,
};

const TICKS: i64 = 1_000_000;
const PERIOD: Span = Span::from_millis(20);

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
    #[allow(clippy::cast_precision_loss)]
    fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn chance(&mut self, one_in: u64) -> bool {
        self.next().is_multiple_of(one_in)
    }

    /// Up to half a second before `now`, or a little after it.
    fn stamp(&mut self, now: Stamp) -> Stamp {
        #[allow(clippy::cast_possible_wrap)]
        let age = (self.next() % 540_000_000) as i64 - 40_000_000;
        now - Span::from_nanos(age)
    }

    fn covariance(&mut self) -> Covariance3 {
        let scale = if self.chance(10) { 0.0 } else { 0.1 };
        let variance = [(); 3].map(|()| scale * self.signed().powi(2));
        Covariance3::diagonal(variance).unwrap()
    }

    fn near(&mut self, pose: Pose) -> Pose {
        let reach = if self.chance(20) { 50.0 } else { 0.3 };
        Pose::new(
            pose.x + reach * self.signed(),
            pose.y + reach * self.signed(),
            pose.phi + 0.3 * self.signed(),
        )
    }
}

struct Robot {
    estimator: Estimator<Box<[Slot]>>,
    random: Random,
    now: Stamp,
    here: Pose,
    sequence: u64,
    sampled: Stamp,
    account: Account,
}

/// What the inputs came to.
#[derive(Debug, Default)]
struct Account {
    accepted: u32,
    gated: u32,
    sent: usize,
    folded_early: u32,
}

impl Robot {
    fn new() -> Self {
        let initial =
            Belief::independent(Pose::default(), Covariance3::diagonal([0.01; 3]).unwrap());
        let settings = Settings {
            history: Span::from_millis(500),
            ..Settings::default()
        };
        // Too few for the busiest half seconds: the storage runs full now and then.
        let storage = vec![Slot::default(); 34].into_boxed_slice();
        Self {
            estimator: Estimator::new(settings, Stamp::default(), initial, storage),
            random: Random(0x0da7_a5e7),
            now: Stamp::default(),
            here: Pose::default(),
            sequence: 0,
            sampled: Stamp::default(),
            account: Account::default(),
        }
    }

    fn tick(&mut self) -> Belief {
        self.now = self.now + PERIOD;
        let (odometry, sighting) = (self.odometry(), self.sighting());
        let (neighbour, fix) = (self.neighbour(), self.fix());
        let measured = [
            odometry.map(Measurement::from),
            sighting.map(Measurement::from),
            neighbour.map(Measurement::from),
            fix.map(Measurement::from),
        ];
        let measurements: Vec<_> = measured.into_iter().flatten().collect();
        let inputs = TickInputs {
            stamp: self.now,
            measurements: &measurements,
        };
        let outputs = step(&mut self.estimator, &inputs);
        self.account.add(&outputs);
        self.here = outputs.estimate.belief.pose;
        outputs.estimate.belief
    }

    /// As if nothing had been: a clock that has gone mad is no state that anybody goes on from.
    fn restart(&mut self, now: Stamp) {
        let settings = *self.estimator.settings();
        let storage = vec![Slot::default(); 34].into_boxed_slice();
        self.estimator = Estimator::new(settings, now, Belief::default(), storage);
        (self.now, self.sampled) = (now, now);
    }

    /// The clock errs: a little, much, or to one of its ends; where it was before is the answer.
    fn step_clock(&mut self) -> Stamp {
        let (hour, second) = (Span::from_millis(3_600_000), Span::from_millis(1000));
        let stepped = match self.random.next() % 7 {
            0 => self.now + second,
            1 => self.now - second,
            2 => self.now + hour,
            3 => self.now - hour,
            4 => Stamp::from_nanos(i64::MIN),
            5 => Stamp::from_nanos(i64::MAX),
            _ => Stamp::default(),
        };
        std::mem::replace(&mut self.now, stepped)
    }

    /// Mostly one per tick; now and then lost or of the wildest interval.
    fn odometry(&mut self) -> Option<OdometrySample> {
        if self.random.chance(30) {
            return None;
        }
        let (mut start, stamp) = (self.sampled, self.now);
        if self.random.chance(50) {
            start = self.random.stamp(self.now);
        }
        self.sampled = stamp;
        let v = if self.random.chance(5) {
            0.0
        } else {
            self.random.signed()
        };
        let noise = Covariance2::diagonal([5.075 * v * v, 0.345]).unwrap();
        let motion = Motion::Nonholonomic {
            velocity: [v, self.random.signed()],
            noise,
        };
        Some(OdometrySample {
            source: 0,
            start,
            stamp,
            motion,
        })
    }

    fn sighting(&mut self) -> Option<Sighting> {
        self.rarely()?;
        Some(Sighting {
            stamp: self.random.stamp(self.now),
            origin: Origin::counted(self.sequence),
            observed: RobotId(2),
            relative: self.random.near(Pose::default()),
            covariance: self.random.covariance(),
        })
    }

    fn neighbour(&mut self) -> Option<NeighbourPose> {
        self.rarely()?;
        let half = self.random.covariance().scaled(0.5);
        let parts = if self.random.chance(2) {
            Parts {
                independent: half,
                dependent: half,
            }
        } else {
            Parts::dependent(half.scaled(2.0))
        };
        Some(NeighbourPose {
            stamp: self.random.stamp(self.now),
            origin: Origin {
                source: 3,
                ..Origin::counted(self.sequence)
            },
            pose: self.random.near(self.here),
            parts,
        })
    }

    fn fix(&mut self) -> Option<PositionFix> {
        self.rarely()?;
        let pose = self.random.near(self.here);
        Some(PositionFix {
            stamp: self.random.stamp(self.now),
            origin: Origin::counted(self.sequence),
            position: [pose.x, pose.y],
            covariance: Covariance2::diagonal([0.01 * self.random.signed().powi(2), 0.01]).unwrap(),
            lever: [0.0; 2],
            slow: SlowError::default(),
        })
    }

    fn rarely(&mut self) -> Option<()> {
        self.sequence += 1;
        self.random.chance(15).then_some(())
    }
}

impl Account {
    fn add(&mut self, outputs: &TickOutputs<'_>) {
        self.sent += outputs.outgoing.len();
        self.folded_early += outputs.folded_early;
        for report in outputs.reports {
            match report.verdict {
                Verdict::Accepted { .. } => self.accepted += 1,
                Verdict::Gated { .. } => self.gated += 1,
                _ => {}
            }
        }
    }
}

fn is_sound(belief: &Belief) -> bool {
    let Parts {
        independent,
        dependent,
    } = belief.parts;
    let as_told =
        Parts::from_row_major(independent.to_row_major(), dependent.to_row_major()).is_ok();
    let whole = Covariance3::new(belief.total().matrix()).is_ok();
    belief.pose.is_finite() && as_told && whole
}

#[test]
fn a_million_ticks_stay_finite_and_semidefinite() {
    let mut robot = Robot::new();
    for tick in 0..TICKS {
        let belief = robot.tick();
        assert!(is_sound(&belief), "tick {tick}: {belief:?}");
    }
    let Account {
        accepted,
        gated,
        sent,
        folded_early,
    } = robot.account;
    assert!(
        accepted > 10_000 && gated > 1_000 && sent > 10_000 && folded_early > 100,
        "{:?}",
        robot.account
    );
}

#[test]
fn a_clock_gone_mad_breaks_nothing() {
    let mut robot = Robot::new();
    for tick in 0..TICKS / 10 {
        let before = robot.random.chance(20).then(|| robot.step_clock());
        let belief = robot.tick();
        assert!(
            is_sound(&belief),
            "tick {tick} at {:?}: {belief:?}",
            robot.now
        );
        if let Some(before) = before {
            robot.restart(before);
        }
    }
    assert!(robot.account.accepted > 1_000, "{:?}", robot.account);
}
