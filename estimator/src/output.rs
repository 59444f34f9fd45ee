//! What a tick hands back: where the robot is, what to tell the others, what became of each measurement.

use crate::assist::refusal::Refusal;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::found::Finding;
use crate::gyro::GyroState;
use crate::kind::{Kind, RobotId, SightingId};
use crate::partial::SplitPosition;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::rounds;
use crate::stamp::Stamp;

/// Where the velocity at the tick's stamp comes from.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum OdometryState {
    /// No sample yet, or none for longer than the hold time: taken as standing still, with outage noise.
    #[default]
    Stale,
    /// The last velocity is held beyond its stamp.
    Held,
    /// A sample reaches up to the tick.
    Fresh,
}

/// The belief at the tick.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The tick's stamp.
    pub stamp: Stamp,
    /// Pose and covariances at `stamp`.
    pub belief: Belief,
    /// `[v_x, v_y, ω]` in the body frame \[m/s, m/s, rad/s\].
    pub velocity: [f64; 3],
    /// Covariance of `velocity`, of its mean over the reference period (see
    /// [`OdometrySettings`](crate::settings::OdometrySettings)) \[m²/s², m·rad/s², rad²/s²\]. Without a sideways velocity
    /// there is no variance of it.
    pub velocity_covariance: Covariance3,
    /// How fresh `velocity` is.
    pub odometry: OdometryState,
    /// What is known of the gyro, if there is one.
    pub gyro: Option<GyroState>,
    /// Pose in the odometry frame: where the wheels alone, their turn fused with the gyro's where there is one, have taken the robot
    /// since its start, which is this frame's origin. No measurement moves it and no doubt shortens it: it jumps only by what a late sample corrects, and drifts without end.
    pub driven: Pose,
}

/// Algorithm 2's result: what to tell the robot that was seen.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct OutgoingPose {
    /// The robot that was seen.
    pub to: RobotId,
    /// Which sensor saw it.
    pub by: u16,
    /// The sighting's stamp.
    pub stamp: Stamp,
    /// y*
    pub pose: Pose,
    /// R* in its parts: the receiver takes [`Parts::total`] for the whole.
    pub parts: Parts,
}

/// What the robot that was seen in part is told.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct OutgoingSeen {
    /// The sighting's stamp.
    pub stamp: Stamp,
    /// The robot that was seen, and in which sighting: what is answered names it.
    pub sighting: SightingId,
    /// Where the robot must be; `None`: that is not known here, it is only asked where it believes to be.
    pub place: Option<SplitPosition>,
}

/// Where this robot believed to be when another one saw it.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct OutgoingAnswer {
    /// The sighting's stamp.
    pub stamp: Stamp,
    /// Who saw it, and which sighting is answered.
    pub sighting: SightingId,
    /// Of the belief before anything of that stamp.
    pub place: SplitPosition,
}

/// What became of a measurement: refused on arrival, or gated when it was first applied.
///
/// A later arrival with an earlier stamp may move the belief under a measurement and so turn its gate's answer
/// around; the belief follows, the verdict is not given twice.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Fused.
    Accepted {
        /// Normalised innovation squared (NIS).
        d2: f64,
    },
    /// The χ² gate refused it; the belief did not change.
    Gated {
        /// Normalised innovation squared.
        d2: f64,
    },
    /// Not fused, and heard: it is not known well enough where the robot is, and this helps to find it ([`crate::found`]).
    Heard,
    /// Older than the history.
    TooOld,
    /// Stamped beyond the future tolerance.
    FromFuture,
    /// Same kind, source, session, stamp and sequence as one that is in the history.
    Duplicate,
    /// An odometry sample that does not end after its start.
    EmptyInterval,
    /// A number in it is none, or of no place or velocity in this world.
    NotFinite,
    /// A variance in it is zero: it claims to know something exactly, or says that it does not know how well.
    NoNoise,
    /// A course over ground while the wheels do not say that the robot moves, or of a robot that can move sideways.
    NotMoving,
    /// An answer to a sighting that is not in the history.
    NotAsked,
    /// Nothing that a robot of this part in its team may be told ([`crate::assist`]).
    Refused(Refusal),
    /// Of a round that this robot does not follow ([`crate::rounds`]).
    NotFollowed(rounds::Refusal),
    /// The history's storage is full of newer entries, or of entries that wait for a later tick.
    NoRoom,
}

/// Which measurement a verdict is about.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Source {
    /// Of which kind.
    pub kind: Kind,
    /// Of which sensor; a neighbour's pose, of which robot.
    pub number: u16,
}

impl Source {
    /// That sensor, or that robot.
    #[must_use]
    pub const fn new(kind: Kind, number: u16) -> Self {
        Self { kind, number }
    }
}

/// A measurement's verdict.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Report {
    /// Whose measurement.
    pub source: Source,
    /// Its stamp.
    pub stamp: Stamp,
    /// What became of it.
    pub verdict: Verdict,
}

/// Result of a tick. The slices live in the estimator until the next step.
#[derive(Copy, Clone, Debug)]
pub struct TickOutputs<'a> {
    /// The belief at the tick's stamp.
    pub estimate: Estimate,
    /// Whether it is known where the robot is, who says otherwise, and what was decided in this tick.
    pub finding: &'a Finding,
    /// Poses to send, each once; in the order of their stamps, ties by robot.
    pub outgoing: &'a [OutgoingPose],
    /// What robots that were seen in part are told, each once; likewise.
    pub seen: &'a [OutgoingSeen],
    /// Answers to robots that saw this one, each once; likewise.
    pub answers: &'a [OutgoingAnswer],
    /// What is shared at a slot of the team's rounds, once it has begun ([`crate::rounds`]).
    pub shared: Option<rounds::AtSlot>,
    /// One report for each measurement that got its verdict in this tick: poses and fixes always,
    /// odometry and sightings only when refused (a sighting's outcome is its outgoing pose).
    pub reports: &'a [Report],
    /// Messages and reports that did not fit into the fixed lists: never silently lost.
    pub overflowed: u32,
    /// Entries folded into the base before their time because the storage was full: from there on late
    /// measurements are refused earlier than the settings say. Not zero: give the estimator more slots.
    pub folded_early: u32,
}
