//! What a robot tells the others of a slot of time.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::{Limits, Reject};

/// Where a robot has a neighbour at the end of a slot; a part of [`Evidence`].
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.SeenWithin.v1")]
pub struct SeenWithin {
    /// Team number of the neighbour.
    pub observed: u16,
    /// Zero, others are refused.
    pub reserved: [u8; 6],
    /// The middle of where it is, `[x, y]` in the body frame of the robot that tells (m).
    pub centre: [f64; 2],
    /// By how much that can be off (m).
    pub half: [f64; 2],
    /// Its heading less that of the robot that tells (rad).
    pub turn: f64,
    /// By how much that can be off (rad); π or more says nothing.
    pub turn_half: f64,
}

layout!(SeenWithin, 56; observed: 0, reserved: 2, centre: 8, half: 24, turn: 40, turn_half: 48);

/// `coloc/<robot>/evidence`: what this robot's own sensors say of a slot of the common clock, with hard bounds, all of it moved to the slot's end.
/// Of `coloc-bounds`, for the others of the team.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Evidence.v1")]
pub struct Evidence {
    /// The slot's end, by which clock; `source` is the robot's team number.
    pub header: Header,
    /// The slot's number: its end over its length.
    pub epoch: u64,
    /// How far the robot can have moved in the slot, in sixteen directions of the common frame that are equally spaced, from x on (m).
    pub moved: [f64; 16],
    /// How it turned, and by how much that can be off (rad).
    pub turn: [f64; 2],
    /// Its heading as its compass has it, and by how much that can be off (rad). Zero where there is none.
    pub compass: [f64; 2],
    /// Where its receiver has it, `[x, y]` in the common frame (m). Zero where there is no fix.
    pub fix: [f64; 2],
    /// By how much that can be off (m).
    pub fix_half: [f64; 2],
    /// The neighbours that it sees, `seen_count` of them; the rest is zero.
    pub seen: [SeenWithin; 16],
    /// How many.
    pub seen_count: u8,
    /// [`Self::FIX`], [`Self::COMPASS`].
    pub has: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 6],
}

layout!(Evidence, 1144;
    header: 0, epoch: 40, moved: 48, turn: 176, compass: 192, fix: 208, fix_half: 224, seen: 240, seen_count: 1136, has: 1137,
    reserved: 1138,
);

impl Evidence {
    /// In `has`: there is a fix.
    pub const FIX: u8 = 1;
    /// In `has`: there is a compass.
    pub const COMPASS: u8 = 2;

    /// The neighbours that it sees.
    #[must_use]
    pub fn seen(&self) -> &[SeenWithin] {
        let count = usize::from(self.seen_count).min(self.seen.len());
        &self.seen[..count]
    }

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.moved)?;
        for pair in [self.turn, self.compass, self.fix, self.fix_half] {
            Limits::check_finite(&pair)?;
        }
        for it in &self.seen {
            Limits::check_finite(&it.centre)?;
            Limits::check_finite(&it.half)?;
            Limits::check_finite(&[it.turn, it.turn_half])?;
            Limits::check_not_negative(&it.half)?;
            Limits::check_not_negative(&[it.turn_half])?;
        }
        Limits::check_not_negative(&[self.turn[1], self.compass[1]])?;
        Limits::check_not_negative(&self.fix_half)?;
        self.check_bounds()?;
        Limits::check_supported(self.is_supported())?;
        limits.check_other(self.header.source)?;
        for it in self.seen() {
            limits.check_member(it.observed)?;
        }
        limits.check_time(&self.header)
    }

    /// A bound of zero is one of somebody who does not know it: no sensor is exact.
    fn check_bounds(&self) -> Result<(), Reject> {
        let has = |what: u8| self.has & what != 0;
        let is_exact = |half: &[f64]| half.contains(&0.0);
        let is_exact = has(Self::FIX) && is_exact(&self.fix_half)
            || has(Self::COMPASS) && is_exact(&self.compass[1..])
            || self
                .seen
                .iter()
                .take_while(|_| usize::from(self.seen_count) <= self.seen.len())
                .take(usize::from(self.seen_count))
                .any(|it| is_exact(&it.half) || it.turn_half == 0.0);
        if is_exact {
            return Err(Reject::NoCovariance);
        }
        Ok(())
    }

    fn is_supported(&self) -> bool {
        let is_free = |it: &SeenWithin| it.reserved == [0; 6];
        // Some way in every direction: there and back is nowhere at least.
        let opposite = (0..8).all(|k| self.moved[k] + self.moved[k + 8] >= 0.0);
        usize::from(self.seen_count) <= self.seen.len()
            && self.has <= (Self::FIX | Self::COMPASS)
            && self.reserved == [0; 6]
            && self.seen.iter().all(is_free)
            && opposite
    }
}
