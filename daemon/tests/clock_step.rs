//! The clock is set while the robot drives: the belief moves along, and nothing is lost.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use by_hand::{METRES_PER_TICK, PERIOD, SECOND, Subject, TestTime, World};
use coloc_daemon::clock::{Reading, TimeSource};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{BeliefState, Health, Input, Position};

const STEPS: [i64; 4] = [SECOND, -SECOND, 3600 * SECOND, -3600 * SECOND];

#[test]
fn a_clock_step_moves_the_belief_along() {
    for step in STEPS {
        let world = World::new();
        let mut robot = world.robot("a", 1, "");
        let fixes = world.publisher::<Position>("a");
        let fix = |header| Position {
            header,
            quality: 4,
            position: [0.05, 0.0],
            covariance: [0.01, 0.0, 0.0, 0.01],
            ..Position::default()
        };
        fixes.send(fix(world.header(0))).unwrap();
        let before = (0..10).map(|_| robot.tick()).last().unwrap();
        world.time.step(step);
        let after = robot.tick();
        assert_eq!(
            after.header.stamp_ns,
            before.header.stamp_ns + PERIOD + step
        );
        assert_eq!(
            after.pose.map(f64::to_bits),
            before.pose.map(f64::to_bits),
            "a standing robot stays where it is"
        );
        assert!(
            after.total()[0] >= before.total()[0] && after.total()[0] < before.total()[0] + 0.01,
            "one tick's growth"
        );
        assert_eq!(after.health_of(Input::Position), Health::Ok, "nothing aged");
        fixes.send(fix(world.header(1))).unwrap();
        let fused = robot.tick();
        assert!(
            fused.total()[0] < after.total()[0],
            "fixes of the new clock are fused"
        );
    }
}

#[test]
fn a_driving_robot_drives_on_through_a_clock_step() {
    for source in ["realtime", "boottime"] {
        for step in STEPS {
            let world = World::new();
            let precise = "[initial]\nsigma = [0.1, 0.1, 0.0]\n[motion]\npreset = \"paper\"\nturning = { a = 0.0 }\noutage_variance = [0.0, 0.0, 0.0]\n";
            let mut robot = world.robot(
                "a",
                1,
                &format!(
                    "{precise}[clock]\nsource = \"{source}\"\n{}",
                    world.wheels()
                ),
            );
            let (mut sender, mut frames) = (world.sender(), WheelFrames::new(METRES_PER_TICK));
            for tick in 0..40 {
                if tick == 20 {
                    world.time.step(step);
                }
                let way_m = 0.01 * f64::from(tick);
                for frame in frames.encode(way_m, way_m) {
                    sender.send(&frame).unwrap();
                }
                let estimate = robot.tick();
                assert!(
                    (estimate.pose[0] - way_m).abs() < 1e-6,
                    "{source} {step} tick {tick}: {:?}",
                    estimate.pose
                );
                assert!(
                    (estimate.odometry[0] - way_m).abs() < 1e-6,
                    "{source} {step} tick {tick}: {:?}",
                    estimate.odometry
                );
                assert!(
                    tick == 0 || (estimate.velocity[0] - 0.5).abs() < 1e-6,
                    "{:?}",
                    estimate.velocity
                );
                assert!(tick == 0 || estimate.health_of(Input::Odometry) == Health::Ok);
                assert!(tick == 0 || estimate.state() == BeliefState::Ok);
                assert!(tick == 0 || estimate.is_fit(), "nothing was asked for");
                assert!(tick == 0 || estimate.velocity_covariance[0] > 0.0);
            }
            assert_eq!(
                robot
                    .robot
                    .account()
                    .status()
                    .rejected_total(Input::Odometry),
                0
            );
        }
    }
}

/// The test's clocks, by which the newest frame came when this says so.
struct Stamped(TestTime, Arc<AtomicI64>);

impl TimeSource for Stamped {
    fn read(&self) -> Reading {
        self.0.read()
    }

    fn of_kernel(&self, _: i64) -> i64 {
        self.1.load(Ordering::Relaxed)
    }
}

/// The computer sleeps, and wakes with another time of day. By the clock before that, the next frame came while it slept, when
/// one was due; but the buses were empty when it woke.
#[test]
fn a_frame_that_came_after_a_sleep_is_not_taken_for_one_from_before_it() {
    const MS: i64 = SECOND / 1000;
    let world = World::new();
    let came_ns = Arc::new(AtomicI64::new(0));
    let time = Stamped(world.time.clone(), Arc::clone(&came_ns));
    let lines = format!("[clock]\nsource = \"boottime\"\n{}", world.wheels());
    let mut robot = world.robot_under(Box::new(time), "a", 1, &lines);
    let (mut sender, mut frames) = (world.sender(), WheelFrames::new(METRES_PER_TICK));
    let mut tick_with_frames = |robot: &mut Subject| {
        came_ns.store(world.time.realtime() + 15 * MS, Ordering::Relaxed);
        for frame in frames.encode(0.0, 0.0) {
            sender.send(&frame).unwrap();
        }
        robot.tick();
        robot.timing().unwrap().frame_stamp_ns - world.time.read_boot()
    };
    let before = [(); 3].map(|()| tick_with_frames(&mut robot));
    assert_eq!(before[1..], [-5 * MS; 2]);
    world.time.run(400 * MS);
    world.time.step(-380 * MS);
    robot.tick();
    assert_eq!(tick_with_frames(&mut robot), -5 * MS);
}
