//! The unit that a DBC file gives to a signal, against what the configuration takes it for.

use std::f64::consts::TAU;

use super::config::{AngleUnit, Quantity, SpeedUnit, TurnUnit};

/// What a unit says, as far as it can contradict.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Unit {
    /// Of length, which a counter may have.
    Length {
        /// One of it.
        metres: f64,
    },
    /// Of angle, which a counter may have too.
    Angle {
        /// How many of it make a turn, if the word means one unit alone.
        per_turn: Option<f64>,
    },
    /// Of nothing but a number of steps.
    Count,
    MetresPerSecond,
    KilometresPerHour,
    RadiansPerSecond,
    DegreesPerSecond,
    RevolutionsPerMinute,
    /// Of speed, but none that can be configured.
    OtherSpeed,
    /// Of something that is no motion: a time, an acceleration, a temperature.
    Other,
}

impl Unit {
    /// Reads the many spellings; `None` for what says nothing.
    pub(super) fn of(text: &str) -> Option<Self> {
        let length = |metres| Self::Length { metres };
        let angle = |per_turn| Self::Angle { per_turn };
        Some(match spelled(text).as_str() {
            "m" | "meter" | "metre" | "meters" | "metres" => length(1.0),
            "dm" => length(0.1),
            "cm" => length(0.01),
            "mm" => length(0.001),
            "km" => length(1000.0),
            "in" | "inch" => length(0.0254),
            "ft" => length(0.3048),
            "mi" => length(1609.344),
            "m/s" | "mps" | "m/sec" | "ms-1" | "m*s-1" | "m.s-1" | "m·s-1" | "m·s⁻¹" | "ms⁻¹" => {
                Self::MetresPerSecond
            }
            "km/h" | "kmh" | "kph" | "kmph" | "km/hr" | "kmh-1" => Self::KilometresPerHour,
            "rad/s" | "rad/sec" | "radps" | "rads" | "rads-1" => Self::RadiansPerSecond,
            "deg/s" | "°/s" | "deg/sec" | "°/sec" | "degps" | "dps" | "degs" | "degree/s"
            | "degrees/s" | "grad/s" | "º/s" | "degs-1" | "°s-1" | "degreespersecond" => {
                Self::DegreesPerSecond
            }
            "rpm" | "1/min" | "/min" | "u/min" | "r/min" | "rev/min" | "revs/min" | "min-1"
            | "upm" | "r.p.m." | "tr/min" | "tours/min" => Self::RevolutionsPerMinute,
            "deg" | "°" | "degree" | "degrees" => angle(Some(360.0)),
            "rad" => angle(Some(TAU)),
            "mrad" => angle(Some(1000.0 * TAU)),
            // Degrees in German, gradians in other languages.
            "grad" => angle(None),
            "tick" | "ticks" | "count" | "counts" | "cnt" | "cnts" | "pulse" | "pulses" | "imp"
            | "impulse" | "impulses" | "inc" | "incs" | "increments" | "steps" => Self::Count,
            "s" | "ms" | "us" | "µs" | "min" | "m/s2" | "m/s^2" | "m/s²" | "m/s/s" | "rad/s2"
            | "rad/s^2" | "rad/s²" | "deg/s2" | "deg/s^2" | "deg/s²" | "°/s2" | "°/s²" | "hz"
            | "pulses/s" | "ticks/s" | "counts/s" | "mv" | "ma" | "kw" | "nm" | "°c" | "degc"
            | "kpa" | "bar" | "mbar" | "psi" | "kg" => Self::Other,
            "mph" | "mi/h" | "mm/s" | "cm/s" | "km/s" | "ft/s" | "m/min" | "knots" | "kn"
            | "rps" | "rev/s" | "miles/h" | "m/h" | "dm/s" | "in/s" | "mm/sec" | "cm/sec"
            | "mrad/s" | "deg/h" | "deg/min" | "°/min" | "°/h" => Self::OtherSpeed,
            _ => return None,
        })
    }

    /// Whether a signal of this unit can be a wheel's `quantity`.
    pub(super) fn suits(self, quantity: Quantity) -> bool {
        match quantity {
            Quantity::CumulativeTicks | Quantity::TicksPerPeriod => {
                matches!(self, Self::Length { .. } | Self::Angle { .. } | Self::Count)
            }
            Quantity::MetresPerSecond => self == Self::MetresPerSecond,
            Quantity::KilometresPerHour => self == Self::KilometresPerHour,
            Quantity::RadiansPerSecond => self == Self::RadiansPerSecond,
            Quantity::RevolutionsPerMinute => self == Self::RevolutionsPerMinute,
        }
    }
}

fn spelled(text: &str) -> String {
    let lower = text.to_lowercase();
    let spelled: String = lower.split_whitespace().collect();
    spelled.trim_matches(['[', ']', '(', ')']).to_owned()
}

/// A word of the configuration that says what a signal is.
pub(super) trait Meaning: Copy {
    /// As it is written there.
    fn word(self) -> &'static str;
    /// Whether a signal of that unit can be this.
    fn allows(self, unit: Unit) -> bool;
}

impl Meaning for Quantity {
    fn word(self) -> &'static str {
        match self {
            Self::CumulativeTicks => "cumulative_ticks",
            Self::TicksPerPeriod => "ticks_per_period",
            Self::MetresPerSecond => "metres_per_second",
            Self::KilometresPerHour => "kilometres_per_hour",
            Self::RadiansPerSecond => "radians_per_second",
            Self::RevolutionsPerMinute => "revolutions_per_minute",
        }
    }

    fn allows(self, unit: Unit) -> bool {
        unit.suits(self)
    }
}

impl Meaning for SpeedUnit {
    fn word(self) -> &'static str {
        match self {
            Self::MetresPerSecond => "metres_per_second",
            Self::KilometresPerHour => "kilometres_per_hour",
        }
    }

    fn allows(self, unit: Unit) -> bool {
        match self {
            Self::MetresPerSecond => unit == Unit::MetresPerSecond,
            Self::KilometresPerHour => unit == Unit::KilometresPerHour,
        }
    }
}

impl Meaning for TurnUnit {
    fn word(self) -> &'static str {
        match self {
            Self::RadiansPerSecond => "radians_per_second",
            Self::DegreesPerSecond => "degrees_per_second",
        }
    }

    fn allows(self, unit: Unit) -> bool {
        match self {
            Self::RadiansPerSecond => unit == Unit::RadiansPerSecond,
            Self::DegreesPerSecond => unit == Unit::DegreesPerSecond,
        }
    }
}

impl Meaning for AngleUnit {
    fn word(self) -> &'static str {
        match self {
            Self::Radians => "radians",
            Self::Degrees => "degrees",
        }
    }

    fn allows(self, unit: Unit) -> bool {
        match (self, unit) {
            // Where the word may mean several units it contradicts none.
            (_, Unit::Angle { per_turn: None }) => true,
            (Self::Radians, Unit::Angle { per_turn }) => per_turn == Some(TAU),
            (Self::Degrees, Unit::Angle { per_turn }) => per_turn == Some(360.0),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_counted_is_no_speed_and_the_other_way_round() {
        for (unit, counts, speeds) in [
            ("ticks", true, false),
            ("deg", true, false),
            ("mm", true, false),
            ("m/s", false, true),
            ("m/s2", false, false),
            ("°C", false, false),
        ] {
            let unit = Unit::of(unit).unwrap();
            assert_eq!(unit.suits(Quantity::CumulativeTicks), counts, "{unit:?}");
            assert_eq!(unit.suits(Quantity::MetresPerSecond), speeds, "{unit:?}");
        }
    }

    #[test]
    fn what_one_of_it_is_worth_is_known_where_the_word_is_certain() {
        let inch = Unit::Length { metres: 0.0254 };
        assert_eq!(["in", "Inch"].map(Unit::of), [Some(inch); 2]);
        let angle = |per_turn| Some(Unit::Angle { per_turn });
        assert_eq!(Unit::of("degrees"), angle(Some(360.0)));
        assert_eq!(Unit::of("mrad"), angle(Some(1000.0 * TAU)));
        assert_eq!(Unit::of("Grad"), angle(None));
    }

    #[test]
    fn every_spelling_is_one_unit() {
        assert_eq!(Unit::of(" Km / h "), Some(Unit::KilometresPerHour));
        assert_eq!(Unit::of("[RPM]"), Some(Unit::RevolutionsPerMinute));
        assert_eq!(Unit::of("°/s"), Some(Unit::DegreesPerSecond));
        assert_eq!(Unit::of("mm/s"), Some(Unit::OtherSpeed));
        assert_eq!(Unit::of("Imp"), Some(Unit::Count));
        assert_eq!(Unit::of("m/s^2"), Some(Unit::Other));
        // Not "rads", which is a speed.
        for nothing in ["", "1", "-", "%", "wheels", "rad(s)", "deg(s)"] {
            assert_eq!(Unit::of(nothing), None, "{nothing}");
        }
    }
}
