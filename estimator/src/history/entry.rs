//! One measurement in its place, with the belief after it.

use crate::belief::Belief;
use crate::input::{NeighbourPose, OdometrySample, PositionFix, RobotId, Sighting};
use crate::output::Source;
use crate::stamp::Stamp;

/// Any measurement.
#[derive(Copy, Clone, Debug)]
pub(crate) enum Measurement {
    Odometry(OdometrySample),
    Sighting(Sighting),
    Neighbour(NeighbourPose),
    Fix(PositionFix),
}

/// A measurement's place in the history. Two measurements with one key are one, delivered twice.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key {
    stamp: Stamp,
    rank: Rank,
}

/// The order within an event, Algorithm 4's: kinds as declared here, then sender, then sequence.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    Odometry { start: Stamp },
    Sighting { observed: RobotId, sequence: u64 },
    Neighbour { sender: RobotId, sequence: u64 },
    Fix { sequence: u64 },
}

impl Measurement {
    pub(crate) fn stamp(&self) -> Stamp {
        match self {
            Self::Odometry(sample) => sample.stamp,
            Self::Sighting(sighting) => sighting.stamp,
            Self::Neighbour(neighbour) => neighbour.stamp,
            Self::Fix(fix) => fix.stamp,
        }
    }

    pub(crate) fn key(&self) -> Key {
        Key {
            stamp: self.stamp(),
            rank: self.rank(),
        }
    }

    fn rank(&self) -> Rank {
        match *self {
            Self::Odometry(OdometrySample { start, .. }) => Rank::Odometry { start },
            Self::Sighting(Sighting {
                observed, sequence, ..
            }) => Rank::Sighting { observed, sequence },
            Self::Neighbour(NeighbourPose {
                sender, sequence, ..
            }) => Rank::Neighbour { sender, sequence },
            Self::Fix(PositionFix { sequence, .. }) => Rank::Fix { sequence },
        }
    }

    pub(crate) fn source(&self) -> Source {
        match self {
            Self::Odometry(_) => Source::Odometry,
            Self::Sighting(sighting) => Source::Sighting(sighting.observed),
            Self::Neighbour(neighbour) => Source::Neighbour(neighbour.sender),
            Self::Fix(_) => Source::Fix,
        }
    }

    pub(crate) fn as_odometry(&self) -> Option<&OdometrySample> {
        match self {
            Self::Odometry(sample) => Some(sample),
            _ => None,
        }
    }
}

/// The belief after an entry of the history.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Checkpoint {
    pub(crate) stamp: Stamp,
    /// As Algorithm 3 left it: its `P_i` still stands for the neighbours' poses yet to come in this event.
    pub(crate) belief: Belief,
    /// Poses were exchanged in this event: `P_i := 0` once no neighbour's pose can follow (Algorithm 4, line 19).
    pub(crate) exchanged: bool,
}

impl Checkpoint {
    /// The belief once no neighbour's pose can follow at this stamp.
    pub(crate) fn settled(&self) -> Belief {
        let mut belief = self.belief;
        if self.exchanged {
            belief.make_dependent();
        }
        belief
    }
}

/// A measurement, the belief after it, and whether the world has heard of it.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) measurement: Measurement,
    /// Valid only in the evaluated part of the history.
    pub(crate) after: Checkpoint,
    /// Its message or its verdict has gone out: each does so once, whatever is replayed.
    pub(crate) announced: bool,
}

impl Entry {
    pub(crate) fn new(measurement: Measurement) -> Self {
        Self {
            measurement,
            after: Checkpoint::default(),
            announced: false,
        }
    }

    pub(crate) fn stamp(&self) -> Stamp {
        self.measurement.stamp()
    }

    pub(crate) fn key(&self) -> Key {
        self.measurement.key()
    }
}
