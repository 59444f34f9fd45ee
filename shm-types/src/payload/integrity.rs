//! Where a robot must be, and whether its estimate can be right.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::{Limits, Reject};

/// Something without which alone all fits; a part of [`Integrity`].
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Suspect.v1")]
pub struct Suspect {
    /// [`Self::FIX`], [`Self::SIGHTINGS`], [`Self::SIGHTING`], [`Self::MOTION`] or [`Self::COMPASS`]; zero: the place is empty.
    pub kind: u8,
    /// Zero.
    pub reserved: u8,
    /// Team number of the robot whose it is.
    pub robot: u16,
    /// Team number of who was seen, of one sighting; else zero.
    pub other: u16,
    /// Zero.
    pub reserved_too: u16,
    /// The end of the slot of which it was said (ns of the header's clock).
    pub stamp_ns: i64,
}

layout!(Suspect, 16; kind: 0, reserved: 1, robot: 2, other: 4, reserved_too: 6, stamp_ns: 8);

impl Suspect {
    /// `kind` of a robot's fixes.
    pub const FIX: u8 = 1;
    /// `kind` of all that a robot sees.
    pub const SIGHTINGS: u8 = 2;
    /// `kind` of what one robot says of one other.
    pub const SIGHTING: u8 = 3;
    /// `kind` of where a robot was, or how it moved.
    pub const MOTION: u8 = 4;
    /// `kind` of a robot's compass.
    pub const COMPASS: u8 = 5;
}

/// `coloc/<robot>/integrity`: the region in which this robot must be if all errors are within their bounds, and whether its estimate is in it. Of
/// `coloc-bounds`; `colocd` hears it where `[integrity] action` says so, and says it on: a belief is never changed by it.
#[derive(Copy, Clone, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Integrity.v1")]
pub struct Integrity {
    /// The slot's end, by the configured clock; `source` is the robot's team number.
    pub header: Header,
    /// The slot's number: its end over its length.
    pub epoch: u64,
    /// The stamp of the estimate that was judged (ns of the header's clock); zero: none was.
    pub judged_stamp_ns: i64,
    /// How far that is outside of the region, in the larger of x and y (m). Zero: inside.
    pub distance_m: f64,
    /// From that to the farthest corner of the region (m).
    pub protection_radius_m: f64,
    /// Of the region (m²).
    pub area_m2: f64,
    /// The robot's heading, and by how much that can be off (rad); π: it is not known.
    pub heading: [f64; 2],
    /// Corners of the region, counter-clockwise, `vertex_count` of them; the rest is zero (m).
    pub vertices: [[f64; 2]; 32],
    /// Everything without which alone the slot fits, `conflict_count` of them. One is a finding, several are "one of these", none with
    /// [`Self::BOUNDS_VIOLATED`] is "more than one".
    pub conflicts: [Suspect; 8],
    /// The robot's team number.
    pub robot: u16,
    /// [`Self::OK`] and those below.
    pub state: u8,
    /// Whether the estimate can be right: [`Self::UNKNOWN`], [`Self::YES`] or [`Self::NO`].
    pub contained: u8,
    /// How many corners; zero: the region is not bounded.
    pub vertex_count: u8,
    /// How many suspects there are; more than eight are not all told.
    pub conflict_count: u8,
    /// Zero.
    pub reserved: [u8; 2],
}

layout!(Integrity, 744;
    header: 0, epoch: 40, judged_stamp_ns: 48, distance_m: 56, protection_radius_m: 64, area_m2: 72, heading: 80, vertices: 96,
    conflicts: 608, robot: 736, state: 738, contained: 739, vertex_count: 740, conflict_count: 741, reserved: 742,
);

impl Default for Integrity {
    /// Starting, nothing known.
    fn default() -> Self {
        Self {
            header: Header::default(),
            epoch: 0,
            judged_stamp_ns: 0,
            distance_m: 0.0,
            protection_radius_m: 0.0,
            area_m2: 0.0,
            heading: [0.0, core::f64::consts::PI],
            vertices: [[0.0; 2]; 32],
            conflicts: [Suspect::default(); 8],
            robot: 0,
            state: Self::STARTING,
            contained: Self::UNKNOWN,
            vertex_count: 0,
            conflict_count: 0,
            reserved: [0; 2],
        }
    }
}

impl Integrity {
    /// `state`: all fits, the estimate too as far as there is one.
    pub const OK: u8 = 0;
    /// `state`: the estimate cannot be right.
    pub const ESTIMATE_OUTSIDE: u8 = 1;
    /// `state`: what was measured cannot all be within its bounds.
    pub const BOUNDS_VIOLATED: u8 = 2;
    /// `state`: nothing bounds the region.
    pub const NOT_OBSERVABLE: u8 = 3;
    /// `state`: slots were not closed in time.
    pub const STALE: u8 = 4;
    /// `state`: nothing is known yet, or everything was forgotten.
    pub const STARTING: u8 = 5;

    /// `contained`: nobody knows.
    pub const UNKNOWN: u8 = 0;
    /// `contained`: it can be right.
    pub const YES: u8 = 1;
    /// `contained`: it cannot.
    pub const NO: u8 = 2;

    /// The corners of the region.
    #[must_use]
    pub fn vertices(&self) -> &[[f64; 2]] {
        let count = usize::from(self.vertex_count).min(self.vertices.len());
        &self.vertices[..count]
    }

    /// Who is suspected.
    #[must_use]
    pub fn conflicts(&self) -> &[Suspect] {
        let count = usize::from(self.conflict_count).min(self.conflicts.len());
        &self.conflicts[..count]
    }

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        let Self {
            distance_m,
            protection_radius_m,
            area_m2,
            ..
        } = *self;
        Limits::check_finite(&[distance_m, protection_radius_m, area_m2])?;
        Limits::check_finite(&self.heading)?;
        Limits::check_finite(self.vertices.as_flattened())?;
        Limits::check_not_negative(&[distance_m, protection_radius_m, area_m2, self.heading[1]])?;
        Limits::check_supported(self.is_supported())?;
        limits.check_member(self.header.source)?;
        limits.check_time(&self.header)
    }

    fn is_supported(&self) -> bool {
        let is_known = |it: &Suspect| (Suspect::FIX..=Suspect::COMPASS).contains(&it.kind);
        self.state <= Self::STARTING
            && self.contained <= Self::NO
            && usize::from(self.vertex_count) <= self.vertices.len()
            && usize::from(self.conflict_count) <= self.conflicts.len()
            && self.conflicts().iter().all(is_known)
            && self.reserved == [0; 2]
            && self.robot == self.header.source
    }
}
