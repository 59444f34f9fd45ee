//! The subscribers: drained, validated, and turned into what the estimator computes on.

use coloc_estimator::assist::assistant::Words;
use coloc_estimator::{
    Covariance2, Covariance3, GyroSample, HeadingFix, Measurement, NeighbourPose, NotACovariance,
    Origin, Parts, Pose, PoseSaid, PositionFix, RobotId, Sighting, Span, Stamp, TrackPose,
};
use coloc_shm_types::{
    Gyro, Heading, Input, Limits, Message, Neighbour, Opinion, PortError, Pose as PoseMessage,
    Position, Reject, RelativePose, Sessions, Space,
};

use super::assist::Assists;
use super::list::List;
use super::opinion::Opinions;
use super::parts::{self, Landmarks, Parts as PartPorts};
use super::port::Port;
use super::rounds::{self, Rounds};
use super::sensors::Sensors;
use super::team::Team;
use crate::account::Account;
use crate::clock::Moment;
use crate::config::{self, Action, Config, GyroSource};

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const SIGHTINGS: usize = 128;
const FIXES: usize = 32;
const NEIGHBOURS: usize = 256;
const POSES: usize = 16;
const HEADINGS: usize = 64;
/// A second of 200 Hz: after a stall they come at once.
const TURNS: usize = 200;
/// So many of all kinds.
pub const MOST: usize =
    SIGHTINGS + FIXES + NEIGHBOURS + POSES + HEADINGS + TURNS + parts::MOST + rounds::MOST;

/// The subscribers and what they have received before.
#[derive(Debug)]
pub struct Messages {
    sightings: Port<RelativePose>,
    fixes: Port<Position>,
    neighbours: Port<Neighbour>,
    poses: Port<PoseMessage>,
    headings: Port<Heading>,
    sensors: Sensors,
    /// Whether tracks' poses are heard beside sensors'.
    hears_tracks: bool,
    /// Where a gyro is heard there.
    turns: Option<Port<Gyro>>,
    /// Where what is seen in part is heard.
    parts: Option<PartPorts>,
    /// Where leaders carry children.
    assists: Option<Assists>,
    /// Where the team makes rounds.
    rounds: Option<Rounds>,
    /// Where a second opinion is heard.
    opinions: Option<Opinions>,
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
        let history = Span::from_nanos(config::nanos(config.history.length_s));
        Ok(Self {
            sightings: Port::open(space, name, (Input::RelativePose, sensors, SIGHTINGS))?,
            fixes: Port::open(space, name, (Input::Position, sensors, FIXES))?,
            neighbours: Port::open(space, name, (Input::Neighbour, robots, NEIGHBOURS))?,
            poses: Port::open(space, name, (Input::Pose, sensors, POSES))?.within(history),
            headings: Port::open(space, name, (Input::Heading, sensors, HEADINGS))?.within(history),
            sensors: Sensors::of(config),
            hears_tracks: config.sighting.through_track,
            turns: (config.gyro.source == GyroSource::Channel)
                .then(|| Port::open(space, name, (Input::Gyro, sensors, TURNS)))
                .transpose()?,
            parts: config
                .sighting
                .heard
                .then(|| {
                    let landmarks = Landmarks::of(&config.landmark);
                    PartPorts::open(
                        space,
                        name,
                        robots,
                        (landmarks, config.sighting.through_track),
                    )
                })
                .transpose()?,
            assists: config
                .assist
                .is_on()
                .then(|| Assists::open(space, name, robots, &config.assist, config.robot.id))
                .transpose()?,
            rounds: config
                .makes_rounds()
                .then(|| Rounds::open(space, name, &config.rounds))
                .transpose()?,
            opinions: (config.integrity.action == Action::Health)
                .then(|| Opinions::open(space, name))
                .transpose()?,
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
            self.headings.deaf(),
            self.turns.as_ref().and_then(Port::deaf),
        ];
        let parts = self.parts.iter().flat_map(PartPorts::deaf);
        let assists = self.assists.iter().flat_map(Assists::deaf);
        let rounds = self.rounds.iter().filter_map(Rounds::deaf);
        let opinions = self.opinions.iter().filter_map(Opinions::deaf);
        inputs
            .into_iter()
            .flatten()
            .chain(parts)
            .chain(assists)
            .chain(rounds)
            .chain(opinions)
    }

    /// Says who speaks on the channels.
    pub fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        self.sightings.tell_sessions(now, account);
        self.fixes.tell_sessions(now, account);
        self.neighbours.tell_sessions(now, account);
        self.poses.tell_sessions(now, account);
        self.headings.tell_sessions(now, account);
        if let Some(turns) = &self.turns {
            turns.tell_sessions(now, account);
        }
        if let Some(parts) = &self.parts {
            parts.tell_sessions(now, account);
        }
        if let Some(assists) = &self.assists {
            assists.tell_sessions(now, account);
        }
        if let Some(rounds) = &self.rounds {
            rounds.tell_sessions(now, account);
        }
        if let Some(opinions) = &self.opinions {
            opinions.tell_sessions(now, account);
        }
    }

    /// Takes in what has arrived until `moment`, as far as there is room.
    pub fn receive(
        &mut self,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
    ) {
        let limits = self.team.limits(moment.stamp);
        let (sensors, hears_tracks) = (&self.sensors, self.hears_tracks);
        self.sightings.drain(moment, into, account, |it| {
            if hears_tracks && it.is_of_track() {
                return tracked(it, &limits);
            }
            let seen = sighting(it, &limits)?;
            Ok(sensors.of_body(&seen).into())
        });
        self.headings
            .drain_seldom(moment, into, account, |it| heading(it, &limits, sensors));
        self.fixes
            .drain(moment, into, account, |it| fix(it, &limits, sensors));
        self.neighbours
            .drain(moment, into, account, |it| neighbour(it, &limits));
        self.poses
            .drain_seldom(moment, into, account, |it| said(it, &limits));
        if let Some(turns) = &mut self.turns {
            turns.drain(moment, into, account, |it| turn(it, &limits, sensors));
        }
        if let Some(parts) = &mut self.parts {
            parts.receive(moment, (&limits, sensors), into, account);
        }
        if let Some(assists) = &mut self.assists {
            assists.receive(moment, &limits, account);
        }
        if let Some(rounds) = &mut self.rounds {
            rounds.receive(moment, &limits, into, account);
        }
        if let Some(opinions) = &mut self.opinions {
            opinions.receive(moment, &limits, account);
        }
    }

    /// The tick is over: the next one takes in as many again.
    pub fn clear(&mut self) {
        self.sightings.clear();
        self.fixes.clear();
        self.neighbours.clear();
        self.poses.clear();
        self.headings.clear();
        if let Some(turns) = &mut self.turns {
            turns.clear();
        }
        if let Some(parts) = &mut self.parts {
            parts.clear();
        }
        if let Some(assists) = &mut self.assists {
            assists.clear();
        }
        if let Some(rounds) = &mut self.rounds {
            rounds.clear();
        }
        if let Some(opinions) = &mut self.opinions {
            opinions.clear();
        }
    }

    /// What `coloc-bounds` said last, where it is asked.
    pub(super) fn opinion(&self) -> Opinion {
        self.opinions
            .as_ref()
            .map_or(Opinion::None, Opinions::newest)
    }

    /// The slot of the team's rounds that has begun, if it makes any; the wheels have `reached` this stamp.
    pub(super) fn slot(
        &mut self,
        now: Stamp,
        ahead: impl FnOnce() -> Span,
        reached: Stamp,
        into: &mut List<Measurement>,
    ) {
        if let Some(rounds) = &mut self.rounds {
            rounds.begin(now, ahead(), reached, into);
        }
    }

    /// Puts in order what leaders say and children answer.
    pub(super) fn gather(&mut self) {
        if let Some(assists) = &mut self.assists {
            assists.gather();
        }
    }

    /// What leaders say and children answer, if that is heard.
    pub(super) fn words(&self, ahead: impl FnOnce() -> Span) -> Words<'_> {
        match &self.assists {
            None => Words::default(),
            Some(assists) => Words {
                ahead: ahead(),
                data: assists.data(),
                acks: assists.acks(),
                readings: assists.readings(),
            },
        }
    }
}

pub(super) fn stamp(message: &impl Message) -> Stamp {
    Stamp::from_nanos(message.header().stamp_ns)
}

/// The history tells repetitions by it, and orders what has one stamp.
pub(super) fn origin(message: &impl Message) -> Origin {
    let header = message.header();
    Origin {
        source: header.source,
        session: header.session,
        sequence: header.sequence,
    }
}

/// A sighting as it was seen from the sensor, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn sighting(message: &RelativePose, limits: &Limits<'_>) -> Result<Sighting, Reject> {
    let covariance = Covariance3::from_row_major(message.covariance);
    let beside = message.validate_beside_covariance(limits);
    let covariance = first(beside, covariance, || message.validate(limits))?;
    Ok(Sighting {
        stamp: stamp(message),
        origin: origin(message),
        observed: RobotId(message.observed),
        relative: pose(message.pose),
        covariance,
    })
}

/// A track's pose as the estimator takes it, in the body frame, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn tracked(message: &RelativePose, limits: &Limits<'_>) -> Result<Measurement, Reject> {
    message.validate_of_track(limits)?;
    Ok(Measurement::Track(TrackPose(Sighting {
        stamp: stamp(message),
        origin: origin(message),
        observed: RobotId(message.observed),
        relative: pose(message.pose),
        covariance: Covariance3::from_row_major(message.covariance).map_err(not_a_covariance)?,
    })))
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
pub fn fix(
    message: &Position,
    limits: &Limits<'_>,
    sensors: &Sensors,
) -> Result<Measurement, Reject> {
    let covariance = Covariance2::from_row_major(message.covariance);
    let beside = message.validate_beside_covariance(limits);
    let covariance = first(beside, covariance, || message.validate(limits))?;
    Ok(Measurement::Fix(PositionFix {
        stamp: stamp(message) - sensors.delay_of(message),
        origin: origin(message),
        position: message.position,
        covariance,
        lever: sensors.lever_of(message),
        slow: sensors.slow_of_fix(message),
    }))
}

/// A heading as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn heading(
    message: &Heading,
    limits: &Limits<'_>,
    sensors: &Sensors,
) -> Result<Measurement, Reject> {
    message.validate(limits)?;
    let (heading_rad, of) = sensors.looking(message);
    Ok(Measurement::Heading(HeadingFix {
        stamp: stamp(message),
        origin: origin(message),
        heading_rad,
        variance: message.variance,
        slow: sensors.slow_of_heading(message),
        of,
    }))
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

/// A yaw rate as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn turn(message: &Gyro, limits: &Limits<'_>, sensors: &Sensors) -> Result<Measurement, Reject> {
    message.validate(limits)?;
    Ok(Measurement::Gyro(GyroSample {
        stamp: stamp(message),
        origin: origin(message),
        rate_radps: sensors.turning(message.rate_radps),
        noise: message.noise,
    }))
}

pub(super) fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose::new(x, y, phi)
}

pub(super) fn not_a_covariance(problem: NotACovariance) -> Reject {
    match problem {
        NotACovariance::NotFinite => Reject::NotFinite,
        NotACovariance::Asymmetric => Reject::Asymmetric,
        NotACovariance::NotPositiveSemidefinite => Reject::NotPositiveSemidefinite,
    }
}
