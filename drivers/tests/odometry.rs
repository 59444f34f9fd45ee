//! Encoder frames in, odometry out: on good days and on bad ones.

#![allow(clippy::unwrap_used, clippy::cast_precision_loss, reason = "a test")]

use coloc_drivers::can::{BusSpec, Frame, Id, Received, StandardId};
use coloc_drivers::encoder::{
    FrameReject, LEFT_ID, OdometryConfig, OdometryDecoder, RIGHT_ID, Rest, STILL_AFTER_NS,
    WheelFrames, WheelOdometry, encoder_frame,
};
use proptest::prelude::*;

const TRACK_M: f64 = 0.5;
const TICK_M: f64 = 1e-4;
const PERIOD_NS: i64 = 20_000_000;

fn config() -> OdometryConfig {
    OdometryConfig::differential(
        BusSpec::Local {
            directory: "/nowhere".into(),
        },
        TRACK_M,
        TICK_M,
        2.0,
    )
}

/// A robot whose frames a test may lose, repeat or spoil on their way to the decoder.
struct Robot {
    wheels: WheelFrames,
    decoder: OdometryDecoder,
    way_m: [f64; 2],
    now_ns: i64,
    /// Sum of velocity times duration of all samples: way and heading.
    travelled: [f64; 2],
    samples: Vec<WheelOdometry>,
}

impl Robot {
    fn new() -> Self {
        Self::starting_at(0)
    }

    fn starting_at(ticks: u32) -> Self {
        Self {
            wheels: WheelFrames::starting_at(ticks, TICK_M),
            decoder: OdometryDecoder::new(&config()).unwrap(),
            way_m: [0.0; 2],
            now_ns: 1_700_000_000_000_000_000,
            travelled: [0.0; 2],
            samples: Vec::new(),
        }
    }

    /// One period with these wheel speeds \[m/s\]; hands out the frames.
    fn step(&mut self, speeds: [f64; 2]) -> [Frame; 2] {
        self.now_ns += PERIOD_NS;
        for (way_m, speed) in self.way_m.iter_mut().zip(speeds) {
            *way_m += speed * PERIOD_NS as f64 * 1e-9;
        }
        self.wheels.encode(self.way_m[0], self.way_m[1])
    }

    fn push_at(
        &mut self,
        frame: Frame,
        stamp_ns: i64,
    ) -> Result<Option<WheelOdometry>, FrameReject> {
        let outcome = self.decoder.push(&Received {
            frame,
            stamp_ns,
            bus: 0,
        });
        if let Ok(Some(sample)) = outcome {
            let dt_s = (sample.stamp_ns - sample.start_ns) as f64 * 1e-9;
            assert!(dt_s > 0.0);
            self.travelled[0] += sample.velocity[0] * dt_s;
            self.travelled[1] += sample.velocity[2] * dt_s;
            self.samples.push(sample);
        }
        outcome
    }

    fn push(&mut self, frame: Frame) -> Result<Option<WheelOdometry>, FrameReject> {
        self.push_at(frame, self.now_ns)
    }

    /// A good period: both frames arrive.
    fn drive(&mut self, speeds: [f64; 2]) {
        for frame in self.step(speeds) {
            self.push(frame).unwrap();
        }
    }

    /// No wheel is faster in any sample, turns included.
    fn assert_never_faster_than(&self, limit_mps: f64) {
        for WheelOdometry { velocity, .. } in &self.samples {
            let [v, _, omega] = *velocity;
            let fastest = v.abs() + (omega * TRACK_M / 2.0).abs();
            assert!(fastest <= limit_mps * (1.0 + 1e-9), "{velocity:?}");
        }
    }

    fn rejected(&self, reason: FrameReject) -> u64 {
        self.decoder.counters().of(reason)
    }

    /// Way and heading of the samples are those of the wheels since `from_m`.
    fn assert_nothing_lost_since(&self, from_m: [f64; 2]) {
        let [left, right] = [self.way_m[0] - from_m[0], self.way_m[1] - from_m[1]];
        let (way_m, heading_rad) = (f64::midpoint(left, right), (right - left) / TRACK_M);
        assert!(
            (self.travelled[0] - way_m).abs() <= TICK_M,
            "way {} of {way_m}",
            self.travelled[0]
        );
        assert!(
            (self.travelled[1] - heading_rad).abs() <= 2.0 * TICK_M / TRACK_M,
            "heading {}",
            self.travelled[1]
        );
    }
}

/// A robot that has driven one period, so that everything after it counts.
fn started() -> Robot {
    let mut robot = Robot::new();
    robot.drive([0.0, 0.0]);
    robot
}

#[test]
fn the_first_frames_only_say_where_counting_starts() {
    let mut robot = Robot::starting_at(123_456);
    robot.drive([1.0, 1.0]);
    assert_eq!(robot.samples, []);
    robot.drive([1.0, 1.0]);
    let expected = WheelOdometry {
        start_ns: robot.now_ns - PERIOD_NS,
        stamp_ns: robot.now_ns,
        velocity: [1.0, 0.0, 0.0],
        rest: Rest::Moving,
        spread: [[0.0; 3]; 3],
    };
    assert_eq!(robot.samples, [expected]);
}

/// What so many periods of such wheels say of standing.
fn rests(robot: &mut Robot, speeds: [f64; 2], periods: usize) -> Vec<Rest> {
    let before = robot.samples.len();
    (0..periods).for_each(|_| robot.drive(speeds));
    robot.samples[before..].iter().map(|it| it.rest).collect()
}

#[test]
fn counts_that_do_not_change_for_a_second_say_that_it_stands() {
    let mut robot = started();
    let periods = usize::try_from(STILL_AFTER_NS / PERIOD_NS).unwrap();
    let stopped = rests(&mut robot, [0.0, 0.0], 3 * periods);
    let first = stopped.iter().position(|&it| it == Rest::Counts);
    assert_eq!(first, Some(periods));
    assert!(stopped[periods..].iter().all(|&it| it == Rest::Counts));
    assert_eq!(rests(&mut robot, [0.5, 0.0], 1), [Rest::Moving]);
    assert_eq!(rests(&mut robot, [0.0, 0.0], 1), [Rest::Moving]);
}

/// Two counts a second and nothing between them.
#[test]
fn a_robot_between_two_counts_does_not_stand() {
    let mut robot = started();
    let slow = 2.0 * TICK_M;
    let crept = rests(&mut robot, [slow, slow], 500);
    assert!(
        robot
            .samples
            .iter()
            .any(|it| it.velocity.iter().all(|v| *v == 0.0))
    );
    assert!(crept.iter().all(|&it| it == Rest::Moving));
}

/// A count comes and goes: at first the robot moves, then it stands; when it goes, nothing of its way is lost.
#[test]
fn a_dithering_count_stands_and_what_goes_on_does_not() {
    let one_count = TICK_M / (PERIOD_NS as f64 * 1e-9);
    for first in [one_count, -one_count] {
        let mut robot = started();
        for quiet in [25, 10, 3, 0] {
            let mut dithered = Vec::new();
            for speed in [first, -first].repeat(100) {
                dithered.extend(rests(&mut robot, [0.0, speed], 1));
                dithered.extend(rests(&mut robot, [0.0, 0.0], quiet));
            }
            let stood = dithered.iter().rev().take_while(|&&it| it == Rest::Counts);
            assert!(stood.count() + 130 >= dithered.len(), "{quiet}");
        }
        let crept = rests(&mut robot, [2.0 * one_count, 2.0 * one_count], 30);
        assert!(crept[2..].iter().all(|&it| it == Rest::Moving), "{crept:?}");
        robot.assert_nothing_lost_since([0.0; 2]);
    }
}

/// A count in two seconds, always on: what was kept while it seemed to stand is said.
#[test]
fn slow_creep_is_said_to_the_last_two_counts() {
    let mut robot = started();
    for _ in 0..30 {
        robot.drive([TICK_M / (PERIOD_NS as f64 * 1e-9); 2]);
        rests(&mut robot, [0.0; 2], 99);
        let kept_m = robot.way_m[0] - robot.travelled[0];
        assert!(kept_m.abs() < 2.5 * TICK_M, "{kept_m} m");
    }
}

/// What is lost in a few periods is driven on; of a longer silence only the sum is known.
#[test]
fn a_path_that_nobody_counted_has_a_spread_and_a_short_loss_has_none() {
    for (lost, is_open) in [
        (0, false),
        (1, false),
        (3, false),
        (24, false),
        (25, true),
        (3000, true),
    ] {
        let mut robot = started();
        (0..10).for_each(|_| robot.drive([0.5, 0.5]));
        for _ in 0..lost {
            let _lost = robot.step([1.0, 0.8]);
        }
        robot.drive([1.0, 0.8]);
        let spread = robot.samples.last().unwrap().spread;
        let is_spread = |spread: [[f64; 3]; 3]| spread.iter().flatten().any(|&it| it > 0.0);
        assert_eq!(is_spread(spread), is_open, "{lost} lost: {spread:?}");
        assert!(!is_open || spread[0][0].min(spread[1][1]).sqrt() >= 0.9);
        robot.drive([1.0, 0.8]);
        assert!(!is_spread(robot.samples.last().unwrap().spread));
    }
}

/// Without frames there is no sample; the one that ends the silence says what it counted, and nothing of standing.
#[test]
fn silence_is_no_standing() {
    let mut robot = started();
    rests(&mut robot, [0.5, 0.5], 10);
    let before = robot.samples.len();
    robot.now_ns += 10 * STILL_AFTER_NS;
    robot.drive([0.0, 0.0]);
    let after: Vec<_> = robot.samples[before..].iter().map(|it| it.rest).collect();
    assert_eq!(after, [Rest::Moving]);
}

#[test]
fn straight_turns_and_backwards() {
    let mut robot = started();
    for speeds in [[0.5, 0.5], [0.5, 1.0], [-0.5, 0.5], [-1.0, -1.0]] {
        robot.drive(speeds);
    }
    let velocities: Vec<_> = robot.samples.iter().map(|sample| sample.velocity).collect();
    let expected = [
        [0.5, 0.0, 0.0],
        [0.75, 0.0, 1.0],
        [0.0, 0.0, 2.0],
        [-1.0, 0.0, 0.0],
    ];
    for (velocity, expected) in velocities.iter().flatten().zip(expected.iter().flatten()) {
        assert!((velocity - expected).abs() < 1e-9, "{velocities:?}");
    }
    robot.assert_nothing_lost_since([0.0; 2]);
}

#[test]
fn counters_wrap_at_two_to_the_32_in_both_directions() {
    for (first, speed) in [(u32::MAX - 300, 1.0), (300, -1.0)] {
        let mut robot = Robot::starting_at(first);
        robot.drive([0.0; 2]);
        (0..10).for_each(|_| robot.drive([speed, speed]));
        assert_eq!(robot.samples.len(), 10);
        robot.assert_nothing_lost_since([0.0; 2]);
    }
}

#[test]
fn lost_frames_lose_nothing() {
    let mut robot = started();
    for lost in [1, 2, 7, 15, 16, 17, 100] {
        for _ in 0..lost {
            let _lost = robot.step([1.0, 0.8]);
        }
        robot.drive([1.0, 0.8]);
        robot.drive([1.0, 0.8]);
        robot.assert_nothing_lost_since([0.0; 2]);
    }
    assert_eq!(robot.decoder.counters().rejected, [0; 8]);
    assert_eq!(
        robot.decoder.counters().skipped,
        2 * (1 + 2 + 7 + 15 + 17 % 16 + 100 % 16)
    );
}

#[test]
fn one_wheels_lost_frame_does_not_turn_the_robot() {
    let mut robot = started();
    for period in 0..50 {
        let [left, right] = robot.step([1.0, 1.0]);
        if period % 7 != 3 {
            robot.push(left).unwrap();
        }
        if period % 11 != 5 {
            robot.push(right).unwrap();
        }
        assert!(
            robot
                .samples
                .iter()
                .all(|sample| sample.velocity[2].abs() < 1e-9),
            "{:?}",
            robot.samples.last()
        );
    }
    robot.drive([1.0, 1.0]);
    robot.assert_nothing_lost_since([0.0; 2]);
}

#[test]
fn wheels_half_a_period_apart_still_make_samples() {
    let mut robot = Robot::new();
    for jitter_ns in (0..100).map(|n| (n * 7919 % 11 - 5) * 100_000) {
        let [left, right] = robot.step([1.0, 0.9]);
        robot
            .push_at(left, robot.now_ns - PERIOD_NS / 2 + jitter_ns)
            .unwrap();
        robot.push_at(right, robot.now_ns - jitter_ns).unwrap();
    }
    assert!(robot.samples.len() > 60, "{} samples", robot.samples.len());
}

#[test]
fn a_repeated_frame_is_refused() {
    let mut robot = started();
    let [left, right] = robot.step([1.0, 1.0]);
    robot.push(left).unwrap();
    assert_eq!(robot.push(left), Err(FrameReject::Repeated));
    robot.push(right).unwrap();
    assert_eq!(robot.push(right), Err(FrameReject::Repeated));
    assert_eq!(
        (robot.rejected(FrameReject::Repeated), robot.samples.len()),
        (2, 1)
    );
}

#[test]
fn an_older_frame_after_a_newer_one_is_refused() {
    let mut robot = started();
    robot.drive([1.0, 1.0]);
    let [old, right] = robot.step([1.0, 1.0]);
    robot.push(right).unwrap();
    robot.drive([1.0, 1.0]);
    assert_eq!(robot.push(old), Err(FrameReject::OutOfOrder));
    robot.drive([1.0, 1.0]);
    robot.assert_nothing_lost_since([0.0; 2]);
}

#[test]
fn a_stamp_that_goes_back_a_little_is_refused() {
    let mut robot = started();
    let [left, _] = robot.step([1.0, 1.0]);
    assert_eq!(
        robot.push_at(left, robot.now_ns - PERIOD_NS - 1),
        Err(FrameReject::Backward)
    );
    assert_eq!(robot.rejected(FrameReject::Backward), 1);
}

#[test]
fn the_next_frame_is_due_a_period_after_the_last() {
    let mut robot = started();
    robot.drive([1.0, 1.0]);
    robot.drive([1.0, 1.0]);
    let last_ns = robot.now_ns;
    let [left, _] = robot.step([1.0, 1.0]);
    let received = Received {
        frame: left,
        stamp_ns: robot.now_ns,
        bus: 0,
    };
    let due_ns = robot.decoder.due_ns(&received).unwrap();
    assert!(
        (due_ns - last_ns - 20_000_000).abs() < 2_000_000,
        "{due_ns} after {last_ns}"
    );
}

#[test]
fn an_hour_without_frames_moves_nobody() {
    let mut robot = started();
    robot.drive([1.0, 1.0]);
    robot.now_ns += 3_600_000_000_000;
    robot.drive([1.0, 1.0]);
    robot.drive([1.0, 1.0]);
    robot.assert_nothing_lost_since([0.0; 2]);
}

#[test]
fn a_spoilt_payload_is_refused_by_its_checksum() {
    let mut robot = started();
    let [left, right] = robot.step([1.0, 1.0]);
    for bit in 0..left.data().len() * 8 {
        let mut data = left.data().to_vec();
        data[bit / 8] ^= 1 << (bit % 8);
        let spoilt = Frame::data_frame(LEFT_ID, &data).unwrap();
        assert_eq!(robot.push(spoilt), Err(FrameReject::Checksum), "bit {bit}");
    }
    robot.push(left).unwrap();
    robot.push(right).unwrap();
    robot.assert_nothing_lost_since([0.0; 2]);
}

#[test]
fn the_other_wheels_payload_is_refused_by_its_checksum() {
    let mut robot = started();
    let [left, _] = robot.step([1.0, 1.0]);
    let swapped = Frame::data_frame(RIGHT_ID, left.data()).unwrap();
    assert_eq!(robot.push(swapped), Err(FrameReject::Checksum));
}

#[test]
fn short_and_remote_frames_are_refused() {
    let mut robot = started();
    let [left, _] = robot.step([1.0, 1.0]);
    let short = Frame::data_frame(LEFT_ID, &left.data()[..5]).unwrap();
    assert_eq!(robot.push(short), Err(FrameReject::Short));
    assert_eq!(
        robot.push(Frame::remote_frame(LEFT_ID, 6).unwrap()),
        Err(FrameReject::Remote)
    );
}

#[test]
fn an_impossible_jump_is_refused_and_a_restart_believed() {
    let mut robot = started();
    robot.drive([1.0, 1.0]);
    let mut restarted = |ticks: u32, alive: u8| {
        robot.now_ns += PERIOD_NS;
        [LEFT_ID, RIGHT_ID].map(|id| robot.push(encoder_frame(id, 0x8000_0000 + ticks, alive)))
    };
    assert_eq!(restarted(0, 2), [Err(FrameReject::Implausible); 2]);
    assert_eq!(restarted(100, 3), [Err(FrameReject::Implausible); 2]);
    assert_eq!(restarted(200, 4), [Ok(None); 2]);
    let [left, right] = restarted(300, 5);
    assert_eq!(left, Ok(None));
    let sample = right.unwrap().unwrap();
    assert!((sample.velocity[0] - 0.5).abs() < 1e-9);
    assert_eq!(robot.decoder.counters().resynchronised, 2);
}

/// One frame of each wheel a period, the right one 3 ms after the left one, from the `begin`th frame on; at the end it stands,
/// so that both wheels have said all.
fn straight_from(begin: usize, speed: f64) -> Robot {
    let mut robot = Robot::new();
    let frames = (0..50).flat_map(|period| {
        let speed = if period < 45 { speed } else { 0.0 };
        let [left, right] = robot.step([speed; 2]);
        [(left, robot.now_ns), (right, robot.now_ns + 3_000_000)]
    });
    let frames: Vec<_> = frames.skip(begin).collect();
    for (frame, stamp_ns) in frames {
        robot.push_at(frame, stamp_ns).unwrap();
    }
    robot
}

/// Of the way of the wheel that was heard first, what lies before the other's first frame is no turn.
#[test]
fn who_begins_to_listen_between_two_wheels_sees_no_turn() {
    for begin in [0, 1, 2, 3] {
        for speed in [1.9, -1.9] {
            let robot = straight_from(begin, speed);
            let [way_m, turned_rad] = robot.travelled;
            assert!(
                turned_rad.abs() < 2.0 * TICK_M / TRACK_M,
                "{turned_rad} rad from {begin} on"
            );
            assert!(
                (way_m - speed * 0.88).abs() < 0.1,
                "{way_m} m from {begin} on"
            );
        }
    }
}

#[test]
fn a_wheel_whose_encoder_starts_again_makes_no_turn() {
    for wheel in [0, 1] {
        let mut robot = started();
        let mut again = WheelFrames::starting_at(0, TICK_M);
        let mut base_m = None;
        for period in 0..60 {
            let speed = if period < 55 { 1.9 } else { 0.0 };
            let mut frames = robot.step([speed; 2]);
            if period >= 30 {
                let base_m = *base_m.get_or_insert(robot.way_m[wheel]);
                frames[wheel] =
                    again.encode(robot.way_m[0] - base_m, robot.way_m[1] - base_m)[wheel];
            }
            for (frame, after_ns) in frames.into_iter().zip([0, 3_000_000]) {
                let _ = robot.push_at(frame, robot.now_ns + after_ns);
            }
        }
        assert_eq!(robot.decoder.counters().resynchronised, 1);
        let [way_m, turned_rad] = robot.travelled;
        assert!(
            turned_rad.abs() < 2.0 * TICK_M / TRACK_M,
            "wheel {wheel}: {turned_rad} rad"
        );
        assert!((way_m - 55.0 * 0.038).abs() < 0.2, "{way_m} m");
    }
}

#[test]
fn a_second_node_on_our_identifiers_changes_nothing() {
    let mut robot = started();
    let mut stranger = WheelFrames::starting_at(0x4000_0000, TICK_M);
    for _ in 0..7 {
        let _sent_before = stranger.encode(0.0, 0.0);
    }
    for period in 0..200 {
        let way_m = f64::from(period) * 0.01;
        let [left, right] = robot.step([1.0, 0.9]);
        for (ours, theirs) in [left, right].into_iter().zip(stranger.encode(way_m, way_m)) {
            robot.push(ours).unwrap();
            let stamp_ns = robot.now_ns + PERIOD_NS / 2;
            assert!(robot.push_at(theirs, stamp_ns).is_err());
        }
    }
    robot.assert_nothing_lost_since([0.0; 2]);
    assert_eq!(robot.samples.len(), 200);
}

#[test]
fn a_sender_that_hangs_makes_no_samples() {
    let mut robot = started();
    robot.drive([1.0, 1.0]);
    let [left, right] = robot.step([1.0, 1.0]);
    for _ in 0..100 {
        let _ = (robot.push(left), robot.push(right));
        robot.now_ns += PERIOD_NS;
    }
    assert_eq!(robot.samples.len(), 2);
    assert_eq!(robot.rejected(FrameReject::Repeated), 198);
}

#[test]
fn a_backlog_loses_nothing_and_makes_few_samples() {
    let mut robot = started();
    (0..3).for_each(|_| robot.drive([1.0, 1.0]));
    let backlog: Vec<_> = (0..10).flat_map(|_| robot.step([1.0, 1.0])).collect();
    for (number, frame) in (0..).zip(backlog) {
        robot.push_at(frame, robot.now_ns + number * 5_000).unwrap();
    }
    // The backlog's first pair makes one; the rest waits until the time is long enough for its way.
    assert_eq!(robot.samples.len(), 3 + 1);
    (0..6).for_each(|_| robot.drive([1.0, 1.0]));
    assert_eq!(robot.samples.len(), 3 + 2);
    (0..20).for_each(|_| robot.drive([1.0, 1.0]));
    robot.assert_nothing_lost_since([0.0; 2]);
    robot.assert_never_faster_than(2.0);
}

#[test]
fn late_frames_that_come_at_once_make_nothing_faster_than_the_robot() {
    for (held, spacing_ns) in [(5, 20_000), (5, 1_200_000), (20, 1_200_000), (40, 100_000)] {
        for speeds in [[1.0, 1.0], [1.9, 1.7], [-1.5, -1.9], [1.9, -1.9]] {
            let mut robot = started();
            (0..3).for_each(|_| robot.drive(speeds));
            let late: Vec<_> = (0..held).map(|_| robot.step(speeds)).collect();
            for (pair, number) in late.into_iter().zip(0..) {
                for frame in pair {
                    robot
                        .push_at(frame, robot.now_ns + number * spacing_ns)
                        .unwrap();
                }
            }
            robot.now_ns += held * spacing_ns;
            (0..1000).for_each(|_| robot.drive(speeds.map(|speed| speed / 2.0)));
            robot.assert_nothing_lost_since([0.0; 2]);
            robot.assert_never_faster_than(2.0);
        }
    }
}

/// While a late way is waited for, each first frame of a pair waits for the second; that is not to use up the patience with
/// the pair after a gap.
#[test]
fn after_late_frames_and_a_gap_both_wheels_are_of_one_moment() {
    let mut robot = started();
    let speeds = [1.99, -1.99];
    let pair = |robot: &mut Robot| {
        let [left, right] = robot.step(speeds);
        robot.push_at(left, robot.now_ns).unwrap();
        robot.push_at(right, robot.now_ns + 1_000_000).unwrap();
    };
    (0..3).for_each(|_| pair(&mut robot));
    let held: Vec<_> = (0..3).flat_map(|_| robot.step(speeds)).collect();
    for frame in held {
        robot.push(frame).unwrap();
    }
    (0..4).for_each(|_| pair(&mut robot));
    for _ in 0..90 {
        robot.step(speeds);
    }
    (0..200).for_each(|_| pair(&mut robot));
    (0..200).for_each(|_| robot.drive([0.0; 2]));
    robot.assert_nothing_lost_since([0.0; 2]);
    robot.assert_never_faster_than(2.0);
}

/// One wheel's frames are lost until nobody waits for them any more, and then nothing comes for a while.
#[test]
fn after_a_lost_wheel_and_a_gap_both_wheels_are_of_one_moment() {
    for lost in 1..8 {
        let mut robot = started();
        let speeds = [-1.7, 1.7];
        robot.drive(speeds);
        let [_, right] = robot.step(speeds);
        robot.push(right).unwrap();
        for _ in 1..lost {
            let [left, _] = robot.step(speeds);
            robot.push(left).unwrap();
        }
        for _ in 0..600 {
            robot.step(speeds);
        }
        (0..20).for_each(|_| robot.drive(speeds));
        (0..20).for_each(|_| robot.drive([0.0; 2]));
        robot.assert_nothing_lost_since([0.0; 2]);
        robot.assert_never_faster_than(2.0);
    }
}

#[test]
fn a_robot_that_is_faster_than_it_can_be_is_not_believed() {
    let mut robot = started();
    let mut refused = 0;
    for _ in 0..200 {
        for frame in robot.step([6.9, 6.9]) {
            refused += u64::from(robot.push(frame) == Err(FrameReject::Implausible));
        }
    }
    robot.assert_never_faster_than(2.0);
    assert!(refused > 2, "refused {refused} times");
    assert_eq!(robot.rejected(FrameReject::Implausible), refused);
}

#[test]
fn equal_stamps_never_divide_by_zero() {
    let mut robot = started();
    let stamp_ns = robot.now_ns;
    for _ in 0..50 {
        for frame in robot.step([1.0, 1.0]) {
            assert_eq!(robot.push_at(frame, stamp_ns).unwrap_or(None), None);
        }
    }
}

#[test]
fn one_wheel_alone_makes_no_sample() {
    let mut robot = started();
    for _ in 0..50 {
        let [left, _] = robot.step([1.0, 1.0]);
        assert_eq!(robot.push(left), Ok(None));
    }
    robot.drive([1.0, 1.0]);
    robot.assert_nothing_lost_since([0.0; 2]);
}

#[test]
fn frames_of_others_are_passed_over() {
    let mut robot = started();
    let stranger = Frame::data_frame(StandardId::new(0x102).unwrap(), &[0xFF; 8]).unwrap();
    let before = *robot.decoder.counters();
    assert_eq!(robot.push(stranger), Ok(None));
    assert_eq!(robot.push(Frame::error_frame(0x100, [0; 8])), Ok(None));
    let [left, _] = robot.step([1.0, 1.0]);
    assert_eq!(
        robot.decoder.push(&Received {
            frame: left,
            stamp_ns: robot.now_ns,
            bus: 1
        }),
        Ok(None)
    );
    assert_eq!(*robot.decoder.counters(), before);
    assert_eq!(
        robot.decoder.wanted_ids(0).collect::<Vec<_>>(),
        [Id::from(LEFT_ID), Id::from(RIGHT_ID)]
    );
    assert_eq!(robot.decoder.wanted_ids(1).count(), 0);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_frames_at_any_time_give_finite_samples_or_none(
        frames in proptest::collection::vec((any::<bool>(), any::<bool>(), any::<[u8; 8]>(), 0..=8_usize, any::<i64>()), 0..60),
    ) {
        let mut decoder = OdometryDecoder::new(&config()).unwrap();
        for (right, valid, data, len, stamp_ns) in frames {
            let id = if right { RIGHT_ID } else { LEFT_ID };
            let ticks = u32::from_le_bytes([data[0], data[1], data[2], data[3]]);
            let frame = if valid { encoder_frame(id, ticks, data[4]) } else { Frame::data_frame(id, &data[..len]).unwrap() };
            if let Ok(Some(sample)) = decoder.push(&Received { frame, stamp_ns, bus: 0 }) {
                prop_assert!(sample.velocity.iter().all(|v| v.is_finite()));
                prop_assert!(sample.start_ns < sample.stamp_ns);
            }
        }
    }

    #[test]
    fn whatever_is_lost_the_way_is_kept(lost in proptest::collection::vec(any::<[bool; 2]>(), 1..100)) {
        let mut robot = started();
        for lost in lost {
            for (frame, lost) in robot.step([1.0, 0.7]).into_iter().zip(lost) {
                // With a whole turn of the alive counter lost, a frame looks like the last one; the next brings its way.
                if !lost && let Err(reject) = robot.push(frame) {
                    prop_assert_eq!(reject, FrameReject::Repeated);
                }
            }
        }
        (0..20).for_each(|_| robot.drive([1.0, 0.7]));
        robot.assert_nothing_lost_since([0.0; 2]);
        robot.assert_never_faster_than(2.0);
    }
}
