//! What can be known of a neighbour at all, by what is seen and how both move.
//!
//! [`lie`] is of a moment: the gradients of what is seen and of its derivatives along the motions that there are. [`gramian`] is of a
//! drive: how much is known of where the neighbour was at its start.

mod lie;
mod polynomial;

pub use lie::{Input, Output, lie};

use nalgebra::{Matrix3, RowVector3, Vector3};

use crate::increment::Increment;
use crate::plane::{azimuth_slope, sight};
use crate::state::{Core, State};

/// A direction counts as seen if this part of what is best seen is seen of it.
const SEEN: f64 = 1e-9;

/// `OᵀO` of all gradients, and how many directions of `[x, y, φ]` are seen.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Observability {
    /// `OᵀO`
    pub gram: Matrix3<f64>,
    /// Three: all.
    pub rank: usize,
}

/// What a sensor sees, for [`gramian`].
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Sees {
    /// Both.
    RangeBearing,
    /// The bearing alone.
    Bearing,
    /// The range alone.
    Range,
    /// Both, and the neighbour sees the observer.
    Reciprocal,
}

/// A drive at constant velocities.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Drive {
    /// `[x, y, φ]` of the neighbour at its start.
    pub start: [f64; 3],
    /// `[v_x, v_y, ω]` of the observer.
    pub observer: [f64; 3],
    /// Of the neighbour.
    pub seen: [f64; 3],
    /// How many legs.
    pub legs: usize,
    /// Of a leg \[s\].
    pub seconds: f64,
    /// A measurement follows every so many legs.
    pub every: usize,
    /// Of a range and of a bearing \[m², rad²\].
    pub variances: [f64; 2],
}

/// What a drive tells of its start.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Gramian {
    /// `Σ Φᵀ Hᵀ R⁻¹ H Φ`
    pub information: Matrix3<f64>,
    /// `[x, y, φ]` at the end.
    pub end: [f64; 3],
    /// Directions seen, the heading in metres at the neighbour's first range.
    pub rank: usize,
    /// Of the information, so scaled; `None` if the rank is not three.
    pub log10_condition: Option<f64>,
    /// To what the heading is known \[rad\]; `None` if the rank is not three.
    pub heading_sigma: Option<f64>,
}

/// What is known after `drive` of where the neighbour was at its start, without noise of the motion.
#[must_use]
pub fn gramian(sees: Sees, drive: &Drive) -> Gramian {
    let mut state = State {
        core: Core::Heading,
        ..State::default()
    };
    state
        .mean
        .fixed_rows_mut::<3>(0)
        .copy_from(&Vector3::from(drive.start));
    let [observer, seen] = [drive.observer, drive.seen].map(|velocity| Increment {
        displacement: Vector3::from(velocity) * drive.seconds,
        covariance: Matrix3::zeros(),
    });
    let (mut information, mut map) = (Matrix3::zeros(), Matrix3::identity());
    for leg in 1..=drive.legs {
        map = state.slope(&observer, &seen) * map;
        state.predict(&observer, &seen, core::iter::empty(), 0.0);
        if leg % drive.every.max(1) == 0 {
            information += map.transpose() * seen_of(sees, &state, drive.variances) * map;
        }
    }
    let range = libm::hypot(drive.start[0], drive.start[1]);
    let scale = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0 / range));
    let values = (scale * information * scale).symmetric_eigenvalues();
    let rank = rank(&values);
    Gramian {
        information,
        end: [state.mean[0], state.mean[1], state.mean[2]],
        rank,
        log10_condition: (rank == 3).then(|| libm::log10(values.max() / values.min())),
        heading_sigma: information
            .try_inverse()
            .filter(|_| rank == 3)
            .map(|it| libm::sqrt(it.m33)),
    }
}

/// `Hᵀ R⁻¹ H`
fn seen_of(sees: Sees, state: &State, [range, bearing]: [f64; 2]) -> Matrix3<f64> {
    let position = state.position();
    let square = |row: RowVector3<f64>, variance: f64| row.transpose() * row / variance;
    let across = azimuth_slope(position);
    let along = position / position.norm();
    let by_range = square(RowVector3::new(along.x, along.y, 0.0), range);
    let by_bearing = square(RowVector3::new(across.x, across.y, 0.0), bearing);
    match sees {
        Sees::RangeBearing => by_range + by_bearing,
        Sees::Bearing => by_bearing,
        Sees::Range => by_range,
        Sees::Reciprocal => {
            let row = RowVector3::new(across.x, across.y, -1.0);
            by_range + by_bearing + square(row, bearing)
        }
    }
}

/// How many of `values` are seen.
fn rank(values: &Vector3<f64>) -> usize {
    let least = SEEN * values.max();
    values.iter().filter(|it| **it > least).count()
}

impl State {
    /// How `[x, y, φ]` after a motion moves with that before it.
    fn slope(&self, observer: &Increment, seen: &Increment) -> Matrix3<f64> {
        let back = sight(observer.turn());
        let way = crate::plane::turn(self.mean[2]) * seen.translation();
        let mut map = Matrix3::identity();
        map.fixed_view_mut::<2, 2>(0, 0).copy_from(&back);
        map.fixed_view_mut::<2, 1>(0, 2)
            .copy_from(&(back * crate::plane::J * way));
        map
    }
}
