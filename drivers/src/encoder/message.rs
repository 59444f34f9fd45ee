//! A message of the wheels, as the decoder knows it.

use crate::can::{Id, Received};

use super::guard::Guard;
use super::said::Carried;

/// A message that carries signals of ours.
#[derive(Clone, Debug)]
pub(super) struct Message {
    pub(super) bus: u8,
    pub(super) id: Id,
    pub(super) guard: Guard,
    /// How often it is expected \[µs\].
    pub(super) period_us: u64,
    pub(super) signals: Vec<Carried>,
    pub(super) last_ns: Option<i64>,
    /// Frames that have come.
    pub(super) heard: u64,
}

impl Message {
    pub(super) fn carries(&self, received: &Received) -> bool {
        self.bus == received.bus && received.frame.id() == Some(self.id)
    }
}
