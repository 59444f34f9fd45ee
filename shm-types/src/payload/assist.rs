//! Where a leader has this robot.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::{Matrix, all_zero};
use crate::{Limits, Reject};

/// `coloc/<robot>/assist`: pose of this robot, composed of a leader's belief and of what the robots in `path` have seen of one another;
/// no belief of a child has a part in it. It is answered by [`AssistAck`](crate::AssistAck), but for a leader's own.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Assist.v2")]
pub struct Assist {
    /// When it holds, by which clock; `source` is the sender's team number.
    pub header: Header,
    /// Of which event: `⌊(stamp − phase)/period⌋`, by `[assist]`.
    pub slot: i64,
    /// `y*`: `[x, y, φ]` of the receiving robot in the common frame (m, m, rad).
    pub pose: [f64; 3],
    /// `R*_i`, what the sightings alone make of it, 3×3, full row-major (m², m·rad, rad²).
    pub independent: [f64; 9],
    /// `R*_d`, what comes of the leader's own error, likewise.
    pub dependent: [f64; 9],
    /// Where the leader was; all robots on the way hand it on as it is.
    pub leader_pose: [f64; 3],
    /// Of that, likewise.
    pub leader_covariance: [f64; 9],
    /// What became of the leader's error since the last event, since the last but one, and so on: 3×3 each, full row-major.
    pub transitions: [[f32; 9]; 8],
    /// Team numbers: the leader, every child on the way, and the receiving robot; what follows is zero.
    pub path: [u16; 16],
    /// How many they are.
    pub robots: u8,
    /// So many events ago the leader's error began to go its way, 255 if that was earlier: it started, was told where it is, or learnt
    /// something of which nobody can say what it did to the error.
    pub known: u8,
    /// [`Self::FINAL`].
    pub flags: u8,
    /// So many of `transitions` are said, no more than `known`; the others are zero.
    pub said: u8,
    /// What the leader knew of the event where leaders know all readings, of what is [`Self::FINAL`] alone; else zero.
    pub digest: u32,
}

layout!(Assist, 640;
    header: 0, slot: 40, pose: 48, independent: 72, dependent: 144, leader_pose: 216, leader_covariance: 240, transitions: 312,
    path: 600, robots: 632, known: 633, flags: 634, said: 635, digest: 636,
);

impl Assist {
    /// In `flags`: it is not to be handed on, and not answered.
    pub const FINAL: u8 = 1;

    /// Whom it came through.
    #[must_use]
    pub fn robots(&self) -> &[u16] {
        self.path
            .get(..usize::from(self.robots))
            .unwrap_or(&self.path)
    }

    /// Checks everything that can be known of this message alone. The angles may be any finite numbers.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        for numbers in [&self.pose[..], &self.leader_pose] {
            Limits::check_finite(numbers)?;
        }
        for transition in &self.transitions {
            Limits::check_finite(&transition.map(f64::from))?;
        }
        let [independent, dependent, leader] =
            [self.independent, self.dependent, self.leader_covariance]
                .map(Matrix::<3>::from_row_major);
        Matrix::check_parts(&independent, &dependent)?;
        leader.check_covariance()?;
        independent.plus(&dependent).check_variances()?;
        Limits::check_supported(self.uses_what_is_known())?;
        limits.check_other(self.header.source)?;
        for robot in self.robots() {
            limits.check_member(*robot)?;
        }
        limits.check_time(&self.header)
    }

    fn uses_what_is_known(&self) -> bool {
        let unsaid = self.transitions.get(usize::from(self.said)..);
        let unused = self.path.get(usize::from(self.robots)..);
        self.said <= self.known
            && unsaid.is_some_and(|it| it.iter().all(|it| all_zero(&it.map(f64::from))))
            && unused.is_some_and(|it| it.iter().all(|robot| *robot == 0))
            && self.flags <= Self::FINAL
            && (self.digest == 0 || self.flags == Self::FINAL)
    }
}
