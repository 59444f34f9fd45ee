//! Lines of 80 columns for people.

use coloc_shm_types::{Estimate, Input};

use super::reading::{belief, sigmas};
use crate::fitted::fitted;

/// So many lines have a heading over them.
const PAGE: u64 = 40;

const HEADING: &str = concat!(
    " age       x       y      φ    ±x    ±y   ±φ     v     ω belief       odometry\n",
    "  ms       m       m      °     m     m    °   m/s   °/s\n",
);

/// Of the line with this number.
pub(super) fn heading(number: u64) -> &'static str {
    if number.is_multiple_of(PAGE) {
        HEADING
    } else {
        ""
    }
}

#[allow(clippy::cast_precision_loss)] // It is rounded anyhow.
pub(super) fn line(estimate: &Estimate, now_ns: i64) -> String {
    let [x, y, heading] = estimate.pose;
    let [forward, _, turn] = estimate.velocity;
    let [sigma_x, sigma_y, sigma_heading] = sigmas(estimate);
    let age_ms = now_ns.saturating_sub(estimate.boot_ns) as f64 / 1e6;
    let numbers = [
        fitted(age_ms, 4, 0),
        fitted(x, 7, 3),
        fitted(y, 7, 3),
        fitted(heading.to_degrees(), 6, 1),
        fitted(sigma_x, 5, 3),
        fitted(sigma_y, 5, 3),
        fitted(sigma_heading.to_degrees(), 4, 2),
        fitted(forward, 5, 2),
        fitted(turn.to_degrees(), 5, 1),
    ];
    let odometry = estimate.health_of(Input::Odometry);
    format!("{} {:<12} {odometry}", numbers.join(" "), belief(estimate))
}

#[cfg(test)]
mod tests {
    use super::super::reading::example;
    use super::*;

    #[test]
    fn an_estimate_stands_under_its_heading_in_people_s_units() {
        let line = line(&example(), 5_012_000_000);
        let columns: Vec<&str> = line.split_whitespace().collect();
        let expected = [
            "12", "1.500", "-2.250", "28.6", "0.500", "1.000", "2.86", "0.75", "-14.3", "unfit",
            "ok",
        ];
        assert_eq!(columns, expected);
        let ends = |line: &str| -> Vec<usize> {
            let line: Vec<char> = line.chars().collect();
            let is_end =
                |at: &usize| line[*at] != ' ' && line.get(at + 1).is_none_or(|it| *it == ' ');
            (0..line.len()).filter(is_end).take(9).collect()
        };
        for heading in HEADING.lines() {
            assert_eq!(ends(&line), ends(heading), "{heading}\n{line}");
        }
    }

    #[test]
    fn nothing_is_wider_than_80_columns() {
        let widest = Estimate {
            pose: [-1.0e8, -123_456.7, -3.13],
            velocity: [-123.4, 0.0, -9.9],
            independent: [1.0e9; 9],
            state: 2,
            ..Estimate::default()
        };
        let lost = Estimate {
            pose: [f64::NAN; 3],
            independent: [f64::NAN; 9],
            velocity: [f64::NEG_INFINITY; 3],
            ..widest
        };
        for estimate in [widest, lost] {
            let line = line(&estimate, i64::MAX);
            assert_eq!(line.chars().count(), 80, "{line}");
        }
        assert!(HEADING.lines().all(|line| line.chars().count() <= 80));
    }

    #[test]
    fn the_heading_comes_back_now_and_then() {
        let headed = (0..2 * PAGE).filter(|number| !heading(*number).is_empty());
        assert_eq!(headed.collect::<Vec<_>>(), [0, PAGE]);
    }
}
