//! The three subscribers: drained, validated, and turned into what the estimator computes on.

use coloc_estimator::{
    Covariance2, Covariance3, Measurement, NeighbourPose, Origin, Parts, Pose, PositionFix,
    RobotId, Sighting, Stamp,
};
use coloc_shm_types::{
    Input, Message, Neighbour, PortError, Position, Reject, RelativePose, Sessions, Space,
};

use super::list::List;
use super::port::Port;
use super::team::Team;
use crate::account::Account;
use crate::clock::Moment;
use crate::config::Config;

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const SIGHTINGS: usize = 128;
const FIXES: usize = 32;
const NEIGHBOURS: usize = 256;
/// So many of all kinds.
pub const MOST: usize = SIGHTINGS + FIXES + NEIGHBOURS;

/// The subscribers and what they have received before.
#[derive(Debug)]
pub struct Messages {
    sightings: Port<RelativePose>,
    fixes: Port<Position>,
    neighbours: Port<Neighbour>,
    team: Team,
}

impl Messages {
    /// Subscribes; publishers that are there already are connected before the first tick.
    ///
    /// # Errors
    /// If a port cannot be opened.
    pub fn open(config: &Config, space: &Space) -> Result<Self, PortError> {
        let team = Team::new(config);
        let (name, sensors) = (&config.robot.name, Sessions::SENSORS);
        let robots = team.size();
        Ok(Self {
            sightings: Port::open(space, name, (Input::RelativePose, sensors, SIGHTINGS))?,
            fixes: Port::open(space, name, (Input::Position, sensors, FIXES))?,
            neighbours: Port::open(space, name, (Input::Neighbour, robots, NEIGHBOURS))?,
            team,
        })
    }

    /// The inputs whose channels have no place for this robot.
    pub fn deaf(&self) -> impl Iterator<Item = Input> {
        let inputs = [
            self.sightings.deaf(),
            self.fixes.deaf(),
            self.neighbours.deaf(),
        ];
        inputs.into_iter().flatten()
    }

    /// Says who speaks on the channels.
    pub fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        self.sightings.tell_sessions(now, account);
        self.fixes.tell_sessions(now, account);
        self.neighbours.tell_sessions(now, account);
    }

    /// Takes in what has arrived until `moment`, as far as there is room.
    pub fn receive(
        &mut self,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
    ) {
        let limits = self.team.limits(moment.stamp);
        self.sightings.drain(moment, into, account, |message| {
            message.validate(&limits)?;
            Ok(sighting(message)?.into())
        });
        self.fixes.drain(moment, into, account, |message| {
            message.validate(&limits)?;
            Ok(fix(message)?.into())
        });
        self.neighbours.drain(moment, into, account, |message| {
            message.validate(&limits)?;
            Ok(neighbour(message)?.into())
        });
    }

    /// The tick is over: the next one takes in as many again.
    pub fn clear(&mut self) {
        self.sightings.clear();
        self.fixes.clear();
        self.neighbours.clear();
    }
}

fn stamp(message: &impl Message) -> Stamp {
    Stamp::from_nanos(message.header().stamp_ns)
}

/// The history tells repetitions by it, and orders what has one stamp.
fn origin(message: &impl Message) -> Origin {
    let header = message.header();
    Origin {
        source: header.source,
        session: header.session,
        sequence: header.sequence,
    }
}

fn sighting(message: &RelativePose) -> Result<Sighting, Reject> {
    Ok(Sighting {
        stamp: stamp(message),
        origin: origin(message),
        observed: RobotId(message.observed),
        relative: pose(message.pose),
        covariance: covariance(message.covariance)?,
    })
}

fn fix(message: &Position) -> Result<PositionFix, Reject> {
    Ok(PositionFix {
        stamp: stamp(message),
        origin: origin(message),
        position: message.position,
        covariance: Covariance2::from_row_major(message.covariance).map_err(not_a_covariance)?,
    })
}

fn neighbour(message: &Neighbour) -> Result<NeighbourPose, Reject> {
    let parts = Parts::from_row_major(message.independent, message.dependent);
    let parts = parts.map_err(not_a_covariance)?;
    Ok(NeighbourPose {
        stamp: stamp(message),
        origin: origin(message),
        pose: pose(message.pose),
        total: parts.total(),
        independent: parts.independent,
    })
}

fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose::new(x, y, phi)
}

fn covariance(rows: [f64; 9]) -> Result<Covariance3, Reject> {
    Covariance3::from_row_major(rows).map_err(not_a_covariance)
}

pub(super) fn not_a_covariance(problem: coloc_estimator::NotACovariance) -> Reject {
    use coloc_estimator::NotACovariance as Problem;
    match problem {
        Problem::NotFinite => Reject::NotFinite,
        Problem::Asymmetric => Reject::Asymmetric,
        Problem::NotPositiveSemidefinite => Reject::NotPositiveSemidefinite,
    }
}
