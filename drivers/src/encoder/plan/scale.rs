//! From a signal's unit to SI.

use std::f64::consts::TAU;

use crate::config_error::ConfigError;

use super::super::config::{BodySignal, Quantity, SpeedUnit, TurnUnit, WheelConfig};

const MPS_PER_KMH: f64 = 1.0 / 3.6;
const RADPS_PER_RPM: f64 = TAU / 60.0;

/// From the signal's unit to metres, or metres per second.
pub(super) fn of_wheel(setting: &str, wheel: &WheelConfig) -> Result<f64, ConfigError> {
    let radius_m = || required(setting, "wheel_radius_m", wheel.wheel_radius_m);
    let scale = match wheel.quantity {
        Quantity::CumulativeTicks => metres_per_tick(setting, wheel)?,
        Quantity::TicksPerPeriod => {
            metres_per_tick(setting, wheel)? / required(setting, "period_s", wheel.period_s)?
        }
        Quantity::MetresPerSecond => 1.0,
        Quantity::KilometresPerHour => MPS_PER_KMH,
        Quantity::RadiansPerSecond => radius_m()?,
        Quantity::RevolutionsPerMinute => radius_m()? * RADPS_PER_RPM,
    };
    Ok(if wheel.reversed { -scale } else { scale })
}

/// From the signal's unit to metres per second.
pub(super) fn of_speed(signal: &BodySignal<SpeedUnit>) -> f64 {
    let scale = match signal.unit {
        SpeedUnit::MetresPerSecond => 1.0,
        SpeedUnit::KilometresPerHour => MPS_PER_KMH,
    };
    if signal.reversed { -scale } else { scale }
}

/// From the signal's unit to radians per second.
pub(super) fn of_turn(signal: &BodySignal<TurnUnit>) -> f64 {
    let scale = match signal.unit {
        TurnUnit::RadiansPerSecond => 1.0,
        TurnUnit::DegreesPerSecond => 1.0_f64.to_radians(),
    };
    if signal.reversed { -scale } else { scale }
}

/// How far the wheel rolls in a tick \[m\].
pub(super) fn metres_per_tick(setting: &str, wheel: &WheelConfig) -> Result<f64, ConfigError> {
    match (
        wheel.metres_per_tick,
        wheel.wheel_radius_m,
        wheel.ticks_per_revolution,
    ) {
        (Some(metres), None, None) => positive(&format!("{setting}.metres_per_tick"), metres),
        (None, Some(radius_m), Some(ticks)) => {
            let radius_m = positive(&format!("{setting}.wheel_radius_m"), radius_m)?;
            Ok(TAU * radius_m / positive(&format!("{setting}.ticks_per_revolution"), ticks)?)
        }
        _ => Err(ConfigError::setting(
            setting,
            "give metres_per_tick, or wheel_radius_m and ticks_per_revolution",
        )),
    }
}

fn required(setting: &str, name: &str, value: Option<f64>) -> Result<f64, ConfigError> {
    let setting = format!("{setting}.{name}");
    value.map_or_else(
        || {
            Err(ConfigError::setting(
                setting.clone(),
                "is needed for this quantity",
            ))
        },
        |value| positive(&setting, value),
    )
}

/// `value`, if it is a positive number.
pub(in super::super) fn positive(setting: &str, value: f64) -> Result<f64, ConfigError> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(ConfigError::setting(
        setting,
        format!("is {value}; it must be a positive number"),
    ))
}
