//! The time of a fix: UTC as receivers say it, and as computers count it.

use chrono::{Datelike, NaiveDate, Timelike};

const SECOND_NS: i64 = 1_000_000_000;
const DAY_NS: i64 = 86_400 * SECOND_NS;

/// Time since midnight UTC (ns). In a leap second it is beyond the end of the day.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TimeOfDay(i64);

impl TimeOfDay {
    /// From its parts. A second 60 is the last of the day.
    #[must_use]
    pub fn new(hour: u32, minute: u32, second: u32, ns: u32) -> Option<Self> {
        let is_leap = second == 60 && (hour, minute) == (23, 59);
        let is_right = hour < 24 && minute < 60 && (second < 60 || is_leap);
        let whole = i64::from(hour) * 3600 + i64::from(minute) * 60 + i64::from(second);
        (is_right && ns < 1_000_000_000).then_some(Self(whole * SECOND_NS + i64::from(ns)))
    }

    /// `hhmmss` and any number of decimals, as NMEA writes it.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let (whole, decimals) = text.split_once('.').unwrap_or((text, ""));
        let is_plain = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        if whole.len() != 6 || !is_plain(whole) || !is_plain(decimals) {
            return None;
        }
        let two = |at: usize| whole[at..at + 2].parse().ok();
        let digits = decimals.bytes().map(|byte| u32::from(byte - b'0'));
        let digits = digits.chain(std::iter::repeat(0)).take(9);
        let ns = digits.fold(0, |ns, digit| 10 * ns + digit);
        Self::new(two(0)?, two(2)?, two(4)?, ns)
    }

    /// Nanoseconds since midnight.
    #[must_use]
    pub fn ns(self) -> i64 {
        self.0
    }
}

/// A day and a time in it, as nanoseconds since 1970 of a computer's clock, which has no leap seconds: like the kernel, it lives the
/// second before again. Nothing for a date that no such number can say.
#[must_use]
pub fn unix_ns(date: NaiveDate, time: TimeOfDay) -> Option<i64> {
    let leap_ns = if time.0 >= DAY_NS { SECOND_NS } else { 0 };
    let days = date.signed_duration_since(NaiveDate::default()).num_days();
    days.checked_mul(DAY_NS)?.checked_add(time.0 - leap_ns)
}

/// The date of `time`, which follows soon after (or before) a `known` date and time: midnight may lie between.
#[must_use]
pub fn date_near(known: (NaiveDate, TimeOfDay), time: TimeOfDay) -> Option<NaiveDate> {
    let (date, before) = known;
    match time.0 - before.0 {
        ahead if ahead < -DAY_NS / 2 => date.succ_opt(),
        ahead if ahead > DAY_NS / 2 => date.pred_opt(),
        _ => Some(date),
    }
}

/// `2018-08-20T09:47:36.000Z`.
#[must_use]
pub fn iso(unix_ns: i64) -> String {
    let time = chrono::DateTime::from_timestamp_nanos(unix_ns);
    let ms = time.timestamp_subsec_millis();
    let whole = time.naive_utc();
    let (date, time) = (whole.date(), whole.time());
    format!(
        "{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{ms:03}Z",
        date.year(),
        date.month(),
        date.day(),
        time.hour(),
        time.minute(),
        time.second(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn day(year: i32, month: u32, day: u32) -> NaiveDate {
        NaiveDate::from_ymd_opt(year, month, day).unwrap()
    }

    fn time(text: &str) -> TimeOfDay {
        TimeOfDay::parse(text).unwrap()
    }

    #[test]
    fn a_time_is_read_to_the_nanosecond() {
        for (text, ns) in [
            ("000000", 0),
            ("000000.", 0),
            ("010203.5", 3_723_500_000_000),
            ("235959.9999999999", 86_399_999_999_999),
            ("235960.25", 86_400_250_000_000),
        ] {
            assert_eq!(time(text).ns(), ns, "{text}");
        }
        for text in [
            "", "12", "240000", "006000", "000060", "225960", "235961", "-10000", "+1+1+1",
            "000000.x", "00000٣",
        ] {
            assert_eq!(TimeOfDay::parse(text), None, "{text}");
        }
    }

    #[test]
    fn midnight_lies_between_two_times_that_are_far_apart() {
        let (late, early) = (time("235959.9"), time("000000.1"));
        let date = day(2023, 12, 31);
        assert_eq!(date_near((date, late), early), Some(day(2024, 1, 1)));
        assert_eq!(date_near((day(2024, 1, 1), early), late), Some(date));
        assert_eq!(date_near((date, early), time("110000")), Some(date));
    }

    #[test]
    fn a_leap_second_lives_the_one_before_again() {
        let date = day(2016, 12, 31);
        let unix = |date, text| unix_ns(date, time(text)).unwrap();
        assert_eq!(unix(date, "235959.5"), unix(date, "235960.5"));
        assert_eq!(
            unix(date, "235960.5") + SECOND_NS,
            unix(day(2017, 1, 1), "000000.5")
        );
        assert_eq!(unix(day(2016, 12, 31), "000000"), 1_483_142_400 * SECOND_NS);
        assert_eq!(iso(unix(date, "235960.5")), "2016-12-31T23:59:59.500Z");
    }
}
