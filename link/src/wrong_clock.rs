//! A clock that is wrong on purpose: what a link shows others of its own, so that what they make of it can be tried on one computer.
use std::str::FromStr;

use coloc_sensors::Moment as Present;

/// A robot's clock that is right until a moment, and then shows T + offset + drift (T − moment) where it is T.
///
/// It is put where the link turns stamps of shared memory into those of the network and back: the robot itself lives by the right clock,
/// everybody else sees the wrong one.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct WrongClock {
    offset_ns: i64,
    /// Seconds a second.
    drift: f64,
    from_ns: i64,
}

impl WrongClock {
    /// What it shows at `right_ns` of the right clock (ns).
    #[must_use]
    pub fn shows(&self, right_ns: i64) -> i64 {
        let since_ns = right_ns.saturating_sub(self.from_ns);
        if since_ns < 0 {
            return right_ns;
        }
        let gained_ns = scaled(since_ns, self.drift);
        right_ns
            .saturating_add(self.offset_ns)
            .saturating_add(gained_ns)
    }

    /// By the right clock when it shows `shown_ns` (ns): of a moment that it shows twice the later one.
    #[must_use]
    pub fn right(&self, shown_ns: i64) -> i64 {
        let since_ns = shown_ns.saturating_sub(self.from_ns.saturating_add(self.offset_ns));
        if since_ns < 0 {
            return shown_ns.min(self.from_ns);
        }
        let gained_ns = scaled(since_ns, self.drift / (1.0 + self.drift));
        let right_ns = self.from_ns.saturating_add(since_ns - gained_ns);
        // Both are rounded: a stamp that comes back is the one that was sent.
        let again_ns = self.shows(right_ns);
        right_ns.saturating_add(shown_ns.saturating_sub(again_ns))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "nanoseconds of some hours, and their rounding"
)]
fn scaled(ns: i64, factor: f64) -> i64 {
    (ns as f64 * factor).round() as i64
}

/// `OFFSET,DRIFT,AFTER`: seconds, parts per million, and so many seconds after now.
impl FromStr for WrongClock {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split(',').map(str::parse::<f64>);
        let numbers: Result<Vec<_>, _> = numbers.collect();
        let Ok([offset_s, drift_ppm, after_s]) = numbers.as_deref() else {
            return Err("must be seconds, parts per million and seconds, as in 1,200,10".into());
        };
        let within = [(offset_s, 1e6), (drift_ppm, 1e5), (after_s, 1e6)];
        if !within
            .iter()
            .all(|(number, most)| number.is_finite() && number.abs() <= *most)
        {
            return Err("no clock is as wrong as that".into());
        }
        let now_ns = Present::now().realtime_ns;
        Ok(Self {
            offset_ns: scaled(1_000_000_000, *offset_s),
            drift: 1e-6 * drift_ppm,
            from_ns: now_ns.saturating_add(scaled(1_000_000_000, *after_s)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FROM_NS: i64 = 1_800_000_000_000_000_000;

    #[test]
    fn it_is_right_until_it_is_not_and_what_it_shows_comes_back_the_same() {
        for (offset_ns, drift) in [(1_000_000_000, 2e-4), (-1_000_000_000, -2e-4), (0, 0.0)] {
            let clock = WrongClock {
                offset_ns,
                drift,
                from_ns: FROM_NS,
            };
            let before_ns = FROM_NS - 2_000_000_000;
            assert_eq!(clock.shows(before_ns), before_ns);
            for step in 0..1000 {
                let right_ns = FROM_NS + step * 123_456_789;
                assert_eq!(clock.right(clock.shows(right_ns)), right_ns);
            }
            let gained_ns = clock.shows(FROM_NS + 1_000_000_000) - FROM_NS - 1_000_000_000;
            let drifted_ns = if offset_ns == 0 {
                0
            } else {
                offset_ns.signum() * 200_000
            };
            assert_eq!(gained_ns, offset_ns + drifted_ns);
        }
    }

    #[test]
    fn what_is_no_clock_is_said() {
        assert!("1,200".parse::<WrongClock>().is_err());
        assert!("1,200,x".parse::<WrongClock>().is_err());
        assert!("1,200,inf".parse::<WrongClock>().is_err());
        assert!("-1,200,0.5".parse::<WrongClock>().is_ok());
    }
}
