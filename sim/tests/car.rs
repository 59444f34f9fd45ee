//! A real car, calibrated on the first half of a minute and judged on the second.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::PathBuf;

use coloc_calibrate::{
    Coefficients, Drive, Fit, Found, Parameter, Receiver, Robot, SampleSize, Wheels,
    dead_reckoning, fit,
};
use coloc_estimator::Pose;
use coloc_sim::car::{Car, Sample};

/// `COLOC_DATA`, or `../shared/data` of this folder or of one above it.
fn car() -> Option<Car> {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let beside = || {
        let mut all = here.ancestors().map(|folder| folder.join("../shared/data"));
        all.find(|folder| folder.is_dir())
    };
    let data = std::env::var_os("COLOC_DATA")
        .map(PathBuf::from)
        .or_else(beside);
    let folder = data
        .map(|data| data.join("rav4_can"))
        .filter(|it| it.is_dir());
    if folder.is_none() {
        eprintln!("SKIPPED: no recording rav4_can; set COLOC_DATA to the folder that holds it");
    }
    folder.map(|folder| Car::read(&folder).unwrap())
}

/// As the preset `car` has it, with a receiver of which little is known.
fn configured() -> Robot {
    let noise = |[per_s, per_m, per_rad]: [f64; 3]| Coefficients {
        per_s,
        per_m,
        per_rad,
        ..Coefficients::default()
    };
    Robot {
        wheels: Wheels::axle(1.55),
        noise: [
            [4e-6, 1e-4, 0.0],
            [4e-6, 1e-4, 2.5e-3],
            [5.1e-6, 3e-6, 4e-4],
        ]
        .map(noise),
        standing: [3e-7, 3e-7, 8e-8],
        missing: [1.0; 3],
        gyro: None,
        receivers: vec![Receiver {
            sigma_m: 0.3,
            slow_sigma_m: 1.0,
            slow_time_s: 30.0,
            ..Receiver::default()
        }],
        heading_rad: 0.0,
    }
}

fn found(fit: &Fit, parameter: Parameter) -> Found {
    *fit.found
        .iter()
        .find(|it| it.parameter == parameter)
        .unwrap()
}

fn heading(sample: &Sample) -> f64 {
    let [east, north] = sample.velocity;
    north.atan2(east)
}

/// Metres along the way that the wheels are off at the end of the second half, that way's length, and the heading's error.
fn off(car: &Car, drive: &Drive, robot: &Robot, [from_s, to_s]: [f64; 2]) -> [f64; 3] {
    let [begin, end] = [from_s, to_s].map(|it| car.at(it).unwrap());
    let pose = Pose::new(begin.position[0], begin.position[1], heading(&begin));
    let reached = dead_reckoning(drive, robot, [from_s, to_s], pose);
    let ahead = [0, 1].map(|it: usize| end.position[it] - begin.position[it]);
    let length = ahead[0].hypot(ahead[1]);
    let off = [reached.x - end.position[0], reached.y - end.position[1]];
    let along = (off[0] * ahead[0] + off[1] * ahead[1]) / length;
    [along, length, reached.phi - heading(&end)]
}

#[test]
fn a_car_is_calibrated_on_the_first_half_and_judged_on_the_second() {
    let Some(car) = car() else { return };
    let all = Drive::new(car.ways.clone(), car.fixes.clone());
    let half_s = 0.5 * (all.begin_s() + all.end_s());
    let first = all.until(half_s);
    let fit = fit(&first, &configured(), &|_| {}).unwrap();
    let judged = [half_s, all.end_s() - 0.1];
    let before = off(&car, &all, &configured(), judged);
    let after = off(&car, &all, &fit.robot, judged);
    let size = SampleSize::of(&first, &fit.likely, 0);
    let late = found(&fit, Parameter::Delay(0));
    eprintln!(
        "before {before:?}, after {after:?}; {size:?}; scale {:?}; late by {late:?}; right wheel {:?}",
        found(&fit, Parameter::Scale),
        found(&fit, Parameter::Difference)
    );
    assert!(after[0].abs() <= 0.003 * after[1], "{after:?}");
    assert!(before[0].abs() > 0.01 * before[1], "{before:?}");
    // A way that straight turns nowhere: the track is not seen. That one wheel is larger is: the way bends.
    assert!(!found(&fit, Parameter::Track).shown);
    let difference = found(&fit, Parameter::Difference);
    assert!(difference.shown && after[2].abs() < 0.25 * before[2].abs());
    // Errors that last for longer than the drive: hundreds of fixes are hardly more than one.
    assert!(size.fixes > 250 && size.effective < 5.0, "{size:?}");
}

#[test]
fn the_delay_of_the_fixes_and_their_offset_from_the_reference_are_one_thing() {
    let Some(car) = car() else { return };
    let mut took = car.took_s.clone();
    took.sort_by(f64::total_cmp);
    assert!(
        (took[took.len() / 2] - 0.2).abs() < 0.01,
        "they arrive 0.2 s after they were true"
    );
    let all = Drive::new(car.ways.clone(), car.fixes.clone());
    let fit = fit(&all.until(30.0), &configured(), &|_| {}).unwrap();
    let late = found(&fit, Parameter::Delay(0));
    assert!(late.shown && late.interval[1] < 0.0, "{late:?}");
    let along = |shift_s: f64| {
        let fixes = car
            .fixes
            .iter()
            .filter_map(|fix| Some((fix, car.at(fix.stamp_s - shift_s)?)));
        let (mut sum, mut count) = (0.0, 0.0);
        for (fix, it) in fixes {
            let speed = it.velocity[0].hypot(it.velocity[1]);
            let off = [0, 1].map(|axis: usize| fix.position[axis] - it.position[axis]);
            sum += (off[0] * it.velocity[0] + off[1] * it.velocity[1]) / speed;
            count += 1.0;
        }
        sum / count
    };
    // By their own stamps they are 2.0 m ahead of the reference; with the delay that the wheels show, nothing is left.
    assert!((along(0.0) - 2.0).abs() < 0.1, "{}", along(0.0));
    assert!(along(late.after).abs() < 0.5, "{}", along(late.after));
}
