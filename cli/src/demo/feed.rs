//! What the robots' sensors say, as the daemons hear it: encoder frames on each robot's bus, sightings and fixes through
//! shared memory. Open loop: on absolute deadlines, whoever listens.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, OnceLock};

use coloc_drivers::can::{BusSpec, Sender};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{
    self as shm, Clock, Header, Heading, Position, Publisher, RelativePose, RobotName, Space,
};
use coloc_sim::laser::hall::{Hall, TURN_S};
use coloc_sim::{StepInputs, sensors};

use super::clock::{now_ns, sleep_until};
use super::eye::Eye;
use super::lead::COMPASS_SIGMA_RAD;
use super::robot_file::{METRES_PER_TICK, TRACK_M, name};
use super::scene::{Camera, Eyes};
use super::world::{Received, Stage};
use super::{DemoError, spaces};

/// How the demo and its feed tell one another where they are.
#[derive(Debug, Default)]
pub(crate) struct Signals {
    /// The demo: the robots may drive.
    pub(crate) go: AtomicBool,
    /// The demo: enough.
    pub(crate) stop: AtomicBool,
    /// The feed: they drive since then \[ns of `CLOCK_BOOTTIME`\].
    pub(crate) start_ns: OnceLock<i64>,
}

/// What the sensors of the whole team send into.
pub(crate) struct Feed {
    stage: Arc<Stage>,
    robots: Vec<Robot>,
    /// Of one scan.
    ranges: Vec<f32>,
}

/// Of one robot, at most.
const RECEIVERS: usize = 2;

struct Robot {
    bus: Sender,
    wheels: WheelFrames,
    /// Ways of the left and the right wheel so far \[m\].
    ways_m: [f64; 2],
    eye: Eye,
    fixes: Publisher<Position>,
    /// Of leaders.
    compass: Option<(Publisher<Heading>, shm::Sender)>,
    /// They stamp what goes out on these ports.
    sights: shm::Sender,
    receivers: [shm::Sender; RECEIVERS],
}

impl Feed {
    /// Opens every bus and port.
    fn open(stage: Arc<Stage>, roots: &[PathBuf], buses: &[BusSpec]) -> Result<Self, DemoError> {
        let spaces = spaces::enter(roots, "coloc-demo-feed")?;
        let open = |(index, (bus, space)): (usize, (&BusSpec, &Space))| {
            Robot::open(space, index, bus, &stage)
        };
        let robots = buses
            .iter()
            .zip(&spaces)
            .enumerate()
            .map(open)
            .collect::<Result<_, _>>()?;
        Ok(Self {
            stage,
            robots,
            ranges: Vec::new(),
        })
    }

    /// Sends until told to stop. Reports on `opened` as soon as all buses and ports are there.
    pub(crate) fn run(
        stage: Arc<Stage>,
        roots: &[PathBuf],
        buses: &[BusSpec],
        signals: &Signals,
        opened: &SyncSender<()>,
    ) -> Result<(), DemoError> {
        let mut feed = Self::open(stage, roots, buses)?;
        // Nobody waits for it only if the demo has failed already.
        let _ = opened.send(());
        let first_ns = feed.stand_still(signals)?;
        feed.drive(first_ns, signals)
    }

    /// The encoders speak while the robots stand, until they may drive. Returns when the world starts.
    fn stand_still(&mut self, signals: &Signals) -> Result<i64, DemoError> {
        let mut deadline_ns = now_ns();
        while !signals.go.load(Ordering::Acquire) && !signals.stop.load(Ordering::Acquire) {
            self.send_frames()?;
            deadline_ns = (deadline_ns + self.stage.step_ns()).max(now_ns());
            sleep_until(deadline_ns);
        }
        Ok(*signals.start_ns.get_or_init(|| deadline_ns))
    }

    /// Step `k` is due `k` steps after the start. Who wakes late sends what was measured meanwhile under its own stamps,
    /// but only the newest encoder frames: counters are cumulative.
    fn drive(&mut self, start_ns: i64, signals: &Signals) -> Result<(), DemoError> {
        let stage = Arc::clone(&self.stage);
        let (sensors, step_ns) = (stage.sensors(), stage.step_ns());
        let (mut inputs, mut received) = (StepInputs::default(), Vec::new());
        let mut step = 0;
        while !signals.stop.load(Ordering::Acquire) {
            while due_ns(start_ns, step, step_ns) <= now_ns() {
                sensors.fill(step, &mut inputs);
                self.roll(&inputs);
                stage.received(&inputs, &mut received);
                let due_ns = due_ns(start_ns, step, step_ns);
                self.look(&inputs, due_ns);
                self.send_fixes(&received, step, due_ns);
                step += 1;
            }
            self.send_frames()?;
            sleep_until(due_ns(start_ns, step, step_ns));
        }
        Ok(())
    }

    fn roll(&mut self, inputs: &StepInputs) {
        let step_s = self.stage.step_s();
        for (robot, velocity) in self.robots.iter_mut().zip(&inputs.odometry) {
            robot.roll(velocity.unwrap_or_default(), step_s);
        }
    }

    fn send_frames(&mut self) -> Result<(), DemoError> {
        self.robots.iter_mut().try_for_each(Robot::send_frames)
    }

    /// What the sensors see that look at others.
    fn look(&mut self, inputs: &StepInputs, stamp_ns: i64) {
        let stage = Arc::clone(&self.stage);
        let step = inputs.step;
        match stage.eyes() {
            Eyes::Poses => self.send_sightings(inputs, stamp_ns),
            Eyes::Camera(camera) if is_due(step, Camera::EVERY_S, stage.step_s()) => {
                self.send_glances(camera, step, stamp_ns);
            }
            Eyes::Scans(hall) if is_due(step, TURN_S, stage.step_s()) => {
                self.send_scans(hall, step, stamp_ns);
            }
            Eyes::Camera(_) | Eyes::Scans(_) => {}
        }
    }

    fn send_glances(&mut self, camera: &Camera, step: usize, stamp_ns: i64) {
        for glance in self.stage.glances(camera, step) {
            if let Some(robot) = self.robots.get_mut(glance.observer) {
                let header = robot.sights.header(stamp_ns);
                robot.eye.say_glance(header, &glance, id(glance.observed));
            }
        }
    }

    /// The turn that ends now.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation)] // Steps of a run, a tenth of a second.
    fn send_scans(&mut self, hall: &Hall, step: usize, stamp_ns: i64) {
        let begin_s = step as f64 * self.stage.step_s() - TURN_S;
        let begin_ns = stamp_ns.saturating_sub((TURN_S * 1e9).round() as i64);
        let pose = |robot, later_s| self.stage.truth_at(robot, begin_s + later_s);
        for (index, robot) in self.robots.iter_mut().enumerate() {
            hall.scan(index, step, pose, &mut self.ranges);
            robot
                .eye
                .say_scan(robot.sights.header(begin_ns), &self.ranges);
        }
    }

    fn send_sightings(&mut self, inputs: &StepInputs, stamp_ns: i64) {
        let scenario = self.stage.scenario();
        let stage = &self.stage;
        let seen = inputs.sightings.iter();
        for sighting in seen.filter(|it| stage.is_told_of(it) && stage.is_looked_at(it)) {
            if let Some(robot) = self.robots.get_mut(sighting.observer) {
                let header = robot.sights.header(stamp_ns);
                let message = relative_pose(header, sighting, scenario.sightings.sigma);
                robot.eye.say_pose(message);
            }
        }
    }

    fn send_fixes(&mut self, received: &[Received], step: usize, stamp_ns: i64) {
        let stage = Arc::clone(&self.stage);
        let sigma_m = stage.scenario().fixes.sigma_m;
        for fix in received {
            let Some(robot) = self.robots.get_mut(fix.robot) else {
                continue;
            };
            if let Some(receiver) = robot.receivers.get_mut(usize::from(fix.receiver)) {
                let message = position(receiver.header(stamp_ns), fix, sigma_m);
                robot.send_fix(message);
            }
            if let Some(heading) = stage.heading(fix, step) {
                robot.send_heading(heading, stamp_ns);
            }
        }
    }
}

impl Robot {
    fn open(space: &Space, index: usize, bus: &BusSpec, stage: &Stage) -> Result<Self, DemoError> {
        let robot = RobotName::new(&name(index + 1)).map_err(DemoError::shm)?;
        let sender = shm::Sender::start(0, Clock::Boottime).map_err(DemoError::shm)?;
        let second = shm::Sender::start(1, Clock::Boottime).map_err(DemoError::shm)?;
        let compass = stage.leads(index).then(|| {
            let port = space.publisher::<Heading>(&robot)?;
            Ok::<_, coloc_shm_types::PortError>((port, sender.beside()))
        });
        Ok(Self {
            bus: Sender::open(bus).map_err(|error| DemoError::Bus(error.to_string()))?,
            wheels: WheelFrames::new(METRES_PER_TICK),
            ways_m: [0.0; 2],
            eye: Eye::open(space, &robot, stage.eyes()).map_err(DemoError::shm)?,
            fixes: space.publisher(&robot).map_err(DemoError::shm)?,
            compass: compass.transpose().map_err(DemoError::shm)?,
            sights: sender.beside(),
            receivers: [sender, second],
        })
    }

    fn roll(&mut self, [v, omega]: [f64; 2], step_s: f64) {
        let turn = omega * TRACK_M / 2.0;
        self.ways_m[0] += (v - turn) * step_s;
        self.ways_m[1] += (v + turn) * step_s;
    }

    fn send_frames(&mut self) -> Result<(), DemoError> {
        let [left_m, right_m] = self.ways_m;
        let frames = self.wheels.encode(left_m, right_m);
        frames
            .iter()
            .try_for_each(|frame| self.bus.send(frame))
            .map_err(|error| DemoError::Bus(error.to_string()))
    }

    // A message that did not reach everybody was for somebody who just died or was too slow: the others have it.

    fn send_fix(&self, message: Position) {
        let _ = self.fixes.send(message);
    }

    fn send_heading(&mut self, heading: f64, stamp_ns: i64) {
        if let Some((port, sender)) = &mut self.compass {
            let _ = port.send(compass(sender.header(stamp_ns), heading));
        }
    }
}

/// Whether something that comes every so often comes at that step.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few steps.
fn is_due(step: usize, every_s: f64, step_s: f64) -> bool {
    let every = (every_s / step_s).round().max(1.0) as usize;
    step > 0 && step.is_multiple_of(every)
}

fn due_ns(start_ns: i64, step: usize, step_ns: i64) -> i64 {
    start_ns.saturating_add(step_ns.saturating_mul(i64::try_from(step).unwrap_or(i64::MAX)))
}

fn relative_pose(header: Header, sighting: &sensors::Sighting, sigma: [f64; 3]) -> RelativePose {
    let [a, b, c] = sigma.map(|sigma| sigma * sigma);
    RelativePose {
        header,
        observed: id(sighting.observed),
        pose: [
            sighting.relative.x,
            sighting.relative.y,
            sighting.relative.phi,
        ],
        covariance: [a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c],
        ..RelativePose::default()
    }
}

fn position(header: Header, fix: &Received, sigma_m: f64) -> Position {
    let variance = sigma_m * sigma_m;
    let differential = 2;
    Position {
        header,
        quality: differential,
        position: fix.position,
        covariance: [variance, 0.0, 0.0, variance],
        ..Position::default()
    }
}

fn compass(header: Header, heading: f64) -> Heading {
    let calibrated = 1;
    Heading {
        header,
        quality: calibrated,
        heading,
        variance: COMPASS_SIGMA_RAD * COMPASS_SIGMA_RAD,
        ..Heading::default()
    }
}

/// Number in the team of the robot with that index.
fn id(index: usize) -> u16 {
    u16::try_from(index + 1).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_due_on_absolute_deadlines() {
        assert_eq!(due_ns(5, 3, 20_000_000), 60_000_005);
        assert_eq!(due_ns(5, usize::MAX, 20_000_000), i64::MAX);
    }

    #[test]
    fn a_sighting_is_a_valid_message() {
        let sighting = sensors::Sighting {
            observer: 0,
            observed: 1,
            relative: coloc_estimator::Pose::new(1.0, 2.0, 3.0),
            arrives: Some(4),
        };
        let message = relative_pose(Header::default(), &sighting, [0.1, 0.2, 0.3]);
        assert_eq!((message.observed, message.pose), (2, [1.0, 2.0, 3.0]));
        assert!((message.covariance[4] - 0.04).abs() < 1e-15);
    }
}
