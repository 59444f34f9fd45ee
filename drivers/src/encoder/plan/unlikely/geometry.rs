//! Of where the wheels are.

use super::super::super::config::{
    BicycleConfig, FourWheelsConfig, MecanumConfig, OdometryConfig, OmniConfig, WheelsConfig,
};
use super::super::super::words::{Length, Rounded};
use super::super::rolling::{FOUR_WHEELS, MECANUM, OMNI};
use super::{Named, of_track, of_wheels};

/// Wheels that skid turn less than they say, and not much less than half \[1\].
const TURNING_SCALES: std::ops::RangeInclusive<f64> = 0.2..=1.2;

/// Cars, and toys of them \[m\].
const WHEEL_BASES_M: std::ops::RangeInclusive<f64> = 0.05..=10.0;

/// From a wheel to the middle of a robot \[m\].
const DISTANCES_M: std::ops::RangeInclusive<f64> = 0.02..=3.0;

/// Steering wheels turn so much more than road wheels at most.
const MOST_RATIO: f64 = 40.0;

pub(super) fn of(config: &OdometryConfig) -> Vec<String> {
    [
        config.wheels.as_ref().map(axle),
        config.four_wheels.as_ref().map(four),
        config.bicycle.as_ref().map(bicycle),
        config.mecanum.as_ref().map(mecanum),
        config.omni.as_ref().map(omni),
    ]
    .into_iter()
    .flatten()
    .flatten()
    .collect()
}

fn axle(wheels: &WheelsConfig) -> Vec<String> {
    let both: [Named<'_>; 2] = [
        ("wheels.left", &wheels.left),
        ("wheels.right", &wheels.right),
    ];
    let odd = of_track("wheels.track_m", wheels.track_m);
    let scale = of_scale("wheels.turning_scale", wheels.turning_scale);
    odd.into_iter()
        .chain(scale)
        .chain(of_wheels(&both))
        .collect()
}

fn four(four: &FourWheelsConfig) -> Vec<String> {
    let odd = of_track("four_wheels.track_m", four.track_m);
    let scale = of_scale("four_wheels.turning_scale", four.turning_scale);
    let wheels: Vec<_> = FOUR_WHEELS.into_iter().zip(four.each()).collect();
    odd.into_iter()
        .chain(scale)
        .chain(of_wheels(&wheels))
        .collect()
}

fn of_scale(setting: &str, scale: f64) -> Option<String> {
    (!TURNING_SCALES.contains(&scale)).then(|| {
        format!(
            "{setting}: is {}: the robot turns so much of what its wheels say; is it the other way round?",
            Rounded(scale)
        )
    })
}

fn bicycle(bicycle: &BicycleConfig) -> Vec<String> {
    let base_m = bicycle.wheel_base_m;
    let odd = (!WHEEL_BASES_M.contains(&base_m)).then(|| {
        let apart = Length(base_m);
        format!("bicycle.wheel_base_m: the axles are {apart} apart: is that the unit?")
    });
    let far = (bicycle.lateral_m.abs() > base_m).then(|| {
        format!(
            "bicycle.lateral_m: is {}, more than the wheel base: is that half the track?",
            Length(bicycle.lateral_m)
        )
    });
    let steering = &bicycle.steering;
    let geared = (steering.ratio > MOST_RATIO).then(|| {
        format!(
            "bicycle.steering.ratio: is {}: a steering wheel turns about 15 times as far as the road wheels",
            Rounded(steering.ratio)
        )
    });
    let wheel = [("bicycle.wheel", &bicycle.wheel)];
    odd.into_iter()
        .chain(far)
        .chain(geared)
        .chain(of_wheels(&wheel))
        .collect()
}

fn mecanum(mecanum: &MecanumConfig) -> Vec<String> {
    let length = of_distance("mecanum.half_length_m", mecanum.half_length_m);
    let width = of_distance("mecanum.half_width_m", mecanum.half_width_m);
    let wheels: Vec<_> = MECANUM.into_iter().zip(mecanum.each()).collect();
    length
        .into_iter()
        .chain(width)
        .chain(of_wheels(&wheels))
        .collect()
}

fn omni(omni: &OmniConfig) -> Vec<String> {
    let far = omni.wheels.iter().enumerate().filter_map(|(place, wheel)| {
        of_distance(&format!("omni.wheels.{place}.distance_m"), wheel.distance_m)
    });
    let wheels = OMNI.into_iter().zip(omni.wheels.iter().map(|it| &it.wheel));
    let wheels: Vec<_> = wheels.collect();
    far.chain(of_wheels(&wheels)).collect()
}

fn of_distance(setting: &str, metres: f64) -> Option<String> {
    let far = Length(metres);
    (!DISTANCES_M.contains(&metres)).then(|| format!("{setting}: is {far}: is that the unit?"))
}
