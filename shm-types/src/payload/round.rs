//! What came of a slot.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use super::shared::check_belief;
use crate::layout::layout;
use crate::{Limits, Reject};

/// What the team has of one robot; a part of [`Round`].
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.RoundEntry.v1")]
pub struct RoundEntry {
    /// The slot of its last round.
    pub slot: u64,
    /// `x̂⁺` then (m, m, rad).
    pub pose: [f64; 3],
    /// `P⁺`, row by row (m², m·rad, rad²).
    pub covariance: [f64; 9],
    /// Of the block bound, 1 where nobody joined.
    pub factor: f64,
    /// By how much its P has to be multiplied when it takes part again.
    pub owed: f64,
    /// 1: it has taken part; 0: never, or what it shares is forgotten.
    pub is_there: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 7],
}

layout!(RoundEntry, 128; slot: 0, pose: 8, covariance: 32, factor: 104, owed: 112, is_there: 120, reserved: 121);

/// `coloc/<robot>/round`: of each robot of a team its newest correction, of each pair what they share. Of the `coloc-rounds` of who led, and of whoever
/// was asked for it, for the others of the team.
#[derive(Copy, Clone, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Round.v1")]
pub struct Round {
    /// When it was said; `source` is the team number of who says it.
    pub header: Header,
    /// The slot that it is of, its name.
    pub slot: u64,
    /// Team numbers, ascending, `count` of them; the rest is zero.
    pub robots: [u16; 16],
    /// Of each robot.
    pub entries: [RoundEntry; 16],
    /// `C_lm` of each pair l < m, row by row, l at l's last round and m at m's: 0-1, 0-2, …, 1-2, …
    pub cross: [[f64; 9]; 120],
    /// Team number of who led.
    pub leader: u16,
    /// How many robots.
    pub count: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 5],
}

layout!(Round, 10776; header: 0, slot: 40, robots: 48, entries: 80, cross: 2128, leader: 10768, count: 10770, reserved: 10771);

impl Default for Round {
    fn default() -> Self {
        Self {
            header: Header::default(),
            slot: 0,
            robots: [0; 16],
            entries: [RoundEntry::default(); 16],
            cross: [[0.0; 9]; 120],
            leader: 0,
            count: 0,
            reserved: [0; 5],
        }
    }
}

impl Round {
    /// The team.
    #[must_use]
    pub fn robots(&self) -> &[u16] {
        &self.robots[..usize::from(self.count).min(self.robots.len())]
    }

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        for it in &self.entries {
            Limits::check_finite(&it.pose)?;
            Limits::check_finite(&[it.factor, it.owed])?;
            check_belief(it.is_there == 1, &it.covariance)?;
        }
        Limits::check_finite(self.cross.as_flattened())?;
        let is_free = self
            .entries
            .iter()
            .all(|it| it.reserved == [0; 7] && it.is_there <= 1);
        let fits = usize::from(self.count) <= self.robots.len() && self.reserved == [0; 5];
        Limits::check_supported(is_free && fits)?;
        limits.check_other(self.header.source)?;
        limits.check_member(self.leader)?;
        for robot in self.robots() {
            limits.check_member(*robot)?;
        }
        // All of them, each once.
        let ascends = self.robots().is_sorted_by(|a, b| a < b);
        if !ascends || self.robots().len() != limits.robots.len() {
            return Err(Reject::UnknownRobot);
        }
        limits.check_time(&self.header)
    }
}
