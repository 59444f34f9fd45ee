//! A robot that lives through a bench as it does in the field: each iteration is the next tick, on a full history.

use std::hint::black_box;

use coloc_estimator::convert::GlobalPose;
use coloc_estimator::history::Slot;
use coloc_estimator::rounds::RoundSettings;
use coloc_estimator::rounds::gate::CHI2_3_ONE_IN_A_MILLION;
use coloc_estimator::{
    Covariance2, Deed, Estimator, FoundSettings, GYRO_SAMPLES, GyroSample, GyroSettings,
    Measurement, NeighbourPose, NotACovariance, OdometrySample, Origin, Pose, PositionFix,
    RoundWord, Settings, SlowError, Span, Stamp, Start, TickInputs, WithGyro, step,
};

use crate::case;

const PERIOD: Span = Span::from_millis(20);
const SLOTS: usize = 4096;
const MOST_NEIGHBOURS: usize = 64;

/// The default of `history.capacity`.
pub const DEFAULT_SLOTS: usize = 1024;
/// So many messages the daemon takes in with one tick, at most.
pub const BURST: usize = 480;

/// Of an estimator, with a gyro or without.
type Places = WithGyro<Vec<Slot>, Vec<GyroSample>>;

/// A robot, its clock and its neighbours.
#[derive(Clone, Debug)]
pub struct Robot {
    estimator: Estimator<Places>,
    now: Stamp,
    sequence: u64,
    word: GlobalPose,
    /// Where it believed to be at the last tick, and so does everybody else: nobody stands against that.
    pose: Pose,
    /// What the next tick takes in.
    heard: Vec<Measurement>,
}

impl Robot {
    /// A robot that has driven for a second hearing `neighbours` at each tick, so that its history is as full as it gets.
    ///
    /// # Errors
    /// None, unless a number of [`case`] is changed for the worse.
    pub fn warm(neighbours: usize) -> Result<Self, NotACovariance> {
        let mut robot = Self::with_slots(SLOTS)?;
        robot.warmed(neighbours);
        Ok(robot)
    }

    /// The same, of a belief that is never doubted.
    ///
    /// # Errors
    /// As [`Self::warm`].
    pub fn unjudged(neighbours: usize) -> Result<Self, NotACovariance> {
        let mut robot = Self::with_slots(SLOTS)?;
        let mut settings = *robot.estimator.settings();
        settings.found = FoundSettings::OFF;
        let places = places(SLOTS, 0);
        robot.estimator = Estimator::new(settings, robot.now, case::belief()?, places);
        robot.warmed(neighbours);
        Ok(robot)
    }

    /// The same as [`Self::warm`] without neighbours, of a robot that takes part in its team's rounds.
    ///
    /// # Errors
    /// As [`Self::warm`].
    pub fn in_rounds() -> Result<Self, NotACovariance> {
        let mut robot = Self::with_slots(SLOTS)?;
        let mut settings = *robot.estimator.settings();
        settings.rounds = Some(RoundSettings {
            robots: 5,
            gate: CHI2_3_ONE_IN_A_MILLION,
        });
        let places = places(SLOTS, 0);
        robot.estimator = Estimator::new(settings, robot.now, case::belief()?, places);
        robot.heard = vec![Measurement::Round(RoundWord {
            stamp: robot.now + PERIOD,
            origin: Origin::default(),
            deed: Deed::Join,
            of: None,
        })];
        robot.tick();
        robot.heard.clear();
        robot.warmed(0);
        Ok(robot)
    }

    fn warmed(&mut self, neighbours: usize) {
        for _ in 0..60 {
            self.tick_hearing(neighbours);
        }
    }

    /// A robot that does not know where it is: each of so many receivers, far from each other, has a hypothesis.
    ///
    /// # Errors
    /// As [`Self::warm`].
    pub fn sought(receivers: u16) -> Result<Self, NotACovariance> {
        let mut robot = Self::with_slots(SLOTS)?;
        let (settings, start) = (*robot.estimator.settings(), Start::Unknown);
        robot.estimator = Estimator::starting(settings, robot.now, &start, places(SLOTS, 0));
        let (_, covariance) = case::fix()?;
        for tick in 0..200 {
            robot.heard.clear();
            if tick % 10 == 0 {
                let words = (0..receivers).map(|number| robot.fix_of(number, covariance));
                robot.heard = words.collect();
            }
            robot.tick();
        }
        robot.heard.clear();
        Ok(robot)
    }

    fn fix_of(&self, number: u16, covariance: Covariance2) -> Measurement {
        Measurement::Fix(PositionFix {
            stamp: self.now + PERIOD,
            origin: Origin {
                source: number,
                ..Origin::counted(self.now.as_nanos().unsigned_abs())
            },
            position: [1000.0 * f64::from(number), 0.0],
            covariance,
            lever: [0.0; 2],
            slow: SlowError::default(),
        })
    }

    /// A robot whose history of `slots` is full of what costs most, neighbours' poses, each at a moment of its own; and a
    /// burst on its way that is as late as it may be.
    ///
    /// # Errors
    /// As [`Self::warm`].
    pub fn crowded(slots: usize) -> Result<Self, NotACovariance> {
        let mut robot = Self::with_slots(slots)?;
        let history = robot.estimator.settings().history.as_nanos();
        let [messages, burst] =
            [slots, BURST].map(|count| i64::try_from(count).unwrap_or(i64::MAX));
        let oldest = robot.now + Span::from_nanos(history / messages);
        robot.now = robot.now + Span::from_nanos(history);
        for message in 0..messages {
            robot.hear(oldest + Span::from_nanos(message * (history / messages)));
        }
        robot.step();
        robot.heard.clear();
        (1..=burst).for_each(|instant| robot.hear(oldest + Span::from_nanos(instant)));
        Ok(robot)
    }

    /// The worst tick there is: the burst reaches a [`Self::crowded`] robot. Each message makes the oldest leave, and in the
    /// end all that is left is applied again.
    pub fn tick_crowded(&mut self) -> f64 {
        self.step()
    }

    fn hear(&mut self, stamp: Stamp) {
        let message = self.neighbour(1, stamp);
        self.heard.push(message.into());
    }

    fn with_slots(slots: usize) -> Result<Self, NotACovariance> {
        let mut settings = Settings::default();
        // Every message is worth its cost: none is gated out, whatever the robot has come to believe.
        settings.fusion.gate = f64::INFINITY;
        settings.position_gate = f64::INFINITY;
        let now = Stamp::from_nanos(1_000_000_000);
        Ok(Self {
            estimator: Estimator::new(settings, now, case::belief()?, places(slots, 0)),
            now,
            sequence: 0,
            word: case::received(0.5)?,
            pose: case::belief()?.pose,
            heard: Vec::with_capacity(MOST_NEIGHBOURS + 2),
        })
    }

    /// The next tick, with a message of each of `neighbours`; x of the estimate.
    pub fn tick_hearing(&mut self, neighbours: usize) -> f64 {
        self.listen(neighbours);
        self.tick()
    }

    /// [`Self::tick_hearing`] with a fix besides.
    pub fn tick_with_fix(&mut self, neighbours: usize, covariance: Covariance2) -> f64 {
        self.listen(neighbours);
        let stamp = self.now + PERIOD;
        let sequence = self.sequence;
        self.heard.push(Measurement::Fix(PositionFix {
            stamp,
            origin: Origin::counted(sequence),
            position: [self.pose.x, self.pose.y],
            covariance,
            lever: [0.0; 2],
            slow: SlowError::default(),
        }));
        self.tick()
    }

    /// A robot with a gyro at 200 Hz, and a driven second of it.
    ///
    /// # Errors
    /// As [`Self::warm`].
    pub fn with_gyro() -> Result<Self, NotACovariance> {
        let mut robot = Self::with_slots(SLOTS)?;
        let settings = Settings {
            gyro: Some(GyroSettings::ORDINARY),
            ..*robot.estimator.settings()
        };
        let start = Start::Known(case::belief()?);
        robot.estimator =
            Estimator::starting(settings, robot.now, &start, places(SLOTS, GYRO_SAMPLES));
        for _ in 0..60 {
            robot.tick_turning();
        }
        Ok(robot)
    }

    /// The next tick, in which a gyro spoke four times, the last a millisecond before it.
    pub fn tick_turning(&mut self) -> f64 {
        self.heard.clear();
        let [_, _, rate_radps] = case::motion().velocity();
        for part in 1..=4 {
            self.sequence += 1;
            self.heard.push(Measurement::Gyro(GyroSample {
                stamp: self.now + Span::from_millis(5 * part - 1),
                origin: Origin::counted(self.sequence),
                rate_radps,
                noise: 0.0,
            }));
        }
        self.tick()
    }

    /// The next tick, with one message stamped `ticks` before it: everything since is applied again.
    pub fn tick_late(&mut self, ticks: i64) -> f64 {
        let delay = Span::from_nanos(PERIOD.as_nanos() * ticks);
        let late = self.neighbour(1, self.now + PERIOD - delay);
        self.heard.clear();
        self.heard.push(late.into());
        self.tick()
    }

    fn listen(&mut self, neighbours: usize) {
        let stamp = self.now + PERIOD;
        self.heard.clear();
        for sender in 0..neighbours {
            let message = self.neighbour(sender, stamp);
            self.heard.push(message.into());
        }
    }

    fn neighbour(&mut self, sender: usize, stamp: Stamp) -> NeighbourPose {
        self.sequence += 1;
        let (pose, parts) = (self.pose, self.word.parts);
        NeighbourPose {
            stamp,
            origin: Origin {
                source: u16::try_from(sender).unwrap_or(u16::MAX),
                ..Origin::counted(self.sequence)
            },
            pose,
            parts,
        }
    }

    fn tick(&mut self) -> f64 {
        let start = self.now;
        self.now = start + PERIOD;
        self.heard.push(Measurement::Odometry(OdometrySample {
            source: 0,
            start,
            stamp: self.now,
            motion: case::motion(),
        }));
        self.step()
    }

    fn step(&mut self) -> f64 {
        let inputs = TickInputs {
            stamp: self.now,
            measurements: &self.heard,
        };
        let outputs = step(&mut self.estimator, black_box(&inputs));
        self.pose = outputs.estimate.belief.pose;
        self.pose.x
    }
}

fn places(slots: usize, samples: usize) -> Places {
    WithGyro {
        slots: vec![Slot::default(); slots],
        samples: vec![GyroSample::default(); samples],
    }
}
