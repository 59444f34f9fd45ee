//! A world made up from a seed: robots that drive to waypoints, at random on an indoor floor or along given ways.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use coloc_estimator::noise::OdometryNoise;

use crate::dead_reckoning::arc;
use crate::random::{Noise, Purpose};
use crate::world::World;

/// What the world is like.
#[derive(Clone, Debug)]
pub struct SyntheticConfig {
    /// How many robots.
    pub robots: usize,
    /// How long \[s\].
    pub seconds: f64,
    /// All randomness.
    pub seed: u64,
    /// Run number: same waypoints, other wheel slip.
    pub run: u16,
    /// Length and width of the floor, its centre at the origin \[m\].
    pub floor_m: [f64; 2],
    /// Fastest forward velocity \[m/s\].
    pub top_speed_mps: f64,
    /// Fastest turn \[rad/s\].
    pub top_turn_radps: f64,
    /// How far the wheels' motion is from what they report.
    pub noise: OdometryNoise,
}

/// Where robots drive that do not drive to waypoints at random.
#[derive(Clone, Debug, Default)]
pub struct Ways {
    /// For every robot the waypoints that it drives round and round, at least two; a robot without any drives to waypoints at random.
    pub waypoints: Vec<Vec<[f64; 2]>>,
    /// How close to one of these counts as there \[m\].
    pub arrived_m: f64,
}

impl Default for SyntheticConfig {
    fn default() -> Self {
        Self {
            robots: 5,
            seconds: 1500.0,
            seed: 1,
            run: 0,
            floor_m: [15.0, 8.0],
            top_speed_mps: 0.1,
            top_turn_radps: 0.5,
            noise: OdometryNoise::paper(),
        }
    }
}

/// Step of the world.
const DT_S: f64 = 0.02;
/// How close to a wall a waypoint at random may be.
const MARGIN_M: f64 = 0.5;
/// How close to one counts as there.
const ARRIVED_M: f64 = 0.15;
/// Turning rate per radian of heading error.
const TURN_GAIN_PER_S: f64 = 1.5;
/// Fastest change of the forward velocity.
const ACCELERATION_MPS2: f64 = 0.3;
/// Fastest change of the turning rate.
const TURN_ACCELERATION_RADPS2: f64 = 2.0;

/// A synthetic world: odometry is what the robots mean to do, the truth is that plus the noise of the configuration.
///
/// So the noise in the truth is exactly what a filter with the same [`OdometryNoise`] assumes, as on robots
/// that log their commands as odometry. Robots see where they are: however they slip, they stay on their ways.
#[derive(Clone, Debug)]
pub struct Synthetic {
    robots: Vec<Vec<(Pose, [f64; 2])>>,
    steps: usize,
}

impl Synthetic {
    /// Drives the robots to waypoints at random.
    #[must_use]
    pub fn new(config: &SyntheticConfig) -> Self {
        Self::along(&Ways::default(), config)
    }

    /// Drives the robots along `ways`.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Saturates, which is what is wanted.
    pub fn along(ways: &Ways, config: &SyntheticConfig) -> Self {
        let steps = (config.seconds / DT_S).round() as usize + 1;
        let robots = (0..config.robots)
            .map(|robot| Driver::new(ways, config, robot).drive(steps))
            .collect();
        Self { robots, steps }
    }
}

impl World for Synthetic {
    fn dt_s(&self) -> f64 {
        DT_S
    }

    fn steps(&self) -> usize {
        self.steps
    }

    fn robots(&self) -> usize {
        self.robots.len()
    }

    fn truth(&self, step: usize, robot: usize) -> Option<Pose> {
        self.robots.get(robot)?.get(step).map(|(pose, _)| *pose)
    }

    fn odometry(&self, step: usize, robot: usize) -> [f64; 2] {
        self.robots
            .get(robot)
            .and_then(|path| path.get(step))
            .map(|(_, velocity)| *velocity)
            .unwrap_or_default()
    }
}

struct Driver<'a> {
    config: &'a SyntheticConfig,
    /// Empty: at random.
    way: &'a [[f64; 2]],
    arrived_m: f64,
    /// The same in every run.
    waypoints: Noise,
    slip: Noise,
    robot: usize,
    visited: usize,
    waypoint: [f64; 2],
    pose: Pose,
    velocity: [f64; 2],
}

impl<'a> Driver<'a> {
    fn new(ways: &'a Ways, config: &'a SyntheticConfig, robot: usize) -> Self {
        let way = ways.waypoints.get(robot).map_or(&[][..], Vec::as_slice);
        let (waypoints, slip) = (
            Noise::new(config.seed, 0),
            Noise::new(config.seed, config.run),
        );
        let mut driver = Self {
            config,
            way,
            arrived_m: if way.is_empty() {
                ARRIVED_M
            } else {
                ways.arrived_m
            },
            waypoints,
            slip,
            robot,
            visited: 0,
            waypoint: [0.0; 2],
            pose: Pose::default(),
            velocity: [0.0; 2],
        };
        let [x, y] = driver.next_waypoint();
        driver.waypoint = driver.next_waypoint();
        driver.pose = Pose::new(
            x,
            y,
            libm::atan2(driver.waypoint[1] - y, driver.waypoint[0] - x),
        );
        driver
    }

    fn next_waypoint(&mut self) -> [f64; 2] {
        let visited = self.visited;
        self.visited += 1;
        match self.way {
            [] => self.waypoint_at_random(visited),
            way => way[visited % way.len()],
        }
    }

    fn waypoint_at_random(&self, visited: usize) -> [f64; 2] {
        let mut draws = self
            .waypoints
            .draws(Purpose::Waypoint, visited, self.robot, 0);
        self.config.floor_m.map(|length| {
            let reach = (length / 2.0 - MARGIN_M).max(0.0);
            draws.uniform(-reach, reach)
        })
    }

    fn drive(mut self, steps: usize) -> Vec<(Pose, [f64; 2])> {
        let step = |step| {
            self.steer();
            let here = (self.pose, self.velocity);
            self.advance(step);
            here
        };
        (0..steps).map(step).collect()
    }

    fn steer(&mut self) {
        let [dx, dy] = [
            self.waypoint[0] - self.pose.x,
            self.waypoint[1] - self.pose.y,
        ];
        if libm::hypot(dx, dy) < self.arrived_m {
            self.waypoint = self.next_waypoint();
        }
        let error = wrap(libm::atan2(dy, dx) - self.pose.phi);
        let top = self.config.top_turn_radps;
        let wanted = [
            self.config.top_speed_mps * libm::cos(error).max(0.0),
            (TURN_GAIN_PER_S * error).clamp(-top, top),
        ];
        let changes = [ACCELERATION_MPS2 * DT_S, TURN_ACCELERATION_RADPS2 * DT_S];
        for ((velocity, wanted), change) in self.velocity.iter_mut().zip(wanted).zip(changes) {
            *velocity += (wanted - *velocity).clamp(-change, change);
        }
    }

    fn advance(&mut self, step: usize) {
        let ([v, omega], noise) = (self.velocity, &self.config.noise);
        let slip = self
            .slip
            .draws(Purpose::Odometry, step, self.robot, 0)
            .normals::<3>();
        let v_true = v + slip[0] * noise.forward.at(v, v.abs(), omega).sqrt();
        let omega_true = omega + slip[1] * noise.turning.at(v, v.abs(), omega).sqrt();
        let aside_m = DT_S * slip[2] * noise.sideways.at(0.0, v.abs(), omega).sqrt();
        let (sin, cos) = libm::sincos(self.pose.phi + 0.5 * omega * DT_S);
        self.pose = arc(&self.pose, [v_true, omega_true], DT_S);
        self.pose.x -= aside_m * sin;
        self.pose.y += aside_m * cos;
    }
}

#[cfg(test)]
mod tests {
    use coloc_estimator::noise::Variance;

    use super::*;

    fn minutes(count: f64, run: u16) -> Synthetic {
        Synthetic::new(&SyntheticConfig {
            seconds: 60.0 * count,
            run,
            ..SyntheticConfig::default()
        })
    }

    #[test]
    fn robots_stay_on_the_floor_and_drive() {
        let world = minutes(10.0, 0);
        for robot in 0..world.robots() {
            let mut path_m = 0.0;
            for step in 0..world.steps() {
                let pose = world.truth(step, robot).expect("always known");
                assert!(pose.x.abs() < 7.5 && pose.y.abs() < 4.0, "{pose:?}");
                path_m += world.odometry(step, robot)[0] * world.dt_s();
            }
            assert!(
                path_m > 30.0,
                "robot {robot} drove {path_m} m in ten minutes"
            );
        }
    }

    #[test]
    fn velocities_and_their_changes_are_bounded() {
        let world = minutes(5.0, 0);
        for step in 1..world.steps() {
            let [before, now] = [world.odometry(step - 1, 2), world.odometry(step, 2)];
            assert!(now[0] >= -1e-12 && now[0] <= 0.1 + 1e-12 && now[1].abs() <= 0.5 + 1e-12);
            assert!(
                (now[0] - before[0]).abs() <= 0.006 + 1e-12
                    && (now[1] - before[1]).abs() <= 0.04 + 1e-12
            );
        }
    }

    #[test]
    fn the_truth_differs_from_odometry_by_the_noise_of_table_2() {
        let world = minutes(10.0, 0);
        let mut sum = 0.0;
        for step in 1..world.steps() {
            let [a, b] = [
                world.truth(step - 1, 0).unwrap(),
                world.truth(step, 0).unwrap(),
            ];
            let slip = wrap(b.phi - a.phi) / world.dt_s() - world.odometry(step - 1, 0)[1];
            sum += slip * slip;
        }
        #[allow(clippy::cast_precision_loss)]
        let variance = sum / (world.steps() - 1) as f64;
        assert!((variance / 0.345 - 1.0).abs() < 0.04, "{variance}");
    }

    #[test]
    fn one_seed_one_world() {
        let [a, b, c] = [minutes(1.0, 0), minutes(1.0, 0), minutes(1.0, 1)];
        assert_eq!(a.truth(3000, 4), b.truth(3000, 4));
        assert_ne!(a.truth(3000, 4), c.truth(3000, 4));
        assert_eq!(a.truth(0, 4), c.truth(0, 4));
    }

    fn skidding(waypoints: Vec<Vec<[f64; 2]>>) -> Synthetic {
        let skid = |per_speed| Variance {
            per_speed,
            ..Variance::default()
        };
        let ways = Ways {
            waypoints,
            arrived_m: 0.3,
        };
        let config = SyntheticConfig {
            robots: 2,
            seconds: 120.0,
            top_speed_mps: 0.8,
            top_turn_radps: 1.5,
            noise: OdometryNoise {
                forward: skid(0.25),
                sideways: skid(0.125),
                turning: skid(0.5),
            },
            ..SyntheticConfig::default()
        };
        Synthetic::along(&ways, &config)
    }

    #[test]
    fn a_robot_with_a_way_drives_it_round_and_round_however_it_slips() {
        let square = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let world = skidding(vec![square.clone()]);
        let laps = |corner: &[f64; 2]| {
            let near = |step: &usize| {
                let pose = world.truth(*step, 0).unwrap();
                libm::hypot(pose.x - corner[0], pose.y - corner[1]) < 0.35
            };
            let steps: Vec<usize> = (0..world.steps()).filter(near).collect();
            steps.chunk_by(|a, b| b - a < 200).count()
        };
        assert!(square.iter().map(laps).all(|laps| laps >= 4));
        let other = (0..world.steps()).map(|step| world.truth(step, 1).unwrap().x);
        assert!(
            other.fold(0.0, f64::min) < -1.0,
            "who has no way goes anywhere"
        );
    }

    #[test]
    fn a_robot_slips_sideways_as_its_noise_says() {
        let world = skidding(Vec::new());
        let (mut sum, mut expected) = (0.0, 0.0);
        for step in 1..world.steps() {
            let [a, b] = [step - 1, step].map(|step| world.truth(step, 0).unwrap());
            let [v, omega] = world.odometry(step - 1, 0);
            let (sin, cos) = libm::sincos(a.phi + 0.5 * omega * DT_S);
            let aside_m = cos * (b.y - a.y) - sin * (b.x - a.x);
            sum += aside_m * aside_m;
            expected += 0.125 * v.abs() * DT_S * DT_S;
        }
        assert!((sum / expected - 1.0).abs() < 0.1, "{sum} {expected}");
    }
}
