//! Every kinematic, from frames on a bus to the pose: against an integrator at 10 kHz, at 10, 50 and 200 Hz.
//!
//! Without noise, two kinds of drives:
//!
//! * `Stepwise`: the body's velocity is another in every interval and constant within it, which is what a sample says: the way is
//!   a sequence of arcs and has to be met to rounding, and to the counts' fineness. A steered car cannot jump from one angle to another:
//!   there the speed is constant within an interval and the angle runs straight from one frame to the next.
//! * `Smooth`: velocities swing slowly, and counts and speeds are the exact integrals over each interval. What is left is that a
//!   mean velocity is no arc.
//!
//! With noise (`Stepwise` drives): each wheel's way, the steering angle in each frame, and the body's slip have the noise that is
//! configured. The position's error squared, by the covariance that the estimator says, is 2 in the mean.
//!
//! A few drives each are for every day. `cargo nextest run --release -p coloc-tests --test kinematics --run-ignored only` takes
//! a thousand, some minutes long.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod drive;
mod robot;
mod run;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use drive::Kind;
use robot::{ROBOTS, Robot, Says};
use run::{Noise, Outcome, ride};

const RATES_HZ: [u32; 3] = [10, 50, 200];

/// Of all drives, on every processor there is; each has its own number, and so its own randomness.
fn ride_all(drives: u32, one: impl Fn(u32) -> Vec<Outcome> + Sync) -> Vec<Outcome> {
    let (next, all) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Ok(number) = u32::try_from(next.fetch_add(1, Ordering::Relaxed)) {
                    if number >= drives {
                        break;
                    }
                    let made = one(number);
                    all.lock().unwrap().push((number, made));
                }
            });
        }
    });
    let mut all = all.into_inner().unwrap();
    all.sort_by_key(|(number, _)| *number);
    all.into_iter().flat_map(|(_, made)| made).collect()
}

/// The worst of way and heading, in parts of the way.
fn worst(outcomes: &[Outcome]) -> [f64; 2] {
    outcomes.iter().fold([0.0, 0.0], |[way, heading], it| {
        [
            way.max(it.off_m / it.way_m),
            heading.max(it.turned_off_rad.abs() / it.way_m),
        ]
    })
}

fn without_noise(kind: Kind, drives: u32) {
    for robot in ROBOTS {
        for rate_hz in RATES_HZ {
            let outcomes = ride_all(drives, |number| {
                let drive = robot.drive(kind, rate_hz, number);
                let says = [Says::Counts, Says::Speeds];
                says.map(|says| ride(robot, says, &drive, Noise::None))
                    .into()
            });
            assert_eq!(outcomes.len(), 2 * drives as usize);
            let [way, heading] = worst(&outcomes);
            println!(
                "{robot:?} {kind:?} {rate_hz} Hz: way {way:.1e}, heading {heading:.1e} of the way"
            );
            assert!(
                way <= 1e-4 && heading <= 1e-4,
                "{robot:?} {kind:?} {rate_hz} Hz"
            );
        }
    }
}

/// The mean of the position's normalised error squared over this many rides is within `by` of 2.
fn with_noise(drives: u32, rides: u32, by: f64) {
    for robot in ROBOTS {
        for rate_hz in RATES_HZ {
            let outcomes = ride_all(drives, |number| {
                let drive = robot.drive(Kind::Stepwise, rate_hz, number);
                let noise = |ride| Noise::Seed(u64::from(number) << 8 | u64::from(ride));
                (0..rides)
                    .map(|it| ride(robot, Says::Counts, &drive, noise(it)))
                    .collect()
            });
            let mean = |of: fn(&Outcome) -> f64| {
                let count = f64::from(drives * rides);
                outcomes.iter().map(of).sum::<f64>() / count
            };
            let (position, heading) = (mean(|it| it.position_nees), mean(|it| it.heading_nees));
            println!(
                "{robot:?} {rate_hz} Hz: NEES {position:.3} of the position, {heading:.3} of the heading"
            );
            assert!(
                (position - 2.0).abs() <= by,
                "{robot:?} {rate_hz} Hz: {position}"
            );
            assert!(
                (heading - 1.0).abs() <= by,
                "{robot:?} {rate_hz} Hz: {heading}"
            );
        }
    }
}

#[test]
fn stepwise_drives_are_met() {
    without_noise(Kind::Stepwise, 2);
}

#[test]
fn smooth_drives_are_met() {
    without_noise(Kind::Smooth, 2);
}

/// By so few the mean is known to 0.3 (3 σ of it); a wrong track or a forgotten wheel is farther off.
#[test]
fn the_error_is_as_large_as_said() {
    with_noise(12, 32, 0.3);
}

#[test]
#[ignore = "a thousand drives each"]
fn a_thousand_stepwise_drives_are_met() {
    without_noise(Kind::Stepwise, 1000);
}

#[test]
#[ignore = "a thousand drives each"]
fn a_thousand_smooth_drives_are_met() {
    without_noise(Kind::Smooth, 1000);
}

#[test]
#[ignore = "a thousand drives each"]
fn the_error_of_a_thousand_drives_is_as_large_as_said() {
    with_noise(1000, 6, 0.1);
}

#[test]
fn every_robot_has_its_wheels() {
    let wheels = ROBOTS.map(Robot::channels);
    assert_eq!(wheels, [2, 4, 1, 1, 4, 3, 4]);
}
