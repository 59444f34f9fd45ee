//! The four subscribers: drained, validated, and turned into what the estimator computes on.

use coloc_estimator::{
    Covariance2, Covariance3, Measurement, NeighbourPose, NotACovariance, Origin, Parts, Pose,
    PoseSaid, PositionFix, RobotId, Sighting, SlowError, Span, Stamp,
};
use coloc_shm_types::{
    Input, Limits, Message, Neighbour, PortError, Pose as PoseMessage, Position, Reject,
    RelativePose, Sessions, Space,
};

use super::list::List;
use super::port::Port;
use super::team::Team;
use crate::account::Account;
use crate::clock::Moment;
use crate::config::Config;

/// How long a receiver's slow error lasts if the receiver does not say \[s\]: satellites' atmosphere and reflections, minutes.
const SLOW_TIME_S: f64 = 60.0;

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const SIGHTINGS: usize = 128;
const FIXES: usize = 32;
const NEIGHBOURS: usize = 256;
const POSES: usize = 16;
/// So many of all kinds.
pub const MOST: usize = SIGHTINGS + FIXES + NEIGHBOURS + POSES;

/// The subscribers and what they have received before.
#[derive(Debug)]
pub struct Messages {
    sightings: Port<RelativePose>,
    fixes: Port<Position>,
    neighbours: Port<Neighbour>,
    poses: Port<PoseMessage>,
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
            poses: Port::open(space, name, (Input::Pose, sensors, POSES))?,
            team,
        })
    }

    /// The inputs whose channels have no place for this robot.
    pub fn deaf(&self) -> impl Iterator<Item = Input> {
        let inputs = [
            self.sightings.deaf(),
            self.fixes.deaf(),
            self.neighbours.deaf(),
            self.poses.deaf(),
        ];
        inputs.into_iter().flatten()
    }

    /// Says who speaks on the channels.
    pub fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        self.sightings.tell_sessions(now, account);
        self.fixes.tell_sessions(now, account);
        self.neighbours.tell_sessions(now, account);
        self.poses.tell_sessions(now, account);
    }

    /// Takes in what has arrived until `moment`, as far as there is room.
    pub fn receive(
        &mut self,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
    ) {
        let limits = self.team.limits(moment.stamp);
        self.sightings
            .drain(moment, into, account, |it| sighting(it, &limits));
        self.fixes
            .drain(moment, into, account, |it| fix(it, &limits));
        self.neighbours
            .drain(moment, into, account, |it| neighbour(it, &limits));
        self.poses
            .drain(moment, into, account, |it| said(it, &limits));
    }

    /// The tick is over: the next one takes in as many again.
    pub fn clear(&mut self) {
        self.sightings.clear();
        self.fixes.clear();
        self.neighbours.clear();
        self.poses.clear();
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

/// A sighting as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn sighting(message: &RelativePose, limits: &Limits<'_>) -> Result<Measurement, Reject> {
    let covariance = Covariance3::from_row_major(message.covariance);
    let beside = message.validate_beside_covariance(limits);
    let covariance = first(beside, covariance, || message.validate(limits))?;
    Ok(Measurement::Sighting(Sighting {
        stamp: stamp(message),
        origin: origin(message),
        observed: RobotId(message.observed),
        relative: pose(message.pose),
        covariance,
    }))
}

/// What the estimator makes of a message's covariance, unless there is a reason to refuse the message: then the first of
/// them. The estimator's check of a covariance is the one that decides; the message's own is asked only for that order.
fn first<C>(
    beside: Result<(), Reject>,
    covariance: Result<C, NotACovariance>,
    all: impl FnOnce() -> Result<(), Reject>,
) -> Result<C, Reject> {
    match (beside, covariance) {
        (Ok(()), Ok(covariance)) => Ok(covariance),
        (Ok(()), Err(problem)) => all().and(Err(not_a_covariance(problem))),
        (Err(reason), _) => all().and(Err(reason)),
    }
}

/// A fix as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn fix(message: &Position, limits: &Limits<'_>) -> Result<Measurement, Reject> {
    let covariance = Covariance2::from_row_major(message.covariance);
    let beside = message.validate_beside_covariance(limits);
    let covariance = first(beside, covariance, || message.validate(limits))?;
    Ok(Measurement::Fix(PositionFix {
        stamp: stamp(message),
        origin: origin(message),
        position: message.position,
        covariance,
        slow: slow(message),
    }))
}

/// One that lasts for no time that is known lasts for [`SLOW_TIME_S`].
fn slow(message: &Position) -> SlowError {
    let memory_s = if message.slow_time_s > 0.0 {
        message.slow_time_s
    } else {
        SLOW_TIME_S
    };
    SlowError {
        variance: message.slow_sigma_m * message.slow_sigma_m,
        memory: Span::from_seconds(memory_s),
    }
}

/// A neighbour's pose as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn neighbour(message: &Neighbour, limits: &Limits<'_>) -> Result<Measurement, Reject> {
    let parts = Parts::from_row_major(message.independent, message.dependent);
    let beside = message.validate_beside_covariances(limits);
    let parts = first(beside, parts, || message.validate(limits))?;
    Ok(Measurement::Neighbour(NeighbourPose {
        stamp: stamp(message),
        origin: origin(message),
        pose: pose(message.pose),
        parts,
    }))
}

/// A person's or a map's pose as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn said(message: &PoseMessage, limits: &Limits<'_>) -> Result<Measurement, Reject> {
    let covariance = Covariance3::from_row_major(message.covariance);
    let beside = message.validate_beside_covariance(limits);
    let covariance = first(beside, covariance, || message.validate(limits))?;
    Ok(Measurement::Pose(PoseSaid {
        stamp: stamp(message),
        origin: origin(message),
        pose: pose(message.pose),
        covariance,
        set: message.set == PoseMessage::SET,
    }))
}

fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose::new(x, y, phi)
}

pub(super) fn not_a_covariance(problem: NotACovariance) -> Reject {
    match problem {
        NotACovariance::NotFinite => Reject::NotFinite,
        NotACovariance::Asymmetric => Reject::Asymmetric,
        NotACovariance::NotPositiveSemidefinite => Reject::NotPositiveSemidefinite,
    }
}
