//! One measurement in its place, with the filter after it.

use crate::filter::Filter;
use crate::found::Gauge;
use crate::kind::{Key, Measurement};
use crate::stamp::Stamp;

/// The filter after an entry of the history.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Checkpoint {
    pub(crate) stamp: Stamp,
    pub(crate) filter: Filter,
    /// How many odometry samples lie before it, of all that the history ever held: where the next one is found.
    pub(crate) samples: usize,
}

/// A measurement, the filter after it, and whether the world has heard of it.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) key: Key,
    pub(crate) measurement: Measurement,
    /// Valid only in the evaluated part of the history.
    pub(crate) after: Checkpoint,
    /// How far it is from the filter before it; valid where `after` is.
    pub(crate) gauge: Gauge,
    /// Its message or its verdict has gone out: each does so once, whatever is replayed.
    pub(crate) announced: bool,
}

impl Entry {
    pub(crate) fn new(key: Key, measurement: &Measurement) -> Self {
        Self {
            key,
            measurement: *measurement,
            after: Checkpoint::default(),
            gauge: Gauge::default(),
            announced: false,
        }
    }

    /// [`Self::new`] in the place of an old one.
    pub(crate) fn become_new(&mut self, key: Key, measurement: &Measurement) {
        (self.key, self.measurement) = (key, *measurement);
        self.announced = false;
    }

    pub(crate) fn stamp(&self) -> Stamp {
        self.key.stamp
    }
}
