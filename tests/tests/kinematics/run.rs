//! A drive, told as frames, decoded, and believed.

use std::io::Write;
use std::sync::{LazyLock, Mutex};

use coloc_daemon::collect::wheels::ToMotion;
use coloc_daemon::config::Config;
use coloc_daemon::estimate::Estimate;
use coloc_drivers::can::{Frame, Received, StandardId};
use coloc_drivers::encoder::OdometryDecoder;
use coloc_estimator::{Belief, Covariance3, Pose, Stamp, Start, TickInputs};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tempfile::NamedTempFile;

use super::drive::{Drive, Interval};
use super::robot::{
    COUNT_M, DBC, FORWARD_PER_M, Robot, SIDEWAYS_PER_M, SIGMA_RAD, Says, TURNING_PER_M,
    WHEEL_PER_M, steering_deg,
};

/// What is wrong with wheels and body.
#[derive(Copy, Clone, Debug)]
pub(crate) enum Noise {
    None,
    Seed(u64),
}

/// What came of it.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Outcome {
    pub(crate) way_m: f64,
    pub(crate) off_m: f64,
    pub(crate) turned_off_rad: f64,
    /// Normalised error squared; of two numbers, and of one.
    pub(crate) position_nees: f64,
    pub(crate) heading_nees: f64,
}

static DBC_FILE: LazyLock<NamedTempFile> = LazyLock::new(|| {
    let mut file = NamedTempFile::new().unwrap();
    file.write_all(DBC.as_bytes()).unwrap();
    file
});

/// Which robot, what its wheels say, and whether with noise.
type Case = (Robot, Says, bool);

/// Read once for each robot: that is most of a short drive's time.
struct Setups(Mutex<Vec<(Case, Setup)>>);

static SETUPS: Setups = Setups(Mutex::new(Vec::new()));

#[derive(Clone)]
struct Setup {
    config: Config,
    decoder: OdometryDecoder,
}

impl Setups {
    fn of(&self, robot: Robot, says: Says, is_noisy: bool) -> Setup {
        let key = (robot, says, is_noisy);
        let mut known = self.0.lock().unwrap();
        if let Some((_, setup)) = known.iter().find(|(it, _)| *it == key) {
            return setup.clone();
        }
        let config = robot.config(says, is_noisy, DBC_FILE.path());
        let decoder = OdometryDecoder::new(config.odometry.as_ref().unwrap()).unwrap();
        known.push((key, Setup { config, decoder }));
        known[known.len() - 1].1.clone()
    }
}

/// An encoder, or what makes a speed of one.
struct Sensors {
    robot: Robot,
    says: Says,
    noise: Option<ChaCha8Rng>,
    ways_m: [f64; 4],
}

impl Sensors {
    fn drawn(&mut self) -> f64 {
        let drawn = |random: &mut ChaCha8Rng| StandardNormal.sample(random);
        self.noise.as_mut().map_or(0.0, drawn)
    }

    /// What is measured of an interval.
    fn frames(&mut self, interval: &Interval, interval_s: f64) -> Vec<Frame> {
        let mut speeds = [0.0; 4];
        for (wheel, way_m) in interval.ways.into_iter().enumerate() {
            let noisy = self.robot.has_noisy_wheels();
            let sigma = (WHEEL_PER_M * way_m.abs()).sqrt();
            let measured_m = if noisy {
                way_m + sigma * self.drawn()
            } else {
                way_m
            };
            self.ways_m[wheel] += measured_m;
            speeds[wheel] = measured_m / interval_s;
        }
        let sigma = SIGMA_RAD * self.drawn();
        self.said(speeds, interval.angle_rad + sigma)
    }

    fn said(&self, speeds: [f64; 4], angle_rad: f64) -> Vec<Frame> {
        let (base, words) = match self.says {
            Says::Counts => (0x10, self.ways_m.map(|way_m| count(way_m).to_le_bytes())),
            Says::Speeds => (0x20, speeds.map(|speed| float(speed).to_le_bytes())),
        };
        let pair = |pair: u16| {
            let first = usize::from(2 * pair);
            frame(base + pair, &[words[first], words[first + 1]].concat())
        };
        let pairs = if self.robot.channels() > 2 { 2 } else { 1 };
        let mut frames: Vec<_> = (0..pairs).map(pair).collect();
        if self.robot.is_steered() {
            let angle = float(steering_deg(angle_rad)).to_le_bytes();
            frames.push(frame(0x30, &angle));
        }
        frames
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counters wrap"
)]
fn count(way_m: f64) -> u32 {
    (way_m / COUNT_M).round() as i64 as u32
}

#[expect(clippy::cast_possible_truncation, reason = "as the bus has it")]
fn float(value: f64) -> f32 {
    value as f32
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::data_frame(StandardId::new(id).unwrap(), data).unwrap()
}

/// Its way and heading at the end, against those that were driven: with noise, the wheels did not see all of what the body did.
pub(crate) fn ride(robot: Robot, says: Says, drive: &Drive, noise: Noise) -> Outcome {
    let is_noisy = matches!(noise, Noise::Seed(_));
    let Setup {
        config,
        mut decoder,
    } = SETUPS.of(robot, says, is_noisy);
    let to_motion = ToMotion::new(&config);
    let begin_ns = 1_000_000_000_i64;
    let certain = Belief::independent(Pose::default(), Covariance3::ZERO);
    let start = Start::Known(certain);
    let mut estimate = Estimate::new(&config, Stamp::from_nanos(begin_ns), &start);
    let mut random = match noise {
        Noise::None => None,
        Noise::Seed(seed) => Some(ChaCha8Rng::seed_from_u64(seed)),
    };
    let mut sensors = Sensors {
        robot,
        says,
        noise: random.as_mut().map(ChaCha8Rng::from_rng),
        ways_m: [0.0; 4],
    };
    let (mut truth, mut belief) = (Pose::default(), certain);
    #[expect(clippy::cast_possible_truncation, reason = "whole nanoseconds")]
    let interval_ns = (drive.interval_s * 1e9).round() as i64;
    let mut stamp_ns = begin_ns;
    for frame in sensors.said([0.0; 4], drive.angle_rad) {
        decoder.push(&received(frame, stamp_ns)).unwrap();
    }
    for interval in &drive.intervals {
        stamp_ns += interval_ns;
        truth = moved(
            truth,
            slipped(interval.twist, drive.interval_s, random.as_mut()),
            drive.interval_s,
        );
        for frame in sensors.frames(interval, drive.interval_s) {
            let Some(sample) = decoder.push(&received(frame, stamp_ns)).unwrap() else {
                continue;
            };
            let inputs = TickInputs {
                stamp: Stamp::from_nanos(sample.stamp_ns),
                measurements: &[to_motion.sample(0, &sample).into()],
            };
            belief = estimate.step(&inputs).estimate.belief;
        }
    }
    assert_eq!(decoder.slip(), None, "{robot:?}: no wheel slips");
    assert_eq!(decoder.counters().samples, drive.intervals.len() as u64);
    let end = if is_noisy { truth } else { drive.end };
    outcome(&belief, end, drive.way_m)
}

fn received(frame: Frame, stamp_ns: i64) -> Received {
    Received {
        frame,
        stamp_ns,
        bus: 0,
    }
}

/// What the body does where wheels would have it do `twist` for so long.
fn slipped(twist: [f64; 3], dt_s: f64, random: Option<&mut ChaCha8Rng>) -> [f64; 3] {
    let Some(random) = random else { return twist };
    let [vx, vy, omega] = twist;
    let speed = vx.hypot(vy);
    let mut off = |per_m: f64| {
        let drawn: f64 = StandardNormal.sample(random);
        (per_m * speed / dt_s).sqrt() * drawn
    };
    [
        vx + off(FORWARD_PER_M),
        vy + off(SIDEWAYS_PER_M),
        omega + off(TURNING_PER_M),
    ]
}

/// Along an arc.
fn moved(pose: Pose, [vx, vy, omega]: [f64; 3], dt_s: f64) -> Pose {
    let turn = omega * dt_s;
    let half = turn / 2.0;
    let chord = if half.abs() < 1e-9 {
        1.0
    } else {
        half.sin() / half
    };
    let (sin, cos) = (pose.phi + half).sin_cos();
    Pose::new(
        pose.x + chord * dt_s * (vx * cos - vy * sin),
        pose.y + chord * dt_s * (vx * sin + vy * cos),
        pose.phi + turn,
    )
}

fn outcome(belief: &Belief, end: Pose, way_m: f64) -> Outcome {
    let (dx, dy) = (belief.pose.x - end.x, belief.pose.y - end.y);
    let turned = belief.pose.phi - end.phi;
    let turned_off_rad = turned.sin().atan2(turned.cos());
    let p = belief.total().to_row_major();
    let determinant = p[0] * p[4] - p[1] * p[1];
    Outcome {
        way_m,
        off_m: dx.hypot(dy),
        turned_off_rad,
        position_nees: (p[4] * dx * dx - 2.0 * p[1] * dx * dy + p[0] * dy * dy) / determinant,
        heading_nees: turned_off_rad * turned_off_rad / p[8],
    }
}
