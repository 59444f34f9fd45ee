//! The payloads: plain `#[repr(C)]`, fixed size, versioned in their type name, the same bytes in every language.
#![allow(missing_docs)]

use iceoryx2::prelude::ZeroCopySend;

/// Which sender, which start of it, which message: enough to tell a repetition from news.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
pub struct Header {
    /// When it was measured [ns of the configured clock].
    pub stamp_ns: i64,
    /// When the sender started [ns of the configured clock]: a restarted sender counts from 0 again.
    pub session_ns: i64,
    /// Counts the sender's messages on this channel.
    pub sequence: u64,
}

/// `coloc/<robot>/relative_pose`: this robot's sighting of another.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.RelativePose.v1")]
pub struct RelativePose {
    pub header: Header,
    /// Team number of the robot that was seen.
    pub observed: u16,
    pub reserved: [u8; 6],
    /// `[δx, δy, δφ]` of the observed robot in this robot's body frame [m, m, rad].
    pub pose: [f64; 3],
    /// Full row-major.
    pub covariance: [f64; 9],
}

/// `coloc/<robot>/position`: a satellite fix in the local frame.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Position.v1")]
pub struct Position {
    pub header: Header,
    /// Quality field of NMEA GGA: 0 none, 1 autonomous, 2 differential, 4 RTK fixed, 5 RTK float.
    pub quality: u8,
    pub reserved: [u8; 7],
    /// `[x, y]` [m].
    pub position: [f64; 2],
    /// Full row-major [m²].
    pub covariance: [f64; 4],
}

/// `coloc/<robot>/neighbour`: pose of this robot as a neighbour sees it.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Neighbour.v1")]
pub struct Neighbour {
    pub header: Header,
    /// Team number of the sender.
    pub sender: u16,
    pub reserved: [u8; 6],
    /// `[x, y, φ]` of the receiving robot in the common frame [m, m, rad].
    pub pose: [f64; 3],
    /// R*, full row-major.
    pub total: [f64; 9],
    /// `R*_i`, full row-major.
    pub independent: [f64; 9],
}

/// `coloc/<robot>/estimate`: the belief of every tick; a late joiner gets the last one.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Estimate.v1")]
pub struct Estimate {
    pub header: Header,
    /// Ticks since the daemon started.
    pub tick: u64,
    /// Kernel receive stamp of the newest encoder frame in this estimate [ns of the configured clock]; 0 if none yet.
    pub frame_stamp_ns: i64,
    /// From the wake-up of this tick to just before this message was sent [ns].
    pub latency_ns: u64,
    /// Wake-up lateness of this tick against its deadline [ns].
    pub lateness_ns: u64,
    /// `[x, y, φ]` in the common frame [m, m, rad].
    pub pose: [f64; 3],
    /// `[v_x, v_y, ω]` in the body frame [m/s, m/s, rad/s].
    pub velocity: [f64; 3],
    /// P, full row-major.
    pub total: [f64; 9],
    /// `P_i`, full row-major.
    pub independent: [f64; 9],
    /// Health by sensor, one byte each: see `Health`. [odometry, relative poses, position, neighbours]
    pub health: [u8; 4],
    pub robot: u16,
    pub reserved: [u8; 2],
}

/// `coloc/<robot>/status`: counters, 1 Hz. (Reasons and sensors are indexed by enums in this crate.)
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Status.v1")]
pub struct Status {
    pub header: Header,
}
