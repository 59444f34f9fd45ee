//! One measurement in its place, with the filter after it.

use crate::filter::{Filter, State};
use crate::found::Gauge;
use crate::gyro::Bias;
use crate::kind::{Key, Measurement};
use crate::rounds::Bond;
use crate::stamp::Stamp;

/// The filter at a moment of the history.
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
    /// Valid only in the evaluated part of the history, like all that follows.
    after: State,
    samples: usize,
    /// Not even looked at where there is no gyro.
    bias: Bias,
    /// Likewise, where no rounds may be made.
    bond: Bond,
    /// How far it is from the filter before it.
    pub(crate) gauge: Gauge,
    /// Its message or its verdict has gone out: each does so once, whatever is replayed.
    pub(crate) announced: bool,
}

impl Entry {
    pub(crate) fn new(key: Key, measurement: &Measurement) -> Self {
        Self {
            key,
            measurement: *measurement,
            after: State::default(),
            samples: 0,
            bias: Bias::default(),
            bond: Bond::default(),
            gauge: Gauge::default(),
            announced: false,
        }
    }

    /// [`Self::new`] in the place of an old one.
    pub(crate) fn become_new(&mut self, key: Key, measurement: &Measurement) {
        (self.key, self.measurement) = (key, *measurement);
        self.announced = false;
    }

    /// The filter after it; the bias is [`Self::bias`], the bond [`Self::bond`].
    #[inline]
    pub(crate) fn after(&self) -> Checkpoint {
        Checkpoint {
            stamp: self.key.stamp,
            filter: Filter {
                state: self.after,
                bias: None,
                bond: None,
                change: None,
            },
            samples: self.samples,
        }
    }

    /// Of the gyro, where there is one.
    pub(crate) fn bias(&self) -> Bias {
        self.bias
    }

    /// Where rounds may be made.
    pub(crate) fn bond(&self) -> Bond {
        self.bond
    }

    /// It was applied.
    #[inline]
    pub(crate) fn settle(&mut self, after: &Checkpoint, gauge: Gauge) {
        (self.after, self.samples, self.gauge) = (after.filter.state, after.samples, gauge);
        if let Some(bias) = &after.filter.bias {
            self.bias = *bias;
        }
        if let Some(bond) = &after.filter.bond {
            self.bond = *bond;
        }
        self.announced = true;
    }

    pub(crate) fn stamp(&self) -> Stamp {
        self.key.stamp
    }
}
