//! Whether a robot has used what this one handed on to it.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::{Limits, Reject};

/// `coloc/<robot>/assist_ack`: whether a child has used what this one handed on to it. It answers [`Assist`](crate::Assist).
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.AssistAck.v1")]
pub struct AssistAck {
    /// The stamp of what is answered; `source` is the team number of the child.
    pub header: Header,
    /// `slot` of what is answered.
    pub slot: i64,
    /// Team number of its leader.
    pub leader: u16,
    /// 1: it is used, and with it the sighting. 0: the sighting may serve another leader.
    pub taken: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 5],
}

layout!(AssistAck, 56; header: 0, slot: 40, leader: 48, taken: 50, reserved: 51);

impl AssistAck {
    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_supported(self.taken <= 1 && self.reserved == [0; 5])?;
        limits.check_other(self.header.source)?;
        limits.check_member(self.leader)?;
        limits.check_time(&self.header)
    }
}
