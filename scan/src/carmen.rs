//! CARMEN logs: `FLASER n r1 … rn x y theta odom_x odom_y odom_theta time host time`.

use crate::view::{MOST_BEAMS, Raw};

/// What a CARMEN line says of a scanner that looks forward: a scan of half a turn.
#[derive(Clone, Debug, PartialEq)]
pub struct FrontLaser {
    ranges: Vec<f32>,
    /// Of the robot, after somebody has corrected it \[m, m, rad\].
    pub pose: [f64; 3],
    /// Of the log's own clock \[s\].
    pub time_s: f64,
}

/// What a line is.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// A scan.
    Scan,
    /// Something else that is known.
    Other,
    /// A scan that cannot be read.
    Broken,
}

/// "Nothing was hit" is the largest value that these logs have, from 50 m on.
const NOTHING_FROM_M: f32 = 40.0;
/// A line is no longer.
const FIELDS_AFTER: usize = 9;

/// What a line with a scan begins with.
const SCAN: &str = "FLASER";

fn number(text: &str) -> Option<f64> {
    let number = text.parse::<f64>().ok();
    number.filter(|it| it.abs() < 1e12)
}

impl Default for FrontLaser {
    fn default() -> Self {
        Self {
            ranges: Vec::with_capacity(MOST_BEAMS),
            pose: [0.0; 3],
            time_s: 0.0,
        }
    }
}

impl FrontLaser {
    /// Reads a line; a broken one leaves the scan empty. Allocates nothing.
    pub fn read(&mut self, line: &str) -> Line {
        let mut fields = line.split_ascii_whitespace();
        match fields.next() {
            Some(SCAN) => {}
            _ => return Line::Other,
        }
        if self.read_fields(fields).is_some() {
            Line::Scan
        } else {
            self.ranges.clear();
            Line::Broken
        }
    }

    /// The time of a line with a scan, by the log's own clock, as far as its last field says it \[s\].
    #[must_use]
    pub fn time_s(line: &str) -> Option<f64> {
        let is_scan = line.split_ascii_whitespace().next() == Some(SCAN);
        let last = line.split_ascii_whitespace().next_back();
        last.filter(|_| is_scan).and_then(number)
    }

    fn read_fields<'l>(&mut self, mut fields: impl Iterator<Item = &'l str>) -> Option<()> {
        self.ranges.clear();
        let count: usize = fields.next()?.parse().ok()?;
        if !(2..=MOST_BEAMS).contains(&count) {
            return None;
        }
        for _ in 0..count {
            self.ranges.push(fields.next()?.parse().ok()?);
        }
        let mut after = [""; FIELDS_AFTER];
        for place in &mut after {
            *place = fields.next()?;
        }
        let [x, y, theta] = [0, 1, 2].map(|place| number(after[place]));
        self.pose = [x?, y?, theta?];
        // The second time is the one that began with the log.
        self.time_s = number(after[8])?;
        fields.next().is_none().then_some(())
    }

    /// The scan, its beams from right to left.
    #[must_use]
    pub fn raw(&self) -> Raw<'_> {
        // 180 and 181 beams are a degree apart, 360 and 361 half a degree.
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let steps = (self.ranges.len() & !1) as f32;
        Raw {
            angle_min_rad: -std::f32::consts::FRAC_PI_2,
            angle_increment_rad: std::f32::consts::PI / steps,
            range_max_m: NOTHING_FROM_M,
            ranges: &self.ranges,
            ..Raw::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_is_written() {
        let mut scan = FrontLaser::default();
        let line = "FLASER 4 1 2.5 81.83 0.5 7 8 0.5 1 2 3 12.5 host 12.75";
        assert_eq!(scan.read(line), Line::Scan);
        let raw = scan.raw();
        assert_eq!(
            (raw.ranges, scan.pose, scan.time_s),
            (&[1.0, 2.5, 81.83, 0.5][..], [7.0, 8.0, 0.5], 12.75)
        );
        assert!(
            crate::View::check(Raw {
                angle_increment_rad: 0.01,
                ..raw
            })
            .is_ok()
        );
    }

    #[test]
    fn what_is_no_scan_is_passed_over_and_what_is_cut_is_broken() {
        let mut scan = FrontLaser::default();
        assert_eq!(scan.read("ODOM 0 0 0 0 0 0 0.2 host 0.2"), Line::Other);
        assert_eq!(scan.read(""), Line::Other);
        for line in [
            "FLASER",
            "FLASER 1 1 7 8 0 1 2 3 1 h 1",
            "FLASER 99999999999999999999 1",
            "FLASER 2 1 x 7 8 0 1 2 3 1 h 1",
            "FLASER 2 1 1 7 8 0 1 2 3 1 h",
            "FLASER 2 1 1 7 8 0 1 2 3 1 h 1 1",
            "FLASER 2 1 1 7 nan 0 1 2 3 1 h 1",
        ] {
            assert_eq!(scan.read(line), Line::Broken, "{line}");
            assert!(scan.raw().ranges.is_empty());
        }
    }
}
