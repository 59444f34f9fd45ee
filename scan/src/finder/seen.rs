//! What is said of a robot that was seen.

use nalgebra::Matrix2;

/// A robot that was seen.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Seen {
    /// Its number.
    pub robot: u16,
    /// When its middle was scanned, after the first beam \[s\].
    pub time_s: f64,
    /// So many beams met it.
    pub beams: usize,
    /// Forward, left and heading in the scanner's frame at that moment; no heading where none was seen \[m, m, rad\].
    pub pose: [f64; 3],
    /// Of `pose`, 3×3; zero where no heading was seen \[m², m·rad, rad²\].
    pub covariance: [[f64; 3]; 3],
    /// Whether its heading was seen.
    pub has_heading: bool,
}

/// Range and bearing alone.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RangeBearing {
    /// \[m\]
    pub range_m: f64,
    /// From forward to the left \[rad\].
    pub bearing_rad: f64,
    /// Of both, 2×2 \[m², m·rad, rad²\].
    pub covariance: [[f64; 2]; 2],
}

impl Seen {
    /// What was seen of it, as range and bearing.
    #[must_use]
    pub fn range_bearing(&self) -> RangeBearing {
        let [x, y, _] = self.pose;
        let range = x.hypot(y);
        let (cos, sin) = (x / range, y / range);
        let slope = Matrix2::new(cos, sin, -sin / range, cos / range);
        let [[a, b, _], [c, d, _], _] = self.covariance;
        let covariance = slope * Matrix2::new(a, b, c, d) * slope.transpose();
        RangeBearing {
            range_m: range,
            bearing_rad: y.atan2(x),
            covariance: [0, 1].map(|row| [0, 1].map(|column| covariance[(row, column)])),
        }
    }
}
