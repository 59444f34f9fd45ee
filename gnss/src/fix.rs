//! A fix: all that a receiver said of one moment.

/// Where the antenna was, and when.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Fix {
    /// Since 1970 (ns of UTC as computers count it); none while no date is known.
    pub utc_ns: Option<i64>,
    /// Latitude and longitude (degrees).
    pub place: [f64; 2],
    /// Above the ellipsoid (m).
    pub height_m: Option<f64>,
    /// Quality field of NMEA GGA.
    pub quality: u8,
    /// Satellites used.
    pub satellites: Option<u32>,
    /// Horizontal dilution of precision.
    pub hdop: Option<f64>,
    /// What the receiver says of its standard deviation, north and east (m).
    pub stated_m: Option<[f64; 2]>,
    /// Speed over ground (m/s).
    pub speed_m_s: Option<f64>,
    /// Course over ground, from true north to the right (degrees).
    pub course_deg: Option<f64>,
}

impl Fix {
    /// The worse of the two deviations that are stated, where they say anything (m).
    #[must_use]
    pub fn worst_m(&self) -> Option<f64> {
        let worst = self.stated_m.map(|[north, east]| north.max(east));
        worst.filter(|worst| *worst > 0.0)
    }

    /// Its velocity, east and north (m/s).
    #[must_use]
    pub fn velocity(&self) -> Option<[f64; 2]> {
        let (speed, course) = self.speed_m_s.zip(self.course_deg)?;
        let (sin, cos) = course.to_radians().sin_cos();
        Some([speed * sin, speed * cos])
    }
}
