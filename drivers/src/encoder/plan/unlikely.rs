//! What is possible and unlikely: a slip of the pen, a wrong unit, a place that was copied.

use crate::can::{Id, raw_id};
use crate::signal::SignalDecoder;

use super::super::config::{OdometryConfig, Quantity, WheelConfig};
use super::super::description::Expected;
use super::super::unit::Unit;
use super::super::words::{Length, Rounded};
use super::scale::metres_per_tick;

mod geometry;

/// Robots that drive on wheels \[m\].
const TRACKS_M: std::ops::RangeInclusive<f64> = 0.02..=4.0;
const RADII_M: std::ops::RangeInclusive<f64> = 0.005..=1.2;

/// Faster than that robots do not drive \[m/s, rad/s\].
const FAST_MPS: f64 = 100.0;
const FAST_RADPS: f64 = 50.0;

/// Fewer steps a frame at the highest speed are no measurement.
const FEWEST_STEPS: f64 = 3.0;

/// More counts a second no encoder makes.
const MOST_COUNTS_HZ: f64 = 1e9;

/// Of the robot as a whole.
pub(super) fn of_robot(config: &OdometryConfig) -> Vec<String> {
    let speed = config.max_speed_mps;
    let fast = (speed > FAST_MPS).then(|| {
        format!(
            "max_speed_mps: {speed} m/s are {} km/h: is that the unit?",
            Rounded(3.6 * speed)
        )
    });
    let turn = config.max_turn_rate_radps;
    let says_turns = config.body.is_some() || config.base.is_some();
    let spin = (says_turns && turn > FAST_RADPS).then(|| {
        format!(
            "max_turn_rate_radps: {turn} rad/s are {} turns a second: are these degrees?",
            Rounded(turn / std::f64::consts::TAU)
        )
    });
    let track_m = config.base.as_ref().and_then(|base| base.track_m);
    let base = track_m.and_then(|track_m| of_track("base.track_m", track_m));
    let robot = fast.into_iter().chain(spin);
    robot.chain(geometry::of(config)).chain(base).collect()
}

fn of_track(setting: &str, track_m: f64) -> Option<String> {
    let apart = Length(track_m);
    (!TRACKS_M.contains(&track_m))
        .then(|| format!("{setting}: the wheels are {apart} apart: is that the unit?"))
}

/// A wheel and the setting that it is.
pub(super) type Named<'a> = (&'a str, &'a WheelConfig);

/// Each by itself, and against the first.
fn of_wheels(wheels: &[Named<'_>]) -> Vec<String> {
    let each = wheels
        .iter()
        .flat_map(|(setting, wheel)| of_wheel(setting, wheel));
    let others = wheels.split_first();
    let pairs = others.into_iter().flat_map(|(first, others)| {
        let pair = |other: &Named<'_>| of_pair(*first, *other);
        others.iter().flat_map(pair)
    });
    each.chain(pairs).collect()
}

fn of_wheel(setting: &str, wheel: &WheelConfig) -> Vec<String> {
    let radius = wheel.wheel_radius_m.filter(|m| !RADII_M.contains(m));
    let odd = radius.map(|radius_m| {
        format!(
            "{setting}.wheel_radius_m: is {}: is that the unit?",
            Length(radius_m)
        )
    });
    let idle = idle_settings(wheel)
        .into_iter()
        .map(|name| format!("{setting}.{name}: says nothing about this quantity, and is not used"));
    odd.into_iter().chain(idle).collect()
}

/// What is written and not used.
fn idle_settings(wheel: &WheelConfig) -> Vec<&'static str> {
    let (ticks, radius) = match wheel.quantity {
        Quantity::CumulativeTicks | Quantity::TicksPerPeriod => (true, true),
        Quantity::RadiansPerSecond | Quantity::RevolutionsPerMinute => (false, true),
        Quantity::MetresPerSecond | Quantity::KilometresPerHour => (false, false),
    };
    [
        ("metres_per_tick", wheel.metres_per_tick, ticks),
        ("ticks_per_revolution", wheel.ticks_per_revolution, ticks),
        ("wheel_radius_m", wheel.wheel_radius_m, radius),
    ]
    .into_iter()
    .filter(|(_, value, used)| value.is_some() && !used)
    .map(|(name, ..)| name)
    .collect()
}

/// `left` of `wheels.left`, `front left` of `mecanum.front_left`, `1` of `omni.wheels.1.wheel`.
fn name(setting: &str) -> String {
    let setting = setting.trim_end_matches(".wheel");
    let last = setting.rsplit('.').next().unwrap_or(setting);
    last.replace('_', " ")
}

/// Wheels of one robot are made alike.
fn of_pair((first, one): Named<'_>, (setting, other): Named<'_>) -> Vec<String> {
    let pairs = [
        (
            "metres_per_tick",
            one.metres_per_tick,
            other.metres_per_tick,
        ),
        ("wheel_radius_m", one.wheel_radius_m, other.wheel_radius_m),
        (
            "ticks_per_revolution",
            one.ticks_per_revolution,
            other.ticks_per_revolution,
        ),
    ];
    let differ = |&(_, one, other): &(_, Option<f64>, Option<f64>)| {
        one.zip(other)
            .is_some_and(|(one, other)| !(0.9..=1.1).contains(&(one / other)))
    };
    pairs
        .into_iter()
        .filter(differ)
        .map(|(key, one, other)| {
            let [one, other] = [one, other].map(|value| Rounded(value.unwrap_or_default()));
            let first = name(first);
            format!("{setting}.{key}: is {other}, and that of the {first} wheel {one}: are the wheels so different?")
        })
        .collect()
}

/// One step of a wheel's signal is `ratio` of the first's: where nothing that is configured differs, the DBC file may make it.
pub(super) fn of_steps(first: Named<'_>, other: Named<'_>, ratio: f64) -> Option<String> {
    if !of_pair(first, other).is_empty() || (0.9..=1.1).contains(&ratio.abs()) {
        return None;
    }
    let (setting, _) = other;
    Some(format!(
        "{setting}: one step of its signal is {} times as long as one of the {} wheel's: are the wheels so different?",
        Rounded(ratio.abs()),
        name(first.0)
    ))
}

/// Of counts for which the DBC file gives a unit of length or angle: what one is worth is known then.
pub(super) fn of_unit(setting: &str, wheel: &WheelConfig, unit: &str) -> Option<String> {
    let differ = |it: f64, said: f64| !(0.9..=1.1).contains(&(it / said));
    match Unit::of(unit)? {
        Unit::Length { metres } => {
            let scale = metres_per_tick(setting, wheel).ok()?;
            differ(scale, metres).then(|| {
                format!(
                    "{setting}: one tick is {}, and the DBC file gives the signal in {unit}: is it {}?",
                    Length(scale),
                    Length(metres)
                )
            })
        }
        Unit::Angle { per_turn } => {
            let (turn, ticks) = (per_turn?, wheel.ticks_per_revolution?);
            differ(ticks, turn).then(|| {
                format!(
                    "{setting}.ticks_per_revolution: is {}, and the DBC file gives the signal in {unit}, of which a turn has {}: is there a gear between?",
                    Rounded(ticks),
                    Rounded(turn)
                )
            })
        }
        _ => None,
    }
}

/// Of a tick counter, one count of which is so long, in frames that come so often.
pub(super) fn of_counter(
    setting: &str,
    metres_per_count: f64,
    max_speed_mps: f64,
    period_s: f64,
) -> Option<String> {
    let counts_hz = max_speed_mps / metres_per_count.abs();
    let length = Length(metres_per_count.abs());
    if counts_hz * period_s < FEWEST_STEPS {
        return Some(format!(
            "{setting}: one count is {length}, which makes {} counts a frame at {max_speed_mps} m/s: is that the unit?",
            Rounded(counts_hz * period_s)
        ));
    }
    (counts_hz > MOST_COUNTS_HZ).then(|| {
        format!(
            "{setting}: one count is {length}, which makes {} counts a second at {max_speed_mps} m/s: is that the unit?",
            Rounded(counts_hz)
        )
    })
}

/// Of a velocity, one unit of which is worth `scale`. A range that leaves out what the robot can do makes odometry stop
/// just then.
pub(super) fn of_rate(
    setting: &str,
    signal: &SignalDecoder,
    scale: f64,
    limit: f64,
) -> Vec<String> {
    let step = signal.is_integer().then(|| (signal.factor() * scale).abs());
    let coarse = step.filter(|&step| step > limit / FEWEST_STEPS).map(|step| {
        format!(
            "{setting}: one step of the signal is {} m/s or rad/s, and the limit {limit}: is that the unit?",
            Rounded(step)
        )
    });
    let range = signal.range().map(|range| range.map(|end| end * scale));
    let outside = range.map(|range| of_range(setting, range, limit));
    let no_sign =
        range.is_none() && signal.is_integer() && !signal.is_signed() && signal.offset() == 0.0;
    let unsaid = no_sign.then(|| {
        format!("{setting}: the signal has no sign, so it cannot say that the robot moves the other way: should it be @1- or @0-?")
    });
    coarse
        .into_iter()
        .chain(outside.unwrap_or_default())
        .chain(unsaid)
        .collect()
}

fn of_range(setting: &str, [a, b]: [f64; 2], limit: f64) -> Vec<String> {
    let (lowest, highest) = (a.min(b), a.max(b));
    let one_way = (lowest >= 0.0 || highest <= 0.0).then(|| {
        format!(
            "{setting}: its range in the DBC file leaves one direction out ({lowest:.3} to {highest:.3} m/s or rad/s): \
             no odometry while the robot moves that way"
        )
    });
    let end = highest.max(-lowest);
    let short = (end < limit).then(|| {
        format!("{setting}: its range in the DBC file ends at {end:.3}, below the limit of {limit}")
    });
    one_way.into_iter().chain(short).collect()
}

/// Of identifiers, one by one and against one another.
pub(super) fn of_identifiers(expected: &[Expected], buses: usize) -> Vec<String> {
    let each = expected.iter().filter_map(of_identifier);
    let twice = expected.iter().enumerate().filter_map(|(index, it)| {
        let before = expected.get(..index)?;
        let other = before
            .iter()
            .find(|other| other.id == it.id && other.bus != it.bus)?;
        Some(format!(
            "message {}: its identifier is wanted from bus {} and from bus {}: are these two encoders, or one that is heard twice?",
            it.message, other.bus, it.bus
        ))
    });
    let idle = (0..buses)
        .filter(|&bus| expected.iter().all(|it| usize::from(it.bus) != bus))
        .map(|bus| format!("buses.{bus}: no signal is wanted from it"));
    each.chain(twice).chain(idle).collect()
}

/// J1939 has the sender's address in the last byte, and many DBC files what stands for none.
fn of_identifier(it: &Expected) -> Option<String> {
    let (id, name) = (raw_id(it.id), &it.message);
    let nobodys = matches!(it.id, Id::Extended(id) if id.as_raw() & 0xFF == 0xFE);
    if nobodys {
        return Some(format!(
            "message {name}: its identifier ends in FE, in J1939 the address of nobody; frames are taken whose identifier is \
             equal in every bit: put the sender's address in its place"
        ));
    }
    let zero = matches!(it.id, Id::Standard(_)) && id == 0;
    zero.then(|| {
        format!("message {name}: its identifier is 0, on most buses a command to everybody: is it this one?")
    })
}
