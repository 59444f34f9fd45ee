//! One measurement in its place, with the belief after it.

use crate::belief::Belief;
use crate::input::{NeighbourPose, OdometrySample, PositionFix, RobotId, Sighting};
use crate::output::Source;
use crate::pace::Pace;
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
    /// Of the neighbours' poses up to here.
    pub(crate) pace: Pace,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::{Covariance2, Covariance3};
    use crate::motion::Motion;
    use crate::pose::Pose;

    fn odometry(start: i64, stamp: i64) -> Key {
        let motion = Motion::standstill([0.0; 3]);
        let [start, stamp] = [start, stamp].map(Stamp::from_nanos);
        Measurement::Odometry(OdometrySample {
            start,
            stamp,
            motion,
        })
        .key()
    }

    fn sighting(stamp: i64, observed: u16, sequence: u64) -> Key {
        Measurement::Sighting(Sighting {
            stamp: Stamp::from_nanos(stamp),
            sequence,
            observed: RobotId(observed),
            relative: Pose::default(),
            covariance: Covariance3::ZERO,
        })
        .key()
    }

    fn neighbour(stamp: i64, sender: u16, sequence: u64) -> Key {
        Measurement::Neighbour(NeighbourPose {
            stamp: Stamp::from_nanos(stamp),
            sequence,
            sender: RobotId(sender),
            pose: Pose::default(),
            total: Covariance3::ZERO,
            independent: Covariance3::ZERO,
        })
        .key()
    }

    fn fix(stamp: i64, sequence: u64) -> Key {
        let (stamp, position) = (Stamp::from_nanos(stamp), [0.0; 2]);
        Measurement::Fix(PositionFix {
            stamp,
            sequence,
            position,
            covariance: Covariance2::ZERO,
        })
        .key()
    }

    #[test]
    fn an_event_is_in_the_order_of_algorithm_4() {
        let ordered = [
            fix(1, 9),
            odometry(0, 2),
            odometry(1, 2),
            sighting(2, 4, 8),
            sighting(2, 5, 7),
            neighbour(2, 3, 7),
            neighbour(2, 3, 8),
            neighbour(2, 4, 1),
            fix(2, 0),
            fix(2, 1),
            odometry(0, 3),
        ];
        assert!(ordered.is_sorted_by(|a, b| a < b));
    }
}
