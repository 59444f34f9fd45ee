//! What a wheel's signal is worth, in words.

use std::f64::consts::TAU;

use super::super::config::{Quantity, WheelConfig};
use super::super::count::Counts;
use super::super::unit::Meaning;
use super::super::words::{Length, Rounded};

/// Of a tick counter, every count of which is worth `metres_per_count`.
pub(super) fn of_counter(wheel: &WheelConfig, counts: Counts, metres_per_count: f64) -> String {
    let way_m = metres_per_count.abs();
    format!(
        "cumulative_ticks: one count is {}{}{}; it wraps after {} counts, {}",
        Length(way_m),
        turn(wheel),
        direction(wheel.reversed),
        counts.number(),
        Length(counts.number() * way_m)
    )
}

/// Of a speed; `scale` is what one unit of the signal is worth \[m/s\].
pub(super) fn of_speed(wheel: &WheelConfig, scale: f64) -> String {
    format!(
        "{}: 1 is {} m/s{}{}",
        wheel.quantity.word(),
        Rounded(scale.abs()),
        turn(wheel),
        direction(wheel.reversed)
    )
}

/// Of a velocity of the body, in `unit`.
pub(super) fn of_body(word: &str, scale: f64, unit: &str, reversed: bool) -> String {
    format!(
        "{word}: 1 is {} {unit}{}",
        Rounded(scale.abs()),
        direction(reversed)
    )
}

/// What a turn of the wheel makes, where that can be known.
fn turn(wheel: &WheelConfig) -> String {
    let ticks = wheel.ticks_per_revolution;
    let used = !matches!(
        wheel.quantity,
        Quantity::MetresPerSecond | Quantity::KilometresPerHour
    );
    match wheel.wheel_radius_m.filter(|_| used) {
        Some(radius_m) => {
            let ticks = ticks.map(|ticks| format!("{} ticks, ", Rounded(ticks)));
            format!(
                ", a turn of the wheel {}{} (radius {})",
                ticks.unwrap_or_default(),
                Length(TAU * radius_m),
                Length(radius_m)
            )
        }
        None => String::new(),
    }
}

fn direction(reversed: bool) -> &'static str {
    if reversed {
        ", counted backwards when the robot drives forwards"
    } else {
        ""
    }
}
