//! A scan as it comes, checked once.

/// As many beams as a scan has at most.
pub const MOST_BEAMS: usize = 2048;
/// A scan takes no longer \[s\].
const LONGEST_S: f32 = 2.0;
/// Farther than that no scanner sees \[m\].
const FARTHEST_M: f32 = 1000.0;

/// A scan as it comes: the fields of a ROS `LaserScan`.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Raw<'a> {
    /// Of the first beam, from forward to the left \[rad\].
    pub angle_min_rad: f32,
    /// From one beam to the next; below zero for a scanner that turns to the right \[rad\].
    pub angle_increment_rad: f32,
    /// From one beam to the next \[s\].
    pub time_increment_s: f32,
    /// What is nearer was not measured \[m\].
    pub range_min_m: f32,
    /// What is at least so far was not hit \[m\].
    pub range_max_m: f32,
    /// A range for each beam; not a number where it is not known \[m\].
    pub ranges: &'a [f32],
    /// How bright each was, or nothing.
    pub intensities: &'a [f32],
}

/// A scan that can be computed with.
#[derive(Copy, Clone, Debug)]
pub struct View<'a>(Raw<'a>);

/// Why a scan cannot be used.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BadScan {
    /// Of the number of its beams.
    #[error("it has fewer than 2 beams or more than 2048")]
    Beams,
    /// Of its angles.
    #[error("its angles are no turn of at most once round, in steps of 0.0001 to 0.2 rad")]
    Angles,
    /// Of its times.
    #[error("its beams take no time of 0 to 2 s in all")]
    Times,
    /// Of its limits.
    #[error("range_min and range_max are no interval from 0 to 1000 m")]
    Limits,
    /// Of its intensities.
    #[error("it has intensities, but not one for each beam")]
    Intensities,
}

/// What a beam met.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Met {
    /// Something, at this range \[m\].
    Surface(f64),
    /// Nothing as far as it reaches.
    Nothing,
    /// Nobody knows.
    Unknown,
}

impl<'a> View<'a> {
    /// Checks a scan.
    ///
    /// # Errors
    /// The first that is wrong with it.
    pub fn check(raw: Raw<'a>) -> Result<Self, BadScan> {
        let count = raw.ranges.len();
        if !(2..=MOST_BEAMS).contains(&count) {
            return Err(BadScan::Beams);
        }
        let step = raw.angle_increment_rad.abs();
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let (gaps, beams) = ((count - 1) as f32, count as f32);
        let is_turn = raw.angle_min_rad.abs() <= 7.0 && (1e-4..=0.2).contains(&step);
        if !is_turn || gaps * step > 2.0 * std::f32::consts::PI + 0.5 * step {
            return Err(BadScan::Angles);
        }
        if raw.time_increment_s.is_nan()
            || !(0.0..=LONGEST_S).contains(&(beams * raw.time_increment_s))
        {
            return Err(BadScan::Times);
        }
        let is_interval = raw.range_min_m >= 0.0 && raw.range_min_m < raw.range_max_m;
        if !is_interval || raw.range_max_m > FARTHEST_M {
            return Err(BadScan::Limits);
        }
        if !raw.intensities.is_empty() && raw.intensities.len() != count {
            return Err(BadScan::Intensities);
        }
        Ok(Self(raw))
    }

    /// What was checked.
    #[must_use]
    pub const fn raw(&self) -> &Raw<'a> {
        &self.0
    }

    /// Of the beam in that place \[rad\].
    #[must_use]
    pub fn angle(&self, place: usize) -> f64 {
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let steps = place as f64;
        f64::from(self.0.angle_min_rad) + steps * f64::from(self.0.angle_increment_rad)
    }

    /// When that beam was measured, after the first \[s\].
    #[must_use]
    pub fn time(&self, place: usize) -> f64 {
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let steps = place as f64;
        steps * f64::from(self.0.time_increment_s)
    }

    /// What that beam met.
    #[must_use]
    pub fn met(&self, place: usize) -> Met {
        let Raw {
            range_min_m,
            range_max_m,
            ..
        } = self.0;
        match self.0.ranges[place] {
            range if range.is_nan() || range < range_min_m || range <= 0.0 => Met::Unknown,
            range if range >= range_max_m => Met::Nothing,
            range => Met::Surface(range.into()),
        }
    }

    /// How bright that beam was, if the scanner says so.
    #[must_use]
    pub fn intensity(&self, place: usize) -> Option<f32> {
        self.0.intensities.get(place).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGES: [f32; 3] = [1.0; 3];

    fn raw() -> Raw<'static> {
        Raw {
            angle_increment_rad: 0.01,
            range_max_m: 10.0,
            ranges: &RANGES,
            ..Raw::default()
        }
    }

    #[test]
    fn each_field_has_its_refusal() {
        assert!(View::check(raw()).is_ok());
        let long = vec![1.0; MOST_BEAMS + 1];
        for (bad, why) in [
            (
                Raw {
                    ranges: &[],
                    ..raw()
                },
                BadScan::Beams,
            ),
            (
                Raw {
                    ranges: &long,
                    ..raw()
                },
                BadScan::Beams,
            ),
            (
                Raw {
                    angle_increment_rad: 0.0,
                    ..raw()
                },
                BadScan::Angles,
            ),
            (
                Raw {
                    angle_increment_rad: f32::NAN,
                    ..raw()
                },
                BadScan::Angles,
            ),
            (
                Raw {
                    angle_min_rad: f32::INFINITY,
                    ..raw()
                },
                BadScan::Angles,
            ),
            (
                Raw {
                    ranges: &long[..2048],
                    ..raw()
                },
                BadScan::Angles,
            ),
            (
                Raw {
                    time_increment_s: -1.0,
                    ..raw()
                },
                BadScan::Times,
            ),
            (
                Raw {
                    time_increment_s: f32::NAN,
                    ..raw()
                },
                BadScan::Times,
            ),
            (
                Raw {
                    range_min_m: f32::NAN,
                    ..raw()
                },
                BadScan::Limits,
            ),
            (
                Raw {
                    range_max_m: 0.0,
                    ..raw()
                },
                BadScan::Limits,
            ),
            (
                Raw {
                    range_max_m: f32::INFINITY,
                    ..raw()
                },
                BadScan::Limits,
            ),
            (
                Raw {
                    intensities: &[1.0],
                    ..raw()
                },
                BadScan::Intensities,
            ),
        ] {
            assert_eq!(View::check(bad).err(), Some(why), "{bad:?}");
        }
    }

    #[test]
    fn a_beam_met_something_nothing_or_is_not_known() {
        let ranges = [f32::NAN, 0.0, 0.04, 0.05, 9.9, 10.0, f32::INFINITY, -1.0];
        let view = View::check(Raw {
            ranges: &ranges,
            range_min_m: 0.05,
            ..raw()
        })
        .unwrap();
        let met = [0, 1, 2, 3, 4, 5, 6, 7].map(|place| match view.met(place) {
            Met::Surface(_) => 's',
            Met::Nothing => 'n',
            Met::Unknown => 'u',
        });
        assert_eq!(met, ['u', 'u', 'u', 's', 's', 'n', 'n', 'u']);
    }
}
