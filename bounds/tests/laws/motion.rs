//! Regions that go on for a while.

use coloc_bounds::team::{Motion, Pair, Sighting, Supports};
use coloc_bounds::{AngleInterval, Arena, Measurement, Source, Team, wrap};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const DIRECTIONS: usize = 16;
const ROBOTS: usize = 3;
const ARENA: Arena = Arena {
    centre: [0.0; 2],
    half: 1e3,
};

#[derive(Copy, Clone)]
struct Truth {
    at: [f64; 2],
    heading: f64,
}

/// A robot drives an arc, in small steps, and its wheels are off by no more than their bounds.
fn drive(random: &mut ChaCha8Rng, truth: &mut Truth) -> Motion {
    let (speed, rate) = (
        random.random_range(0.0..0.5),
        random.random_range(-1.0..1.0),
    );
    let mut motion = Motion {
        velocity: [speed, 0.0],
        velocity_half: [0.05, 0.02],
        rate,
        rate_half: 0.05,
        seconds: 0.1,
    };
    let steps = 50;
    for _ in 0..steps {
        let seconds = motion.seconds / f64::from(steps);
        let (sin, cos) = truth.heading.sin_cos();
        truth.at[0] += seconds * speed * cos;
        truth.at[1] += seconds * speed * sin;
        truth.heading += seconds * rate;
    }
    motion.velocity[0] += random.random_range(-0.05..0.05);
    motion.velocity[1] += random.random_range(-0.02..0.02);
    motion.rate += random.random_range(-0.05..0.05);
    motion
}

fn see(random: &mut ChaCha8Rng, truth: &[Truth], observer: usize, observed: usize) -> Sighting {
    let (a, b) = (truth[observer], truth[observed]);
    let [x, y] = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
    let (sin, cos) = a.heading.sin_cos();
    let body = [cos * x + sin * y, cos * y - sin * x];
    Sighting {
        observer,
        observed,
        centre: body.map(|it| it + random.random_range(-0.1..0.1)),
        half: [0.1, 0.1],
        directions: 8,
    }
}

fn team(truth: &[Truth]) -> Team {
    let around = |at: [f64; 2]| {
        let box_of = Motion {
            velocity: at,
            velocity_half: [0.3, 0.3],
            rate: 0.0,
            rate_half: 0.0,
            seconds: 1.0,
        };
        let mut region = Supports::zero(DIRECTIONS);
        region.add_motion(&box_of, AngleInterval::new(0.0, 0.0));
        region
    };
    let mut team = Team::new(ROBOTS, DIRECTIONS);
    for (robot, it) in truth.iter().enumerate() {
        team.regions[robot] = around(it.at);
        team.headings[robot] = AngleInterval::new(it.heading + 0.05, 0.1);
    }
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let mut region = team.regions[i].clone();
        region.subtract(&team.regions[j]);
        team.pairs.push(Pair { i, j, region });
    }
    team
}

struct Drive {
    random: ChaCha8Rng,
    truth: Vec<Truth>,
    team: Team,
    /// By odometry alone.
    reckoned: Team,
}

impl Drive {
    fn new(seed: u64) -> Self {
        let random = ChaCha8Rng::seed_from_u64(seed);
        let truth: Vec<_> = [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]
            .map(|at| Truth {
                at,
                heading: at[0] - 0.4,
            })
            .to_vec();
        let team = team(&truth);
        Self {
            random,
            truth,
            reckoned: team.clone(),
            team,
        }
    }

    fn epoch(&mut self, index: usize, with_compass: bool) {
        let mut moved = vec![Supports::zero(DIRECTIONS); ROBOTS];
        let mut reckoned = moved.clone();
        for _ in 0..5 {
            for robot in 0..ROBOTS {
                let motion = drive(&mut self.random, &mut self.truth[robot]);
                turn(&mut self.team, &mut moved[robot], robot, &motion);
                turn(&mut self.reckoned, &mut reckoned[robot], robot, &motion);
            }
        }
        self.team.predict(&moved);
        self.reckoned.predict(&reckoned);
        if with_compass && index.is_multiple_of(2) {
            for robot in 0..ROBOTS {
                let off = self.random.random_range(-0.09..0.09);
                let heading = wrap(self.truth[robot].heading + off);
                self.team
                    .compass(robot, AngleInterval::new(heading, 0.09))
                    .unwrap();
            }
        }
        self.measure();
    }

    fn measure(&mut self) {
        let mut sightings = Vec::new();
        for (i, j) in [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)] {
            if self.random.random_range(0..3) > 0 {
                sightings.push(see(&mut self.random, &self.truth, i, j));
            }
        }
        self.team.headings_from_positions(&sightings).unwrap();
        let mut polytope = self.team.polytope(ARENA, 1e-9).unwrap();
        let at = self.truth[0]
            .at
            .map(|it| it + self.random.random_range(-0.1..0.1));
        let fix = Measurement::Fix {
            robot: 0,
            centre: at,
            half: [0.1, 0.1],
        };
        polytope
            .add(&fix, Source::Measurement(sightings.len()))
            .unwrap();
        for (index, sighting) in sightings.iter().enumerate() {
            let measurement = self.team.measurement(sighting);
            polytope
                .add(&measurement, Source::Measurement(index))
                .unwrap();
        }
        self.team.keep(&mut polytope.region().unwrap());
    }

    fn check(&self, name: &str) {
        for (robot, truth) in self.truth.iter().enumerate() {
            let inside = holds(&self.team.regions[robot], truth.at);
            assert!(inside, "{name}: robot {robot} is outside");
            let heading = self.team.headings[robot];
            assert!(
                heading.contains(truth.heading, 1e-9),
                "{name}: heading {robot}"
            );
            let reckoned = width(&self.reckoned.regions[robot]);
            assert!(
                width(&self.team.regions[robot]) <= reckoned + 1e-6,
                "{name}"
            );
        }
        for Pair { i, j, region } in &self.team.pairs {
            let [a, b] = [self.truth[*i].at, self.truth[*j].at];
            assert!(
                holds(region, [a[0] - b[0], a[1] - b[1]]),
                "{name}: pair {i} {j}"
            );
        }
    }
}

fn turn(team: &mut Team, moved: &mut Supports, robot: usize, motion: &Motion) {
    let heading = team.headings[robot];
    let Motion {
        rate,
        rate_half,
        seconds,
        ..
    } = *motion;
    moved.add_motion(motion, heading.during(rate, rate_half, seconds));
    team.headings[robot] = heading.turned(rate, rate_half, seconds);
}

#[allow(clippy::cast_precision_loss)] // Sixteen.
fn holds(region: &Supports, at: [f64; 2]) -> bool {
    region.values().iter().enumerate().all(|(k, support)| {
        let psi = core::f64::consts::TAU * k as f64 / region.values().len() as f64;
        psi.cos() * at[0] + psi.sin() * at[1] <= support + 1e-9
    })
}

fn width(region: &Supports) -> f64 {
    region.values()[0] + region.values()[DIRECTIONS / 2]
}

#[test]
fn the_truth_stays_inside_for_a_hundred_epochs() {
    for (seed, with_compass) in [(1, true), (2, true), (3, false), (4, false)] {
        let mut drive = Drive::new(seed);
        for index in 0..100 {
            drive.epoch(index, with_compass);
            drive.check(&format!("drive {seed}, epoch {index}"));
        }
        let widths: Vec<_> = drive.team.regions.iter().map(width).collect();
        let reckoned = width(&drive.reckoned.regions[1]);
        println!("drive {seed}: widths {widths:.2?} m, by odometry alone {reckoned:.2} m");
        assert!(widths.iter().all(|it| *it < reckoned / 2.0), "{widths:?}");
    }
}
