//! What the history is kept in.

use super::Slot;
use crate::assist::change::Change;
use crate::assist::ties::Tie;
use crate::kind::GyroSample;

/// An estimator's storage, reserved by the caller: it is filled once at start and never grows. An array, a `Vec` or a borrowed slice
/// of [`Slot`]s is one, without room for a gyro; with a gyro it is a [`WithGyro`].
pub trait Storage {
    /// Of measurements.
    type Slots: AsRef<[Slot]> + AsMut<[Slot]>;
    /// Of a gyro.
    type Samples: AsRef<[GyroSample]> + AsMut<[GyroSample]>;
    /// Of what is tracked with leaders, one for each datum.
    type Ties: AsRef<[Tie]> + AsMut<[Tie]>;
    /// Of what became of the robot's own error, one for each slot.
    type Changes: AsRef<[Change]> + AsMut<[Change]>;

    /// All of them.
    fn split(self) -> Parts<Self>
    where
        Self: Sized;
}

/// What a storage consists of.
#[derive(Clone, Debug)]
pub struct Parts<S: Storage> {
    /// Of measurements.
    pub slots: S::Slots,
    /// Of a gyro.
    pub samples: S::Samples,
    /// Of data.
    pub ties: S::Ties,
    /// Of the robot's own error.
    pub changes: S::Changes,
}

impl<S: AsRef<[Slot]> + AsMut<[Slot]>> Storage for S {
    type Slots = Self;
    type Samples = [GyroSample; 0];
    type Ties = [Tie; 0];
    type Changes = [Change; 0];

    fn split(self) -> Parts<Self> {
        Parts {
            slots: self,
            samples: [],
            ties: [],
            changes: [],
        }
    }
}

pub(crate) trait Slots: AsRef<[Slot]> + AsMut<[Slot]> {}
impl<S: AsRef<[Slot]> + AsMut<[Slot]>> Slots for S {}

pub(crate) trait Samples: AsRef<[GyroSample]> + AsMut<[GyroSample]> {}
impl<G: AsRef<[GyroSample]> + AsMut<[GyroSample]>> Samples for G {}

/// Slots, and room for what a gyro says. Of as many samples as are measured within [`Settings::history`](crate::Settings::history)
/// and the tolerance of the future: [`GYRO_SAMPLES`](super::GYRO_SAMPLES) are a second at 1 kHz, five at 200 Hz. A power of two
/// is used of them.
#[derive(Clone, Debug)]
pub struct WithGyro<S, G> {
    /// As without one.
    pub slots: S,
    /// An array, a `Vec` or a borrowed slice; it may be empty where no gyro is.
    pub samples: G,
}

impl<S, G> Storage for WithGyro<S, G>
where
    S: AsRef<[Slot]> + AsMut<[Slot]>,
    G: AsRef<[GyroSample]> + AsMut<[GyroSample]>,
{
    type Slots = S;
    type Samples = G;
    type Ties = [Tie; 0];
    type Changes = [Change; 0];

    fn split(self) -> Parts<Self> {
        Parts {
            slots: self.slots,
            samples: self.samples,
            ties: [],
            changes: [],
        }
    }
}

/// Any of those, and room for what is tracked with leaders ([`crate::assist::ties`]): [`TIES`](crate::assist::ties::TIES) of data, and a
/// change for each slot. With no change nothing is tracked.
#[derive(Clone, Debug)]
pub struct WithBonds<S, T, C> {
    /// As without.
    pub places: S,
    /// An array, a `Vec` or a borrowed slice.
    pub ties: T,
    /// Likewise.
    pub changes: C,
}

impl<S, T, C> Storage for WithBonds<S, T, C>
where
    S: Storage,
    T: AsRef<[Tie]> + AsMut<[Tie]>,
    C: AsRef<[Change]> + AsMut<[Change]>,
{
    type Slots = S::Slots;
    type Samples = S::Samples;
    type Ties = T;
    type Changes = C;

    fn split(self) -> Parts<Self> {
        let Parts { slots, samples, .. } = self.places.split();
        Parts {
            slots,
            samples,
            ties: self.ties,
            changes: self.changes,
        }
    }
}
