//! Rounds: a robot's own part in a team's joint filter, as the history and the filter carry it.
//!
//! Between rounds a robot is alone. Beside its belief it keeps Ψ, by which what it shares with others has changed since its last round; the belief is as
//! in split covariance intersection, but all of it counts as dependent, and nothing that others say of it is fused:
//!
//! ```text
//! wheels:     Ψ ← A Ψ           A of the honest step (`honest`), the same that takes P along
//! own sensor: Ψ ← (I − K H) Ψ   silent: the others' gain is zero
//! slot:       the belief and Ψ are shared
//! correction: the belief at its slot is replaced, Ψ := I, and all that came since is applied again
//! ```
//!
//! Where the slot has left the history already, that is to first order (`late`).
//!
//! A is the mean of the step's derivative over the headings that the robot may have, so `E[x⁺ eᵀ] = A E[x eᵀ]` for whatever is jointly Gaussian with
//! it: P and Ψ belong to one joint filter. A slow error of a receiver or a compass would be correlated with what others have learnt of it, so it is counted
//! as white noise that is as strong ([`crate::heading`]).
//!
//! Who is found, set by a person or lost shares nothing that anybody knows. It joins: its next round multiplies it, and the others, by a
//! block bound. A correction for what it shared before acts on nothing any more.

pub mod gate;
mod late;

pub use gate::Refusal;
pub(crate) use late::{Late, Lates, MOST as MOST_LATE};
use nalgebra::Matrix3;

use crate::belief::Belief;
use crate::honest::Map;
use crate::pose::Pose;
use crate::stamp::Stamp;
use crate::symmetric::Square3;

/// Beliefs that were shared are remembered for so many slots: ten a second for as long as a correction may be late.
const SHARES: usize = 40;

/// How a robot takes part.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RoundSettings {
    /// Robots in the team: no block bound is more.
    pub robots: usize,
    /// χ² of corrections, three degrees of freedom.
    pub gate: f64,
}

/// What a robot's cross-covariances refer to.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    /// The round of this slot was its last.
    Since(u64),
    /// They are unknown: it joins, at this slot or any later one, by a block bound.
    Joining(u64),
}

/// What is shared at a slot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Shared {
    /// The slot.
    pub slot: u64,
    /// `x̂`
    pub pose: Pose,
    /// P
    pub covariance: Matrix3<f64>,
    /// Ψ since the last round.
    pub psi: Matrix3<f64>,
    /// Which that was.
    pub standing: Standing,
}

/// What a round made of one robot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Correction {
    /// The slot that it is of, which is also the name of the round.
    pub slot: u64,
    /// `x̂⁺` at the slot.
    pub pose: Pose,
    /// `P⁺` at the slot.
    pub covariance: Matrix3<f64>,
    /// The factor of the block bound, 1 where nobody joined.
    pub factor: f64,
}

/// The nine entries, row by row.
#[must_use]
pub fn row_major(matrix: &Matrix3<f64>) -> [f64; 9] {
    core::array::from_fn(|at| matrix[(at / 3, at % 3)])
}

/// What a robot says at a slot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Sharing {
    /// It takes no part in rounds.
    Apart,
    /// It does not know where it is.
    Nowhere,
    /// This.
    Belief(Shared),
}

/// A slot, and what is said then.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct AtSlot {
    /// The slot.
    pub slot: u64,
    /// When it begins.
    pub stamp: Stamp,
    /// What is said.
    pub sharing: Sharing,
}

/// What the filter carries of it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Bond {
    pub(crate) psi: Square3,
    pub(crate) tie: Tie,
    /// Counted up whenever what is shared becomes unknown.
    life: u32,
}

/// [`Standing`], as far as a moment of the history knows it.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub(crate) enum Tie {
    /// It takes no part: split covariance intersection.
    #[default]
    Apart,
    Joining,
    Since(u64),
}

/// What a robot shares with others, but for Ψ: a correction holds for one alone.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Knot {
    tie: Tie,
    life: u32,
}

/// What a correction is of, and whether it came after its slot had left the history.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Of {
    tie: Tie,
    life: u32,
    pub(crate) is_late: bool,
}

impl Of {
    pub(crate) fn new(Knot { tie, life }: Knot, is_late: bool) -> Self {
        Self { tie, life, is_late }
    }

    pub(crate) fn knot(&self) -> Knot {
        let Self { tie, life, .. } = *self;
        Knot { tie, life }
    }
}

impl Default for Bond {
    fn default() -> Self {
        Self {
            psi: Square3::IDENTITY,
            tie: Tie::Apart,
            life: 0,
        }
    }
}

impl Bond {
    #[inline]
    pub(crate) fn is_apart(&self) -> bool {
        self.tie == Tie::Apart
    }

    pub(crate) fn knot(&self) -> Knot {
        Knot {
            tie: self.tie,
            life: self.life,
        }
    }

    #[inline]
    pub(crate) fn moved(&mut self, map: &Map) {
        self.psi = map.after(&self.psi);
    }

    /// By `left`, I − K H.
    pub(crate) fn learnt(&mut self, left: &Square3) {
        self.psi = times(left, &self.psi);
    }

    /// What it shares with others is not known any more.
    pub(crate) fn untie(&mut self) {
        if !self.is_apart() {
            self.join();
        }
    }

    pub(crate) fn join(&mut self) {
        self.psi = Square3::IDENTITY;
        self.tie = Tie::Joining;
        self.life = self.life.wrapping_add(1);
    }

    pub(crate) fn leave(&mut self) {
        self.tie = Tie::Apart;
        self.psi = Square3::IDENTITY;
    }

    pub(crate) fn corrected(&mut self, slot: u64) {
        self.psi = Square3::IDENTITY;
        self.tie = Tie::Since(slot);
    }

    pub(crate) fn corrected_late(&mut self, slot: u64, since: &Matrix3<f64>) {
        let row = |row: usize| [since[(row, 0)], since[(row, 1)], since[(row, 2)]];
        self.psi = Square3([row(0), row(1), row(2)]);
        self.tie = Tie::Since(slot);
    }

    pub(crate) fn psi_matrix(&self) -> Matrix3<f64> {
        let Square3(rows) = self.psi;
        Matrix3::from_fn(|row, column| rows[row][column])
    }
}

/// What was shared, and of which life it is.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Given {
    pub(crate) stamp: Stamp,
    pub(crate) knot: Knot,
    pub(crate) shared: Shared,
}

/// What was shared at the last slots.
#[derive(Clone, Debug)]
pub(crate) struct Giving {
    given: [Option<Given>; SHARES],
    next: usize,
    /// Of the newest life that was shared: the slot from which on it joins.
    joins: Option<(u32, u64)>,
    lates: Lates,
}

impl Giving {
    pub(crate) fn new() -> Self {
        Self {
            given: [None; SHARES],
            next: 0,
            joins: None,
            lates: Lates::default(),
        }
    }

    pub(crate) fn lates(&self) -> &Lates {
        &self.lates
    }

    pub(crate) fn keep(&mut self, slot: u64, late: Late) {
        self.lates.keep(slot, late);
    }

    /// What was shared at `slot`.
    pub(crate) fn at(&self, slot: u64) -> Option<&Given> {
        let given = self.given.iter().flatten();
        given
            .filter(|it| it.shared.slot == slot)
            .max_by_key(|it| it.stamp)
    }

    fn newest(&self) -> Option<Stamp> {
        self.given.iter().flatten().map(|it| it.stamp).max()
    }

    /// Shares what is believed at `slot`; `None` where it takes no part, or has shared at a later slot.
    pub(crate) fn share(
        &mut self,
        slot: u64,
        stamp: Stamp,
        bond: &Bond,
        belief: &Belief,
    ) -> Option<Shared> {
        if self.newest().is_some_and(|newest| newest >= stamp) {
            return None;
        }
        let standing = match bond.tie {
            Tie::Apart => return None,
            Tie::Since(last) => Standing::Since(last),
            Tie::Joining => {
                let joins = self.joins.filter(|(life, _)| *life == bond.life);
                let (_, from) = *self.joins.insert(joins.unwrap_or((bond.life, slot)));
                Standing::Joining(from)
            }
        };
        let shared = Shared {
            slot,
            pose: belief.pose,
            covariance: belief.total().matrix(),
            psi: bond.psi_matrix(),
            standing,
        };
        if let Some(place) = self.given.get_mut(self.next) {
            *place = Some(Given {
                stamp,
                knot: bond.knot(),
                shared,
            });
        }
        self.next = (self.next + 1) % SHARES;
        Some(shared)
    }
}

fn times(Square3(a): &Square3, b: &Square3) -> Square3 {
    let Square3(rows) = b;
    Square3(a.map(|row| {
        [0, 1, 2].map(|at| row[0] * rows[0][at] + row[1] * rows[1][at] + row[2] * rows[2][at])
    }))
}
