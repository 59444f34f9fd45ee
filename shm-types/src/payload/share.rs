//! What a robot tells the leader of a slot.
use iceoryx2::prelude::ZeroCopySend;

use super::shared::check_belief;
use super::{Header, Shared};
use crate::layout::layout;
use crate::{Limits, Reject};

/// Where a robot has another one, at a slot; a part of [`Share`].
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.SeenAtSlot.v1")]
pub struct SeenAtSlot {
    /// Team number of who is seen.
    pub observed: u16,
    /// Zero, others are refused.
    pub reserved: [u8; 6],
    /// How long before the slot that was (s). Who sees it has not moved since, as it is told here; who is seen may have.
    pub age_s: f64,
    /// Its pose in the body frame that who sees it has at the slot, `[x, y, φ]` (m, m, rad).
    pub pose: [f64; 3],
    /// Of its error, row by row (m², m·rad, rad²).
    pub covariance: [f64; 9],
}

layout!(SeenAtSlot, 112; observed: 0, reserved: 2, age_s: 8, pose: 16, covariance: 40);

/// `coloc/<robot>/share`: what a robot believes and sees at a slot, for one leader. Of `coloc-rounds`, for the others of the team.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Share.v1")]
pub struct Share {
    /// When the slot begins; `source` is the robot's team number.
    pub header: Header,
    /// The slot's number.
    pub slot: u64,
    /// The slot of the newest round that it knows.
    pub known: u64,
    /// As in [`Shared`].
    pub since: u64,
    /// `[x, y, φ]` in the common frame (m, m, rad).
    pub pose: [f64; 3],
    /// P, row by row (m², m·rad, rad²).
    pub covariance: [f64; 9],
    /// Ψ, row by row.
    pub psi: [f64; 9],
    /// `[v_x, v_y, ω]` in its body frame (m/s, m/s, rad/s).
    pub velocity: [f64; 3],
    /// How fast the error of what it drives grows, row by row (m²/s, m·rad/s, rad²/s).
    pub velocity_noise: [f64; 9],
    /// What it sees, `seen_count` of them; the rest is zero.
    pub seen: [SeenAtSlot; 16],
    /// Team number of who is to lead.
    pub leader: u16,
    /// [`Shared::JOINING`] or [`Shared::SINCE`].
    pub standing: u8,
    /// How many.
    pub seen_count: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 4],
}

layout!(Share, 2128;
    header: 0, slot: 40, known: 48, since: 56, pose: 64, covariance: 88, psi: 160, velocity: 232, velocity_noise: 256, seen: 328,
    leader: 2120, standing: 2122, seen_count: 2123, reserved: 2124,
);

impl Share {
    /// What it sees.
    #[must_use]
    pub fn seen(&self) -> &[SeenAtSlot] {
        let count = usize::from(self.seen_count).min(self.seen.len());
        &self.seen[..count]
    }

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Limits::check_finite(&self.psi)?;
        Limits::check_finite(&self.velocity)?;
        check_belief(true, &self.covariance)?;
        check_belief(false, &self.velocity_noise)?;
        for it in self.seen() {
            Limits::check_finite(&it.pose)?;
            Limits::check_finite(&[it.age_s])?;
            check_belief(true, &it.covariance)?;
        }
        let is_known = matches!(self.standing, Shared::JOINING | Shared::SINCE);
        let is_free = self.seen.iter().all(|it| it.reserved == [0; 6]) && self.reserved == [0; 4];
        let fits = usize::from(self.seen_count) <= self.seen.len();
        Limits::check_supported(is_known && is_free && fits)?;
        limits.check_other(self.header.source)?;
        limits.check_member(self.leader)?;
        for it in self.seen() {
            limits.check_member(it.observed)?;
        }
        limits.check_time(&self.header)
    }
}
