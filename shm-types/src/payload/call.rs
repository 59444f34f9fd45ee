//! Who is there at a slot, and the question for a round that was missed.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::{Limits, Reject};

/// `coloc/<robot>/call`: that a robot is there and which round it knows, or the question for a newer one. Of `coloc-rounds`, for the others of the team.
/// The answer is a [`Round`](crate::Round).
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Call.v1")]
pub struct Call {
    /// When it was said; `source` is the robot's team number.
    pub header: Header,
    /// The present slot's number.
    pub slot: u64,
    /// The slot of the newest round that it knows.
    pub known: u64,
    /// With [`Self::ASK`] the team number of who is asked; else zero.
    pub to: u16,
    /// [`Self::HERE`] or [`Self::ASK`].
    pub kind: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 5],
}

layout!(Call, 64; header: 0, slot: 40, known: 48, to: 56, kind: 58, reserved: 59);

impl Call {
    /// `kind`: I am here.
    pub const HERE: u8 = 0;
    /// `kind`: is there a newer round?
    pub const ASK: u8 = 1;

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_supported(self.kind <= Self::ASK && self.reserved == [0; 5])?;
        limits.check_other(self.header.source)?;
        if self.kind == Self::ASK {
            limits.check_member(self.to)?;
        }
        limits.check_time(&self.header)
    }
}
