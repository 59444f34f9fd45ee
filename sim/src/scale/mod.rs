//! A thousand robots and more: what each costs, and how that grows with how many there are.
//!
//! # The world
//!
//! Robots drive smoothly at up to 1 m/s on a square field that is as large as makes [`NEIGHBOURS`] others in range of each, on
//! average, however many there are. Ten times a second each sees who is in range ([`RANGE_M`]), the nearest [`SEEN_AT_MOST`], and
//! tells them where they are. One in [`RECEIVERS`] has a satellite receiver, with a fix a second. The wheels' noise is that of a
//! robot with two wheels on a hard floor; it is in the truth, the wheels say what was meant. All know where they start.
//!
//! Each robot is a [`coloc_estimator::Estimator`] at 50 Hz, through the same `step` as everywhere. A message is a tick under way.
//!
//! # How it is computed
//!
//! ```text
//! every 100 ms:  where all are ──► cells as wide as the range           one thread, a few ns a robot
//!                each robot, five ticks in a row, hears what was said 100 ms ago,
//!                sees who is in range now, speaks, and drives on        all threads, robots in blocks
//! ```
//!
//! A robot writes what is its own, and reads what others said in the exchange before: nobody waits for anybody, and no order of
//! the threads can be seen. Who is in range is in range of both, so a robot finds what was said to it by asking those that were
//! in its own range, in the order of their numbers. All chance is of a robot and a purpose. So the digest of a run is the same on any
//! number of threads.

mod cells;
mod digest;
mod drive;
mod field;
mod network;
mod report;
mod robot;

use std::collections::VecDeque;

use coloc_estimator::{Measurement, OutgoingPose, Pose, RobotId};
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefMutIterator, ParallelIterator,
};
use rayon::slice::ParallelSliceMut;

pub use network::Network;
pub use report::ScaleReport;

use crate::evaluate::Progress;
use crate::random::Noise;
use cells::{Cells, Near};
use field::Field;
use network::Way;
use robot::{Robot, Tally};

/// How far a robot sees, and is heard \[m\].
pub const RANGE_M: f64 = 10.0;
/// Others in range of a robot where nothing else is said.
pub const NEIGHBOURS: f64 = 4.0;
/// No robot sees more at a time; the nearest.
pub const SEEN_AT_MOST: usize = 8;
/// No robot hears more at a time; the nearest. It never came to that: there are four.
pub const HEARD_AT_MOST: usize = 31;
/// One robot in so many has a receiver.
pub const RECEIVERS: usize = 10;
/// A robot's number has two bytes.
pub const MOST_ROBOTS: usize = 1 << 16;

/// Ticks from exchange to exchange.
const TICKS: usize = 5;
/// Ticks a second.
const HERTZ: usize = 50;
/// So many robots are handed to a thread together: fewer would be handed out more often.
const BLOCK: usize = 16;

/// How many robots, and for how long.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ScaleConfig {
    /// At most [`MOST_ROBOTS`].
    pub robots: usize,
    /// Of the world's time; whole exchanges, at least one \[s\].
    pub seconds: f64,
    /// Where all chance comes from.
    pub seed: u64,
    /// Others in range of a robot, on average over time and robots; who sees and speaks does so to [`SEEN_AT_MOST`].
    pub neighbours: f64,
    /// What is between the robots.
    pub network: Network,
}

impl ScaleConfig {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Saturates, which is what is wanted.
    fn exchanges(&self) -> usize {
        #[allow(clippy::cast_precision_loss)] // Fifty and five.
        let rate_hz = HERTZ as f64 / TICKS as f64;
        ((self.seconds * rate_hz).round() as usize).max(1)
    }
}

/// Drives them on rayon's current thread pool; `progress` is called ten times for a second of the world's time.
#[must_use]
pub fn run(config: &ScaleConfig, progress: &dyn Fn(Progress)) -> ScaleReport {
    let exchanges = config.exchanges();
    let mut crowd = Crowd::new(config);
    for exchange in 1..=exchanges {
        crowd.pass(exchange);
        let done = (exchange * TICKS * config.robots) as u64;
        let total = (exchanges * TICKS * config.robots) as u64;
        progress(Progress { done, total });
    }
    report::report(config, crowd.field, &crowd.blocks, exchanges)
}

/// To whom a robot spoke in an exchange. Apart from the words, so that these few bytes of all robots stay in the caches.
#[derive(Copy, Clone, Debug, Default)]
struct Addressees {
    count: u16,
    to: [RobotId; SEEN_AT_MOST],
}

/// What it said.
type Words = [OutgoingPose; SEEN_AT_MOST];

impl Addressees {
    fn list(&self) -> &[RobotId] {
        &self.to[..usize::from(self.count)]
    }
}

/// What all said in an exchange.
#[derive(Clone, Debug)]
struct Said {
    to: Vec<Addressees>,
    words: Vec<Words>,
}

impl Said {
    /// Of silent robots.
    fn nothing(robots: usize) -> Self {
        Self {
            to: vec![Addressees::default(); robots],
            words: vec![Words::default(); robots],
        }
    }

    /// What `speaker` said to another one.
    fn to(&self, to: RobotId, speaker: usize) -> Option<&OutgoingPose> {
        let at = self.to[speaker].list().iter().position(|it| *it == to)?;
        Some(&self.words[speaker][at])
    }
}

/// Where a robot puts what it says.
struct Mouth<'a> {
    to: &'a mut Addressees,
    words: &'a mut Words,
}

impl Mouth<'_> {
    fn say(&mut self, words: &[OutgoingPose]) {
        // There is room for all: no more are told than were seen.
        for word in words {
            let at = usize::from(self.to.count);
            if at < SEEN_AT_MOST {
                (self.to.to[at], self.words[at]) = (word.to, *word);
                self.to.count += 1;
            }
        }
    }
}

/// Robots that a thread takes together. What becomes of them is added up in the order of their numbers, whoever does it.
struct Block {
    robots: Vec<Robot>,
    tally: Tally,
}

/// All robots, and what is between them.
struct Crowd {
    field: Field,
    blocks: Vec<Block>,
    cells: Cells,
    /// Where each is at the next exchange.
    places: Vec<Pose>,
    /// At the last exchanges, the newest first: as many as a word may be late.
    said: VecDeque<Said>,
    /// At the next.
    says: Said,
    way: Way,
}

/// What a thread writes on, robot after robot.
#[derive(Default)]
struct Desk {
    measurements: Vec<Measurement>,
    near: Vec<Near>,
}

/// What a robot perceives of the others in an exchange.
#[derive(Copy, Clone)]
struct Around<'a> {
    /// Where they are at its end.
    cells: &'a Cells,
    /// What they said at the end of the one before, and of those before that.
    said: &'a VecDeque<Said>,
    way: &'a Way,
}

impl Crowd {
    fn new(config: &ScaleConfig) -> Self {
        let field = Field::of(config.robots, config.neighbours);
        let noise = Noise::new(config.seed, 0);
        let block = |first: usize| Block {
            robots: (first..config.robots.min(first + BLOCK))
                .map(|number| Robot::new(number, field, &noise, &config.network))
                .collect(),
            tally: Tally::default(),
        };
        let blocks: Vec<Block> = (0..config.robots.div_ceil(BLOCK))
            .into_par_iter()
            .map(|at| block(at * BLOCK))
            .collect();
        let robots = blocks.iter().flat_map(|block| &block.robots);
        Self {
            cells: Cells::new(field),
            places: robots.map(Robot::place).collect(),
            said: (0..=config.network.latest())
                .map(|_| Said::nothing(config.robots))
                .collect(),
            way: Way::new(&noise, config.network),
            says: Said::nothing(config.robots),
            blocks,
            field,
        }
    }

    /// The ticks up to the exchange of that number, from 1.
    fn pass(&mut self, exchange: usize) {
        self.cells.fill(&self.places);
        let around = Around {
            cells: &self.cells,
            said: &self.said,
            way: &self.way,
        };
        self.blocks
            .par_iter_mut()
            .zip(self.says.to.par_chunks_mut(BLOCK))
            .zip(self.says.words.par_chunks_mut(BLOCK))
            .zip(self.places.par_chunks_mut(BLOCK))
            .for_each_init(Desk::default, |desk, (((block, to), words), places)| {
                let mouths = to.iter_mut().zip(words);
                let robots = block.robots.iter_mut().zip(mouths).zip(places);
                for ((robot, (to, words)), place) in robots {
                    let mouth = Mouth { to, words };
                    robot.pass(exchange, around, mouth, desk, &mut block.tally);
                    *place = robot.place();
                }
            });
        // The oldest is written over next.
        self.said.rotate_right(1);
        std::mem::swap(&mut self.said[0], &mut self.says);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(robots: usize, seconds: f64) -> ScaleConfig {
        ScaleConfig {
            robots,
            seconds,
            seed: 1,
            neighbours: NEIGHBOURS,
            network: Network::default(),
        }
    }

    fn on(threads: usize, config: &ScaleConfig) -> ScaleReport {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| run(config, &|_| ()))
    }

    #[test]
    fn the_digest_does_not_depend_on_the_threads_and_depends_on_the_seed() {
        let config = config(150, 5.0);
        let one = on(1, &config);
        assert_eq!(one, on(2, &config));
        assert_eq!(one, on(3, &config));
        let other = on(2, &ScaleConfig { seed: 2, ..config });
        assert_ne!(one.digest, other.digest);
    }

    #[test]
    fn nobody_is_told_by_who_is_out_of_range_and_everybody_who_is_seen_is_told() {
        let mut crowd = Crowd::new(&config(100, 5.0));
        for exchange in 1..=50 {
            let places = crowd.places.clone();
            crowd.pass(exchange);
            let distance_m = |a: usize, b: usize| {
                libm::hypot(places[a].x - places[b].x, places[a].y - places[b].y)
            };
            for (speaker, to) in crowd.said[0].to.iter().enumerate() {
                for listener in to.list() {
                    assert!(distance_m(speaker, listener.0.into()) <= RANGE_M);
                }
            }
        }
        let sum = |of: fn(&Tally) -> u64| -> u64 {
            crowd.blocks.iter().map(|block| of(&block.tally)).sum()
        };
        let (seen, heard) = (sum(|it| it.seen), sum(|it| it.heard));
        let last: u64 = crowd.said[0].to.iter().map(|to| u64::from(to.count)).sum();
        assert!(seen > 10_000, "{seen}");
        assert_eq!(seen, heard + last, "the last words are under way");
    }

    /// Constant in the team's size, linear in neighbours.
    #[test]
    fn a_robot_with_half_as_many_neighbours_says_half_as_much() {
        let four = config(1000, 2.0);
        let two = ScaleConfig {
            neighbours: 2.0,
            ..four
        };
        let of = |it: &ScaleConfig| {
            let report = on(2, it);
            #[allow(clippy::cast_precision_loss)] // Some thousand.
            let said = report.messages as f64;
            (said, report.neighbours)
        };
        let ((said, near), (half_said, half_near)) = (of(&four), of(&two));
        assert!((half_said / said - 0.5).abs() < 0.05, "{half_said} {said}");
        assert!((half_near / near - 0.5).abs() < 0.05, "{half_near} {near}");
    }

    #[test]
    fn a_network_that_loses_half_and_delays_the_rest_costs_a_robot_no_honesty() {
        let network = Network {
            loss: 0.5,
            delay_s: 0.4,
        };
        let fair = on(2, &config(60, 30.0));
        let config = ScaleConfig {
            network,
            ..config(60, 30.0)
        };
        let foul = on(1, &config);
        assert_eq!(foul, on(2, &config));
        let lost_percent = 100 * foul.lost / (foul.messages + foul.lost);
        assert!((45..55).contains(&lost_percent), "{foul:?}");
        assert!(foul.outside <= fair.outside + 0.01, "{foul:?}");
        assert_eq!(
            (fair.lost, foul.refused, foul.folded_early),
            (0, 0, 0),
            "{foul:?}"
        );
    }

    #[test]
    fn robots_know_how_wrong_they_are_and_lose_nothing() {
        let report = on(2, &config(60, 60.0));
        assert!((0.5..3.3).contains(&report.nees), "{report:?}");
        assert!(report.outside < 0.06, "{report:?}");
        assert!(report.rms_position_m < 0.5, "{report:?}");
        assert_eq!((report.refused, report.folded_early), (0, 0), "{report:?}");
        assert!((3.3..4.7).contains(&report.neighbours), "{report:?}");
    }
}
