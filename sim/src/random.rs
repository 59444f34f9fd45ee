//! Random numbers that depend on what they are for, and on nothing else.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// What a random number is for.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Purpose {
    /// Noise of a relative pose.
    RelativePose = 1,
    /// Whether a relative pose is an outlier, and which.
    RelativeOutlier = 2,
    /// Noise of a satellite fix.
    Fix = 3,
    /// Whether a fix is an outlier, and which.
    FixOutlier = 4,
    /// Whether a message is lost.
    Loss = 5,
    /// How long a message takes.
    Delay = 6,
    /// Difference of the wheels' report and the truth, in synthetic worlds.
    Odometry = 7,
    /// When odometry drops out, and for how long.
    DropOut = 8,
    /// Where synthetic robots start and where they drive to.
    Waypoint = 9,
    /// How a robot's way differs from what its wheels report.
    TrueWay = 10,
    /// How wrong a robot is at its start.
    Start = 11,
    /// Which turns a robot makes.
    Turns = 12,
    /// What is done to a belief, at random.
    Ordeal = 13,
    /// What a robot that is to be calibrated is, and what it reads on its drive.
    Calibration = 14,
    /// Noise and bias of a gyro.
    Gyro = 15,
    /// Which of its samples are lost and which come twice.
    GyroLoss = 16,
    /// Robots in a room, and what a laser scanner makes of them.
    Laser = 17,
    /// What a ranging radio says too much, and its noise.
    Radio = 18,
    /// What becomes of a message between robots that make rounds, and who is there.
    Rounds = 19,
    /// Errors that end at a bound, a compass, and in which direction somebody lies.
    Integrity = 20,
    /// Where robots of the paper's formations are, and what they measure of one another.
    Formation = 21,
    /// Noise of a leader's compass.
    Compass = 22,
    /// What a robot sees by range and bearing where leaders are told tracks.
    TrackedSight = 28,
    /// What becomes of a word between two of many robots.
    ScaleNetwork = 36,
}

/// All randomness of a run: a pure function of (seed, run, purpose, robots, step).
///
/// Drawing more or fewer numbers for one purpose changes no other number. `ChaCha` is seekable: the purpose and
/// the robots choose the stream, the step the place in it.
#[derive(Clone, Debug)]
pub struct Noise {
    generator: ChaCha8Rng,
    run: u16,
}

/// Room in the stream for one step's draws, in 32-bit words (a block of `ChaCha` has 16).
const WORDS_PER_STEP: u128 = 64;

impl Noise {
    /// The noise of run number `run`.
    #[must_use]
    pub fn new(seed: u64, run: u16) -> Self {
        Self {
            generator: ChaCha8Rng::seed_from_u64(seed),
            run,
        }
    }

    /// The numbers for `purpose` at `step`, concerning `robot` and (where two are concerned) `other`.
    #[must_use]
    pub fn draws(&self, purpose: Purpose, step: usize, robot: usize, other: usize) -> Draws {
        let mut generator = self.generator.clone();
        generator.set_stream(stream(purpose, self.run, robot, other));
        generator.set_word_pos(step as u128 * WORDS_PER_STEP);
        Draws(generator)
    }
}

fn stream(purpose: Purpose, run: u16, robot: usize, other: usize) -> u64 {
    let byte = |robot: usize| (robot as u64) & 0xffff;
    (purpose as u64) << 48 | u64::from(run) << 32 | byte(robot) << 16 | byte(other)
}

/// A sequence of random numbers.
#[derive(Clone, Debug)]
pub struct Draws(ChaCha8Rng);

impl Draws {
    /// One draw from N(0, 1).
    pub fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    /// `N` independent draws from N(0, 1).
    pub fn normals<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.normal())
    }

    /// One draw from the uniform distribution over `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// True with this probability.
    pub fn happens(&mut self, probability: f64) -> bool {
        self.0.random::<f64>() < probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_depends_on_every_part_of_its_name_and_on_nothing_else() {
        let noise = Noise::new(7, 3);
        let one = |noise: &Noise, purpose, step, robot, other| {
            noise.draws(purpose, step, robot, other).normal()
        };
        let first = one(&noise, Purpose::Fix, 5, 1, 0);
        let others = [
            one(&noise, Purpose::RelativePose, 5, 1, 0),
            one(&noise, Purpose::Fix, 6, 1, 0),
            one(&noise, Purpose::Fix, 5, 2, 0),
            one(&noise, Purpose::Fix, 5, 1, 1),
            one(&Noise::new(8, 3), Purpose::Fix, 5, 1, 0),
            one(&Noise::new(7, 4), Purpose::Fix, 5, 1, 0),
        ];
        assert!(
            others
                .iter()
                .all(|other| other.to_bits() != first.to_bits())
        );
        assert_eq!(
            one(&Noise::new(7, 3), Purpose::Fix, 5, 1, 0).to_bits(),
            first.to_bits()
        );
    }

    #[test]
    fn normal_draws_have_the_moments_of_their_name() {
        let noise = Noise::new(1, 0);
        let draws: Vec<f64> = (0..20_000)
            .map(|step| noise.draws(Purpose::Fix, step, 0, 0).normal())
            .collect();
        let n = 20_000.0;
        let mean = draws.iter().sum::<f64>() / n;
        let variance = draws.iter().map(|draw| draw * draw).sum::<f64>() / n;
        assert!(mean.abs() < 4.0 / n.sqrt(), "{mean}");
        assert!(
            (variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt(),
            "{variance}"
        );
    }
}
