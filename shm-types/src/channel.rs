//! The services: which payload travels under which name, and with which quality.
use core::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;

use crate::{Estimate, Neighbour, Position, RelativePose, Status};

/// A service of a robot: `coloc/<robot>/<channel>`.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Sightings, laser driver → colocd.
    RelativePose,
    /// Fixes, satellite receiver's driver → colocd.
    Position,
    /// What neighbours say, other robots' colocd → colocd.
    Neighbour,
    /// The belief, colocd → anyone.
    Estimate,
    /// The counters, colocd → anyone.
    Status,
}

/// How a service is dimensioned. All of them overflow: the newest message pushes out the oldest, nobody ever waits.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Quality {
    /// Publishers at once, those that were killed and not yet reaped included.
    pub publishers: usize,
    /// Subscribers at once, likewise.
    pub subscribers: usize,
    /// Messages of one publisher that wait for one subscriber.
    pub buffer: usize,
    /// Messages that a subscriber gets which joins later.
    pub history: usize,
}

impl Channel {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::RelativePose,
        Self::Position,
        Self::Neighbour,
        Self::Estimate,
        Self::Status,
    ];

    /// The last part of the service's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::RelativePose => "relative_pose",
            Self::Position => "position",
            Self::Neighbour => "neighbour",
            Self::Estimate => "estimate",
            Self::Status => "status",
        }
    }

    /// The table of qualities: the only place that states them, for every language.
    ///
    /// Whoever opens a service first fixes its quality, so a change here is seen once all processes have restarted.
    #[must_use]
    pub const fn quality(self) -> Quality {
        // (publishers, subscribers, buffer, history)
        let (publishers, subscribers, buffer, history) = match self {
            // A robot sees many others in one turn of its laser; a few drivers, a daemon and those who listen in.
            Self::RelativePose => (8, 16, 64, 0),
            Self::Position => (8, 16, 16, 0),
            // 64 neighbours, and as many zombies of theirs.
            Self::Neighbour => (128, 16, 16, 0),
            // One daemon and the zombies of its restarts; anyone may look, the last one is kept for late joiners.
            Self::Estimate => (8, 32, 16, 1),
            Self::Status => (8, 32, 4, 1),
        };
        Quality {
            publishers,
            subscribers,
            buffer,
            history,
        }
    }
}

/// A payload, which knows its channel.
pub trait Message: ZeroCopySend + Debug + Copy + 'static {
    /// The channel on which it travels.
    const CHANNEL: Channel;
}

impl Message for RelativePose {
    const CHANNEL: Channel = Channel::RelativePose;
}

impl Message for Position {
    const CHANNEL: Channel = Channel::Position;
}

impl Message for Neighbour {
    const CHANNEL: Channel = Channel::Neighbour;
}

impl Message for Estimate {
    const CHANNEL: Channel = Channel::Estimate;
}

impl Message for Status {
    const CHANNEL: Channel = Channel::Status;
}
