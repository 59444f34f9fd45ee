//! What the robots' sensors say: wheels at 50 Hz, at 10 Hz receivers of two of them, and each sees the next two.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use coloc_sensors::Moment;
use coloc_shm_types::{
    Clock, Message, Odometry, OdometryKind, Position, Publisher, RelativePose, Sender, Space,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::stage::{PREFIX, Problem, ROBOTS, Stage, name, truth};

const PERIOD: Duration = Duration::from_millis(20);
const EVERY: u32 = 5;
const WITH_RECEIVER: usize = 2;
const SIGMA_M: f64 = 0.1;
const SIGMA_RAD: f64 = 0.017_453;

struct Mouth<M: Message> {
    port: Publisher<M>,
    sender: Sender,
}

struct Robot {
    wheels: Mouth<Odometry>,
    receiver: Mouth<Position>,
    laser: Mouth<RelativePose>,
}

/// The thread that speaks.
pub(crate) struct Feed {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Feed {
    pub(crate) fn start(stage: &Stage, seed: u64) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (asked, root) = (Arc::clone(&stop), stage.root());
        let thread = std::thread::spawn(move || {
            // Ports are of the thread that opened them.
            if let Err(problem) = speak(&root, seed, &asked) {
                eprintln!("the sensors are silent: {problem}");
            }
        });
        Self {
            stop,
            thread: Some(thread),
        }
    }
}

fn speak(root: &Path, seed: u64, asked: &AtomicBool) -> Result<(), Problem> {
    let space = Space::open(root, PREFIX, "sensors")?;
    let mut robots = Vec::new();
    for robot in 0..ROBOTS {
        robots.push(Robot {
            wheels: mouth(&space, robot)?,
            receiver: mouth(&space, robot)?,
            laser: mouth(&space, robot)?,
        });
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut before_ns = Moment::now().boottime_ns;
    for tick in 0_u32.. {
        std::thread::sleep(PERIOD);
        if asked.load(Ordering::Relaxed) {
            break;
        }
        let now_ns = Moment::now().boottime_ns;
        for (robot, mouths) in robots.iter_mut().enumerate() {
            mouths.drive(robot, [before_ns, now_ns]);
            if tick.is_multiple_of(EVERY) {
                mouths.sense(robot, now_ns, &mut random);
            }
        }
        before_ns = now_ns;
    }
    Ok(())
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn mouth<M: Message>(space: &Space, robot: usize) -> Result<Mouth<M>, Problem> {
    Ok(Mouth {
        port: space.publisher(&name(robot)?)?,
        sender: Sender::start(0, Clock::Boottime)?,
    })
}

impl Robot {
    #[allow(clippy::cast_precision_loss)] // Milliseconds in nanoseconds.
    fn drive(&mut self, robot: usize, [before_ns, now_ns]: [i64; 2]) {
        let [before, now] = [before_ns, now_ns].map(|it| truth(robot, it));
        let [dx, dy, turn] = [0, 1, 2].map(|at| now[at] - before[at]);
        let (sin, cos) = now[2].sin_cos();
        let seconds = (now_ns - before_ns).max(1) as f64 * 1e-9;
        let ahead = cos * dx + sin * dy;
        // A full channel of a daemon that is being started again is no matter here.
        let _ = self.wheels.port.send(Odometry {
            header: self.wheels.sender.header(now_ns),
            start_ns: before_ns,
            kind: OdometryKind::Twist as u8,
            values: [ahead / seconds, 0.0, turn / seconds, 0.0],
            ..Odometry::default()
        });
    }

    fn sense(&mut self, robot: usize, now_ns: i64, random: &mut ChaCha8Rng) {
        let mut error = |sigma: f64| {
            let it: f64 = StandardNormal.sample(random);
            sigma * it
        };
        let [x, y, phi] = truth(robot, now_ns);
        if robot < WITH_RECEIVER {
            let variance = SIGMA_M * SIGMA_M;
            let _ = self.receiver.port.send(Position {
                header: self.receiver.sender.header(now_ns),
                quality: 4,
                position: [x + error(SIGMA_M), y + error(SIGMA_M)],
                covariance: [variance, 0.0, 0.0, variance],
                ..Position::default()
            });
        }
        for next in 1..3 {
            let other = (robot + next) % ROBOTS;
            let [ox, oy, ophi] = truth(other, now_ns);
            let (dx, dy, (sin, cos)) = (ox - x, oy - y, phi.sin_cos());
            let [m, rad] = [SIGMA_M * SIGMA_M, SIGMA_RAD * SIGMA_RAD];
            let _ = self.laser.port.send(RelativePose {
                header: self.laser.sender.header(now_ns),
                observed: u16::try_from(other + 1).unwrap_or_default(),
                pose: [
                    cos * dx + sin * dy + error(SIGMA_M),
                    cos * dy - sin * dx + error(SIGMA_M),
                    ophi - phi + error(SIGMA_RAD),
                ],
                covariance: [m, 0.0, 0.0, 0.0, m, 0.0, 0.0, 0.0, rad],
                ..RelativePose::default()
            });
        }
    }
}
