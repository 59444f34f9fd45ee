//! A steered car.

use crate::config_error::ConfigError;

use super::super::bicycle::Bicycle;
use super::super::channel::{Beginning, Measure};
use super::super::config::{AngleUnit, BicycleConfig, SteeringConfig};
use super::super::kinematics::Kinematics;
use super::super::unit::Meaning;
use super::super::words::{Length, Rounded};
use super::period::Period;
use super::planner::{Planner, Role};
use super::scale::positive;
use super::source::Source;
use super::{axle, reach};

pub(super) fn plan<'a>(
    planner: &mut Planner<'a>,
    config: &'a BicycleConfig,
) -> Result<Kinematics, ConfigError> {
    let base_m = positive("bicycle.wheel_base_m", config.wheel_base_m)?;
    let max_rad = positive("bicycle.steering.max_rad", config.steering.max_rad)?;
    axle::plan_wheel(planner, "bicycle.wheel", &config.wheel)?;
    reach::check(planner.config, &planner.counters)?;
    steering(planner, &config.steering)?;
    let bicycle = Bicycle::new(base_m, config.lateral_m, max_rad, config.steering.sigma_rad);
    planner.description.geometry = in_words(config);
    bicycle.map(Kinematics::Bicycle).ok_or_else(|| {
        let problem = format!(
            "is {}: steered by {} rad the robot would turn about a point beside that wheel, whose speed says nothing then; lower \
             steering.max_rad, or measure nearer to the middle",
            Length(config.lateral_m),
            Rounded(max_rad)
        );
        ConfigError::setting("bicycle.lateral_m", problem)
    })
}

fn steering<'a>(
    planner: &mut Planner<'a>,
    steering: &'a SteeringConfig,
) -> Result<(), ConfigError> {
    let ratio = positive("bicycle.steering.ratio", steering.ratio)?;
    let source = Source {
        setting: "bicycle.steering",
        bus: steering.bus,
        message: &steering.message,
        signal: &steering.signal,
    };
    let found = planner.find(&source)?;
    found.agree(&source, "unit", steering.unit)?;
    planner
        .description
        .warn(found.unknown_unit(&source, "unit", steering.unit));
    let unit = match steering.unit {
        AngleUnit::Radians => 1.0,
        AngleUnit::Degrees => 1.0_f64.to_radians(),
    };
    let scale = if steering.reversed { -unit } else { unit } / ratio;
    let longest_s = planner.config.tolerance.longest_rate_s;
    let period = Period::of(None, found.message);
    reach::check_rate(source.setting, period, longest_s)?;
    let role = Role {
        measure: Measure::Angle {
            zero: steering.straight,
            scale,
            limit: steering.max_rad,
            longest_s,
            before: Beginning::default(),
        },
        meaning: meaning(steering, scale),
        period,
    };
    planner.add(&source, &found, role)
}

fn meaning(steering: &SteeringConfig, scale: f64) -> String {
    format!(
        "{}: {} is straight on, and one more turns the road wheels by {} rad to the {}; {} rad at most, σ of a frame {} rad",
        steering.unit.word(),
        Rounded(steering.straight),
        Rounded(scale.abs()),
        if steering.reversed { "right" } else { "left" },
        Rounded(steering.max_rad),
        Rounded(steering.sigma_rad)
    )
}

fn in_words(config: &BicycleConfig) -> String {
    let lateral_m = config.lateral_m;
    let place = match lateral_m {
        0.0 => "in the middle of the rear axle".into(),
        _ if lateral_m > 0.0 => {
            format!("{} left of the middle of the rear axle", Length(lateral_m))
        }
        _ => format!(
            "{} right of the middle of the rear axle",
            Length(-lateral_m)
        ),
    };
    format!(
        "a steered car, {} from axle to axle, its speed measured {place}",
        Length(config.wheel_base_m)
    )
}
