//! Wheels of which each says a part of the motion.

use crate::config_error::ConfigError;

use super::super::config::{FourWheelsConfig, MecanumConfig, OmniConfig, WheelConfig};
use super::super::kinematics::Kinematics;
use super::super::least_squares::LeastSquares;
use super::super::merge::MAX_CHANNELS;
use super::super::slip::SlipLimits;
use super::super::words::{Length, Rounded};
use super::axle::{plan_wheels, skidding};
use super::planner::Planner;
use super::scale::positive;

/// The settings of each wheel, in their order.
pub(super) const FOUR_WHEELS: [&str; 4] = [
    "four_wheels.front_left",
    "four_wheels.front_right",
    "four_wheels.rear_left",
    "four_wheels.rear_right",
];
pub(super) const MECANUM: [&str; 4] = [
    "mecanum.front_left",
    "mecanum.front_right",
    "mecanum.rear_left",
    "mecanum.rear_right",
];
pub(super) const OMNI: [&str; 4] = [
    "omni.wheels.0.wheel",
    "omni.wheels.1.wheel",
    "omni.wheels.2.wheel",
    "omni.wheels.3.wheel",
];

type Planned = (Kinematics, SlipLimits);

pub(super) fn four<'a>(
    planner: &mut Planner<'a>,
    four: &'a FourWheelsConfig,
) -> Result<Planned, ConfigError> {
    let track_m = positive("four_wheels.track_m", four.track_m)?;
    let scale = positive("four_wheels.turning_scale", four.turning_scale)?;
    plan_wheels(planner, &named(FOUR_WHEELS, four.each()))?;
    planner.description.geometry = format!(
        "two wheels on each side, {} apart{}; {}",
        Length(track_m),
        skidding(track_m, scale),
        slip_in_words(
            "the two of a side",
            "differ",
            four.slip_mps,
            four.slip_share
        )
    );
    let wheels = LeastSquares::four(track_m, scale, four.wheel_per_m);
    let limits = limits(FOUR_WHEELS, four.slip_mps, four.slip_share, track_m / 2.0);
    Ok((Kinematics::LeastSquares(wheels), limits))
}

pub(super) fn mecanum<'a>(
    planner: &mut Planner<'a>,
    mecanum: &'a MecanumConfig,
) -> Result<Planned, ConfigError> {
    let length_m = positive("mecanum.half_length_m", mecanum.half_length_m)?;
    let width_m = positive("mecanum.half_width_m", mecanum.half_width_m)?;
    plan_wheels(planner, &named(MECANUM, mecanum.each()))?;
    planner.description.geometry = format!(
        "four mecanum wheels, {} from the front to the rear axle and {} from left to right; {}",
        Length(2.0 * length_m),
        Length(2.0 * width_m),
        slip_in_words("one", "is off", mecanum.slip_mps, mecanum.slip_share)
    );
    let wheels = LeastSquares::mecanum(length_m, width_m, mecanum.wheel_per_m);
    let wheels = wheels.ok_or_else(|| {
        ConfigError::setting("mecanum", "these lengths leave the turning rate open")
    })?;
    let limits = limits(
        MECANUM,
        mecanum.slip_mps,
        mecanum.slip_share,
        length_m + width_m,
    );
    Ok((Kinematics::LeastSquares(wheels), limits))
}

pub(super) fn omni<'a>(
    planner: &mut Planner<'a>,
    omni: &'a OmniConfig,
) -> Result<Planned, ConfigError> {
    let count = omni.wheels.len();
    if !(3..=MAX_CHANNELS).contains(&count) {
        let problem = format!("are {count}; three or four omni wheels are needed");
        return Err(ConfigError::setting("omni.wheels", problem));
    }
    let mut places = Vec::new();
    for (number, wheel) in omni.wheels.iter().enumerate() {
        let setting = format!("omni.wheels.{number}.distance_m");
        let distance_m = positive(&setting, wheel.distance_m)?;
        places.push([wheel.angle_deg.to_radians(), distance_m]);
    }
    let wheels = omni.wheels.iter().map(|it| &it.wheel);
    let wheels: Vec<_> = OMNI.into_iter().zip(wheels).collect();
    plan_wheels(planner, &wheels)?;
    let at = omni.wheels.iter().map(|it| {
        let (angle, distance) = (Rounded(it.angle_deg), Length(it.distance_m));
        format!("{angle}° at {distance}")
    });
    let at = at.collect::<Vec<_>>().join(", ");
    let slip = if count == MAX_CHANNELS {
        slip_in_words("one", "is off", omni.slip_mps, omni.slip_share)
    } else {
        "three say no more than there is to say, so slip is not seen".into()
    };
    planner.description.geometry = format!("{count} omni wheels, {at}; {slip}");
    let made = LeastSquares::omni(&places, omni.wheel_per_m);
    let made = made.ok_or_else(|| {
        let problem =
            "so placed they leave a direction open: no three of them point different ways";
        ConfigError::setting("omni.wheels", problem)
    })?;
    #[expect(clippy::cast_precision_loss, reason = "four at most")]
    let lever_m = places.iter().map(|[_, it]| it).sum::<f64>() / count as f64;
    let limits = limits(OMNI, omni.slip_mps, omni.slip_share, lever_m);
    Ok((Kinematics::LeastSquares(made), limits))
}

fn named<'a>(
    settings: [&'static str; 4],
    wheels: [&'a WheelConfig; 4],
) -> Vec<(&'a str, &'a WheelConfig)> {
    settings.into_iter().zip(wheels).collect()
}

fn limits(names: [&'static str; MAX_CHANNELS], mps: f64, share: f64, lever_m: f64) -> SlipLimits {
    SlipLimits {
        names,
        mps,
        share,
        counts_m: [0.0; MAX_CHANNELS],
        lever_m,
    }
}

fn slip_in_words(who: &str, how: &str, mps: f64, share: f64) -> String {
    format!(
        "they slip where {who} {how} by more than {mps} m/s and {} % of the fastest wheel's speed",
        Rounded(share * 100.0)
    )
}
