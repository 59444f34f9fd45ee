//! Numbers as a person reads them.

use std::fmt;

/// A number with six digits, without zeros that say nothing: `0.287`, `1.82857`, `4.29497e9`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Rounded(pub f64);

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = format!("{:.5e}", self.0).parse().unwrap_or(self.0);
        let is_plain = rounded == 0.0 || (1e-4..1e7).contains(&f64::abs(rounded));
        if is_plain {
            write!(f, "{rounded}")
        } else {
            write!(f, "{rounded:e}")
        }
    }
}

/// A length in the unit in which one would say it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Length(pub f64);

impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, unit) = match self.0.abs() {
            metres if metres >= 1e3 => (1e-3, "km"),
            metres if metres >= 0.1 => (1.0, "m"),
            metres if metres >= 1e-4 => (1e3, "mm"),
            _ => (1e6, "µm"),
        };
        write!(f, "{} {unit}", Rounded(self.0 * scale))
    }
}

/// A time in the unit in which one would say it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Time(pub f64);

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.abs() >= 1.0 {
            write!(f, "{} s", Rounded(self.0))
        } else {
            write!(f, "{} ms", Rounded(self.0 * 1e3))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_none_is_lost() {
        let said = [0.0, 0.287, 1.0 / 3.0, 4_294_967_295.0, 1e-9, -2.5, 2.0]
            .map(|number| Rounded(number).to_string());
        assert_eq!(
            said,
            ["0", "0.287", "0.333333", "4.29497e9", "1e-9", "-2.5", "2"]
        );
    }

    #[test]
    fn units_fit_their_number() {
        let said =
            [0.287, 1e-4, 1e-6, 0.065_19, 429_496.0].map(|metres| Length(metres).to_string());
        assert_eq!(
            said,
            ["0.287 m", "0.1 mm", "1 µm", "65.19 mm", "429.496 km"]
        );
        assert_eq!(
            [0.02, 60.0, 0.0025].map(|s| Time(s).to_string()),
            ["20 ms", "60 s", "2.5 ms"]
        );
    }
}
