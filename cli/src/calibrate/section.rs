//! The sections of `robot.toml` that change. What no setting says is said in a comment.

use std::fmt::Write as _;

use coloc_calibrate::{Coefficients, Fit, Found, Parameter, Robot};
use coloc_daemon::config::{self, Config, Variance};
use coloc_drivers::encoder::{
    AngleUnit, BaseConfig, BicycleConfig, Quantity, SteeringConfig, WheelConfig, WheelsConfig,
};
use serde::Serialize;

use super::read::Recorded;

#[derive(Serialize)]
struct Sections {
    #[serde(skip_serializing_if = "Option::is_none")]
    odometry: Option<Odometry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    motion: Option<Motion>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fusion: Option<Fusion>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gyro: Option<config::Gyro>,
    #[serde(skip_serializing_if = "Option::is_none")]
    position: Option<config::Position>,
}

#[derive(Serialize)]
struct Odometry {
    #[serde(skip_serializing_if = "Option::is_none")]
    wheels: Option<WheelsConfig>,
    #[serde(skip_serializing_if = "Option::is_none")]
    base: Option<BaseConfig>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bicycle: Option<BicycleConfig>,
}

#[derive(Serialize)]
struct Motion {
    forward: Variance,
    sideways: Variance,
    turning: Variance,
    creep_per_hour: [f64; 3],
}

#[derive(Serialize)]
struct Fusion {
    position_floor: [f64; 2],
}

/// As TOML; nothing if nothing changes.
pub(super) fn sections(
    config: &Config,
    recorded: &Recorded,
    fit: &Fit,
) -> Result<String, toml::ser::Error> {
    let shown = |is_of_it: fn(Parameter) -> bool| {
        fit.found
            .iter()
            .any(|it| it.shown && is_of_it(it.parameter))
    };
    let of_wheels = shown(|it| {
        matches!(
            it,
            Parameter::Scale
                | Parameter::Difference
                | Parameter::Track
                | Parameter::SteeringOffset
                | Parameter::SteeringRatio
        )
    });
    let of_noise = shown(|it| matches!(it, Parameter::Noise(..) | Parameter::Standstill));
    let of_fixes = shown(|it| matches!(it, Parameter::FixSigma(_)));
    let sections = Sections {
        odometry: of_wheels.then(|| odometry(config, &fit.robot)).flatten(),
        motion: of_noise.then(|| motion(config, fit)),
        fusion: of_fixes.then(|| Fusion {
            position_floor: floor(&fit.robot),
        }),
        gyro: gyro(config, fit),
        position: position(config, recorded, fit),
    };
    let mut text = toml::to_string(&sections)?;
    for line in remarks(config, recorded, fit) {
        // A string takes all.
        let _ = writeln!(text, "# {line}");
    }
    Ok(text)
}

fn odometry(config: &Config, robot: &Robot) -> Option<Odometry> {
    let [left, right] = robot.wheels.factors();
    let odometry = config.odometry.as_ref()?;
    let wheels = odometry.wheels.as_ref().map(|it| WheelsConfig {
        track_m: rounded(robot.wheels.span_m * it.turning_scale),
        turning_scale: it.turning_scale,
        left: scaled(&it.left, left),
        right: scaled(&it.right, right),
    });
    let base = odometry.base.as_ref().filter(|it| it.track_m.is_some());
    let base = base.map(|it| BaseConfig {
        track_m: Some(rounded(robot.wheels.span_m)),
        metres_per_count: it
            .metres_per_count
            .map(|[a, b]| [rounded(a * left), rounded(b * right)]),
        ..it.clone()
    });
    let bicycle = odometry.bicycle.as_ref().map(|it| steered(it, robot));
    let any = wheels.is_some() || base.is_some() || bicycle.is_some();
    any.then_some(Odometry {
        wheels,
        base,
        bicycle,
    })
}

/// The angle of the road wheels is (signal − straight)/ratio before, and that times the ratio that was found plus the offset after.
fn steered(before: &BicycleConfig, robot: &Robot) -> BicycleConfig {
    let (wheels, steering) = (&robot.wheels, &before.steering);
    let ratio = steering.ratio / wheels.steering_ratio;
    let offset = match steering.unit {
        AngleUnit::Radians => wheels.steering_offset_rad,
        AngleUnit::Degrees => wheels.steering_offset_rad.to_degrees(),
    };
    let sign = if steering.reversed { 1.0 } else { -1.0 };
    BicycleConfig {
        wheel: scaled(&before.wheel, wheels.scale),
        steering: SteeringConfig {
            ratio: rounded(ratio),
            straight: rounded(steering.straight + sign * offset * ratio),
            ..steering.clone()
        },
        ..before.clone()
    }
}

fn scaled(wheel: &WheelConfig, factor: f64) -> WheelConfig {
    let times = |it: Option<f64>| it.map(|it| rounded(it * factor));
    WheelConfig {
        metres_per_tick: times(wheel.metres_per_tick),
        wheel_radius_m: times(wheel.wheel_radius_m),
        ..wheel.clone()
    }
}

fn motion(config: &Config, fit: &Fit) -> Motion {
    let written = |of: &Coefficients, before: Variance| Variance {
        a: 0.0,
        b: before.b,
        c: before.c,
        per_s: rounded(of.per_s),
        per_m: rounded(of.per_m),
        per_rad: rounded(of.per_rad),
    };
    let it = &config.motion;
    let [forward, sideways, turning] = &fit.robot.noise;
    Motion {
        forward: written(forward, it.forward),
        sideways: written(sideways, it.sideways),
        turning: written(turning, it.turning),
        creep_per_hour: fit
            .robot
            .standing
            .map(|it| rounded(3.0 * (3600.0 * it).sqrt())),
    }
}

fn floor(robot: &Robot) -> [f64; 2] {
    let most = robot
        .receivers
        .iter()
        .map(|it| it.sigma_m)
        .fold(0.0, f64::max);
    [rounded(most); 2]
}

/// The recorded rate is that of the sensor times the scale that was configured.
fn gyro(config: &Config, fit: &Fit) -> Option<config::Gyro> {
    let found = fit.robot.gyro?;
    let before = &config.gyro;
    let is_shown = |of| fit.found.iter().any(|it| it.shown && it.parameter == of);
    let mut after = before.clone();
    if is_shown(Parameter::GyroScale) {
        after.scale = rounded(before.scale * found.scale);
    }
    if is_shown(Parameter::GyroBias) {
        after.bias_radps = rounded(found.bias_radps / before.scale);
    }
    if is_shown(Parameter::GyroNoise) {
        after.noise_density = rounded(found.per_s.sqrt());
    }
    (after != *before).then_some(after)
}

/// Of one receiver in `[position]` itself, of several an entry each.
fn position(config: &Config, recorded: &Recorded, fit: &Fit) -> Option<config::Position> {
    let mut after = config.position.clone();
    for (index, source) in recorded.sources.iter().enumerate() {
        let found = receiver(config, fit, index, *source);
        let own = after.receiver.iter_mut().find(|it| it.source == *source);
        match own {
            Some(own) => *own = found,
            None if recorded.sources.len() > 1 => after.receiver.push(found),
            None => {
                after = config::Position {
                    lever_m: found.lever_m,
                    slow_sigma_m: found.slow_sigma_m,
                    slow_time_s: found.slow_time_s,
                    delay_s: found.delay_s,
                    ..after
                };
            }
        }
    }
    (after != config.position).then_some(after)
}

/// As it is configured, but for what the drive shows.
fn receiver(config: &Config, fit: &Fit, index: usize, source: u16) -> config::Receiver {
    let all = &config.position;
    let own = all.receiver.iter().find(|it| it.source == source);
    let mut after = own.cloned().unwrap_or(config::Receiver {
        source,
        lever_m: all.lever_m,
        slow_sigma_m: all.slow_sigma_m,
        slow_time_s: all.slow_time_s,
        delay_s: all.delay_s,
    });
    let found = &fit.robot.receivers[index];
    for it in fit.found.iter().filter(|it| it.shown) {
        match it.parameter {
            Parameter::SlowSigma(of) if of == index => {
                (after.slow_sigma_m, after.slow_time_s) =
                    (rounded(found.slow_sigma_m), rounded(found.slow_time_s));
            }
            Parameter::LeverForward(of) if of == index => {
                after.lever_m[0] = rounded(found.lever_m[0]);
            }
            Parameter::LeverLeft(of) if of == index => after.lever_m[1] = rounded(found.lever_m[1]),
            Parameter::Delay(of) if of == index => {
                after.delay_s = rounded(after.delay_s + found.delay_s);
            }
            _ => {}
        }
    }
    after
}

/// What has no setting of its own.
fn remarks(config: &Config, recorded: &Recorded, fit: &Fit) -> Vec<String> {
    let mut lines = Vec::new();
    let wheels = config.odometry.as_ref().and_then(|it| it.wheels.as_ref());
    let by_speed = |it: &WheelConfig| {
        matches!(
            it.quantity,
            Quantity::MetresPerSecond | Quantity::KilometresPerHour
        )
    };
    if let Some(wheels) = wheels.filter(|it| by_speed(&it.left) || by_speed(&it.right)) {
        for (wheel, factor) in [&wheels.left, &wheels.right]
            .into_iter()
            .zip(fit.robot.wheels.factors())
        {
            lines.push(format!(
                "in the DBC file, multiply factor and offset of {}.{} by {factor:.5}",
                wheel.message, wheel.signal
            ));
        }
    }
    let turn = fit.found.iter().filter(|it| it.shown);
    lines.extend(
        turn.filter(|it| it.parameter == Parameter::TurnScale)
            .map(|it| format!("multiply the turning rate that is said by {:.5}", it.after)),
    );
    for (index, source) in recorded.sources.iter().enumerate() {
        let of_it = |it: &&Found| it.shown && it.parameter.receiver() == Some(index);
        if recorded.says_itself[index] && fit.found.iter().any(|it| of_it(&it)) {
            lines.push(format!(
                "receiver {source} says lever or slow error itself, and its word comes first: change it there"
            ));
        }
    }
    lines
}

/// To six digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.
mod tests {
    use coloc_calibrate::{Base, Wheels};

    use super::*;

    const BICYCLE: &str = r#"
wheel_base_m = 2.5
wheel = { message = "Wheel", signal = "Ticks", metres_per_tick = 1e-4 }
steering = { message = "Steering", signal = "Angle", unit = "degrees", straight = 3.0, ratio = 15.0, reversed = true }
"#;

    fn angle(steering: &SteeringConfig, signal: f64) -> f64 {
        -(signal - steering.straight).to_radians() / steering.ratio
    }

    #[test]
    fn what_is_written_of_a_steering_is_what_was_found() {
        let before: BicycleConfig = toml::from_str(BICYCLE).unwrap();
        let wheels = Wheels {
            base: Base::Steered,
            scale: 1.01,
            steering_offset_rad: 0.02,
            steering_ratio: 1.1,
            ..Wheels::axle(2.5)
        };
        let robot = Robot {
            wheels,
            noise: [Coefficients::default(); 3],
            standing: [0.0; 3],
            missing: [0.0; 3],
            gyro: None,
            receivers: Vec::new(),
            heading_rad: 0.0,
        };
        let after = steered(&before, &robot);
        for signal in [-40.0, 3.0, 90.0] {
            let found = 1.1 * angle(&before.steering, signal) + 0.02;
            let written = angle(&after.steering, signal);
            assert!(
                (found - written).abs() < 1e-5,
                "{signal}: {found} {written}"
            );
        }
        assert_eq!(after.wheel.metres_per_tick, Some(1.01e-4));
    }
}
