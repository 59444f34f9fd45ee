//! The two wheels of an axle.

use crate::config_error::ConfigError;

use super::super::channel::Measure;
use super::super::config::{Quantity, WheelConfig, WheelsConfig};
use super::super::counter::Counter;
use super::super::kinematics::Kinematics;
use super::super::words::{Length, Rounded};
use super::period::Period;
use super::planner::{Planner, Role};
use super::reach::Reach;
use super::scale::{self, positive};
use super::source::{Found, Source};
use super::{counts, meaning, reach, unlikely};

/// Both wheels of an axle.
pub(super) fn plan<'a>(
    planner: &mut Planner<'a>,
    wheels: &'a WheelsConfig,
) -> Result<Kinematics, ConfigError> {
    let track_m = positive("wheels.track_m", wheels.track_m)?;
    let turning_scale = positive("wheels.turning_scale", wheels.turning_scale)?;
    let wheels = [
        ("wheels.left", &wheels.left),
        ("wheels.right", &wheels.right),
    ];
    plan_wheels(planner, &wheels)?;
    planner.description.geometry = format!(
        "two wheels of an axle, {} apart{}",
        Length(track_m),
        skidding(track_m, turning_scale)
    );
    Ok(Kinematics::Axle {
        track_m,
        turning_scale,
    })
}

/// What a scale of turning makes of the track, in words.
pub(super) fn skidding(track_m: f64, turning_scale: f64) -> String {
    if (turning_scale - 1.0).abs() < f64::EPSILON {
        return String::new();
    }
    format!(
        ", which turn {} of what they say, as if they were {} apart",
        Rounded(turning_scale),
        Length(track_m / turning_scale)
    )
}

/// Wheels that are made alike, with their settings.
pub(super) fn plan_wheels<'a>(
    planner: &mut Planner<'a>,
    wheels: &[(&'a str, &'a WheelConfig)],
) -> Result<(), ConfigError> {
    let mut first: Option<(unlikely::Named<'_>, f64)> = None;
    for &(setting, wheel) in wheels {
        let step = plan_wheel(planner, setting, wheel)?;
        match first {
            None => first = Some(((setting, wheel), step)),
            Some((first, of_first)) => {
                let different = unlikely::of_steps(first, (setting, wheel), step / of_first);
                planner.description.warn(different);
            }
        }
    }
    reach::check(planner.config, &planner.counters)
}

/// What one step of its signal is worth \[m, or m/s\].
pub(super) fn plan_wheel<'a>(
    planner: &mut Planner<'a>,
    setting: &'a str,
    wheel: &'a WheelConfig,
) -> Result<f64, ConfigError> {
    let scale = scale::of_wheel(setting, wheel)?;
    let source = Source {
        setting,
        bus: wheel.bus,
        message: &wheel.message,
        signal: &wheel.signal,
    };
    let found = planner.find(&source)?;
    found.agree(&source, "quantity", wheel.quantity)?;
    planner
        .description
        .warn(found.unknown_unit(&source, "quantity", wheel.quantity));
    let counts = matches!(
        wheel.quantity,
        Quantity::CumulativeTicks | Quantity::TicksPerPeriod
    );
    let unit = counts.then(|| unlikely::of_unit(setting, wheel, &found.unit));
    planner.description.warn(unit.flatten());
    let contradiction = Period::contradiction(setting, wheel.period_s, found.message);
    planner.description.warn(contradiction);
    let role = match wheel.quantity {
        Quantity::CumulativeTicks => counter(planner, &source, wheel, &found, scale)?,
        _ if wheel.modulus.is_some() => {
            let problem = "is for cumulative_ticks only";
            return Err(ConfigError::setting(format!("{setting}.modulus"), problem));
        }
        _ => Role {
            meaning: meaning::of_speed(wheel, scale),
            ..planner.rate(
                &source,
                &found,
                scale,
                planner.config.max_speed_mps,
                wheel.period_s,
            )?
        },
    };
    planner.add(&source, &found, role)?;
    Ok(scale * found.decoder.factor())
}

fn counter(
    planner: &mut Planner,
    source: &Source,
    wheel: &WheelConfig,
    found: &Found,
    scale: f64,
) -> Result<Role, ConfigError> {
    let (setting, limit) = (source.setting, planner.config.max_speed_mps);
    let counts = counts::counts(setting, wheel, &found.decoder)?;
    let metres_per_count = scale * found.decoder.factor();
    let period = Period::of(wheel.period_s, found.message);
    planner.counters.push(Reach {
        setting: setting.to_owned(),
        counts,
        metres_per_count,
        period,
    });
    planner.description.warn(unlikely::of_counter(
        setting,
        metres_per_count,
        limit,
        period.s,
    ));
    Ok(Role {
        measure: Measure::Counter(Counter::new(
            counts,
            metres_per_count,
            limit,
            &planner.config.tolerance,
        )),
        meaning: meaning::of_counter(wheel, counts, metres_per_count),
        period,
    })
}
