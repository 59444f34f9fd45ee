//! A satellite fix.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;

/// `coloc/<robot>/position`: a satellite fix in the local frame.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Position.v1")]
pub struct Position {
    /// Stamp, session and sequence of the receiver's driver.
    pub header: Header,
    /// Quality field of NMEA GGA: 0 no fix, 1 autonomous, 2 differential, 4 RTK fixed, 5 RTK float; at most 8.
    pub quality: u8,
    /// Zero.
    pub reserved: [u8; 7],
    /// `[x, y]` in the common frame [m].
    pub position: [f64; 2],
    /// R of `position`, 2×2, full row-major [m²].
    pub covariance: [f64; 4],
}

layout!(Position, 80; header: 0, quality: 24, reserved: 25, position: 32, covariance: 48);
