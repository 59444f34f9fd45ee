//! What the history is kept in.

use super::Slot;
use crate::kind::GyroSample;

/// An estimator's storage, reserved by the caller: it is filled once at start and never grows. An array, a `Vec` or a borrowed slice
/// of [`Slot`]s is one, without room for a gyro; with a gyro it is a [`WithGyro`].
pub trait Storage {
    /// Of measurements.
    type Slots: AsRef<[Slot]> + AsMut<[Slot]>;
    /// Of a gyro.
    type Samples: AsRef<[GyroSample]> + AsMut<[GyroSample]>;

    /// Both.
    fn split(self) -> (Self::Slots, Self::Samples);
}

impl<S: AsRef<[Slot]> + AsMut<[Slot]>> Storage for S {
    type Slots = Self;
    type Samples = [GyroSample; 0];

    fn split(self) -> (Self::Slots, Self::Samples) {
        (self, [])
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

    fn split(self) -> (S, G) {
        (self.slots, self.samples)
    }
}
