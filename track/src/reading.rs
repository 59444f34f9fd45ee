//! What a sensor of the observer measured of one neighbour.

/// Range \[m\] and bearing \[rad\] in the sensor's frame, or one of them, with the variances of their white noise \[m², rad²\].
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Reading {
    /// Both.
    RangeBearing {
        /// \[m\]
        range_m: f64,
        /// \[rad\]
        bearing_rad: f64,
        /// \[m², rad²\]
        white: [f64; 2],
    },
    /// A range alone.
    Range {
        /// \[m\]
        range_m: f64,
        /// \[m²\]
        white: f64,
    },
    /// A bearing alone.
    Bearing {
        /// \[rad\]
        bearing_rad: f64,
        /// \[rad²\]
        white: f64,
    },
}
