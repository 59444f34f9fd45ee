//! The kinds of measurements: one list of them, and what each is to the history.
//!
//! A kind is a file in this folder: its data, its place in the order, its check on arrival, how it acts on the belief and
//! what is reported of it. Its line in the list below is the only other thing that it takes.

mod answer;
mod ask;
mod assist;
mod fix;
mod gyro;
mod heading;
mod landmark;
mod neighbour;
mod odometry;
mod partial;
mod pose;
mod round;
mod seen;
mod sighting;
mod track;

pub use answer::Answer;
pub use ask::Ask;
pub use assist::LeaderPose;
pub use fix::{PositionFix, SlowError};
pub use gyro::GyroSample;
pub use heading::{HeadingFix, HeadingOf};
pub use landmark::LandmarkSighting;
pub use neighbour::NeighbourPose;
pub use odometry::OdometrySample;
pub use partial::{PartialSighting, SightingId};
pub use pose::PoseSaid;
pub use round::{Deed, RoundWord};
pub use seen::SeenPart;
pub use sighting::Sighting;
pub use track::TrackPose;

use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// No robot is farther away and none is faster \[m, rad, per s\]; the squares of what is could not be computed with.
const FARTHEST: f64 = 1e12;

/// The number that a robot has in its team's configuration.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RobotId(pub u16);

/// Who said it, and which of its words it is.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Origin {
    /// Which of the robot's sensors of this kind; of a neighbour's pose the sender's number in the team.
    pub source: u16,
    /// Which life of the source; zero where there is only one.
    pub session: u64,
    /// The source's count within the session; breaks ties and tells a repetition.
    pub sequence: u64,
}

/// A measurement's place in the history. Two measurements with one key are one, delivered twice.
///
/// The kind's rank and the source come before the session: no random number decides a tie.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key {
    pub(crate) stamp: Stamp,
    kind: Kind,
    /// Who said it; of a sighting first who was seen, so that poses go out in the order of the robots.
    source: u32,
    session: u64,
    sequence: u64,
}

/// What the history asks of a measurement of any kind.
pub(crate) trait Measured {
    /// Its place in the history.
    fn key(&self) -> Key;

    /// Which sensor or robot, for reports.
    fn source(&self) -> Source;

    /// The latest moment whose belief does not depend on it.
    fn begins(&self) -> Stamp {
        self.key().stamp
    }

    /// Whether it can be used at all.
    fn check(&self) -> Result<(), Verdict>;

    /// With no variance below its kind's floor.
    #[must_use]
    fn with_floor(&self, floors: &Floors) -> Self;

    /// Makes of the filter before it, at the same stamp, the one after it. What the world is to hear goes to `world`, if
    /// given. How far it was from the filter's belief, if it says where the robot is.
    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge;
}

/// The list: [`Kind`], [`Measurement`] and what is the same for all of them.
macro_rules! kinds {
    ($($(#[$text:meta])* $kind:ident($data:ty),)*) => {
        /// What was measured. The order within an event is Algorithm 4's, in which they are declared.
        #[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Kind {
            $($(#[$text])* $kind,)*
        }

        /// A measurement of any kind.
        #[derive(Copy, Clone, Debug, PartialEq)]
        pub enum Measurement {
            $($(#[$text])* $kind($data),)*
        }

        impl Kind {
            /// All of them, in their order.
            pub const ALL: &[Self] = &[$(Self::$kind,)*];
        }

        $(impl From<$data> for Measurement {
            fn from(measured: $data) -> Self {
                Self::$kind(measured)
            }
        })*

        impl Measured for Measurement {
            #[inline]
            fn key(&self) -> Key {
                match self { $(Self::$kind(measured) => measured.key(),)* }
            }

            fn source(&self) -> Source {
                match self { $(Self::$kind(measured) => measured.source(),)* }
            }

            #[inline]
            fn begins(&self) -> Stamp {
                match self { $(Self::$kind(measured) => measured.begins(),)* }
            }

            #[inline]
            fn check(&self) -> Result<(), Verdict> {
                match self { $(Self::$kind(measured) => measured.check(),)* }
            }

            fn with_floor(&self, floors: &Floors) -> Self {
                match self { $(Self::$kind(measured) => Self::$kind(measured.with_floor(floors)),)* }
            }

            #[inline]
            fn apply(
                &self,
                filter: &mut Filter,
                terms: &Terms<'_>,
                world: Option<&mut Outbox>,
            ) -> Gauge {
                match self { $(Self::$kind(measured) => measured.apply(filter, terms, world),)* }
            }
        }
    };
}

kinds! {
    /// The wheels' velocity over an interval.
    Odometry(OdometrySample),
    /// Own sighting of another robot.
    Sighting(Sighting),
    /// Own track of another robot, wholly dependent.
    Track(TrackPose),
    /// Own sighting of another robot that says a part only.
    Partial(PartialSighting),
    /// Another robot that has seen this one in part asks where it believes to be. It comes before all that changes the belief.
    Ask(Ask),
    /// Own pose, as another robot has it.
    Neighbour(NeighbourPose),
    /// Own position, as another robot has it.
    Seen(SeenPart),
    /// Where a robot that was seen in part believed to be.
    Answer(Answer),
    /// Own sighting of a place that is known.
    Landmark(LandmarkSighting),
    /// Own pose, as a leader has it.
    Assist(LeaderPose),
    /// Own heading, from a compass, two antennas or the course over ground. It comes before the fixes: it turns their lever arms
    /// the right way, and a heading that is too uncertain for a fix is not so any more.
    Heading(HeadingFix),
    /// Own position, from satellites or a beacon.
    Fix(PositionFix),
    /// Own pose, as a person or a map says it.
    Pose(PoseSaid),
    /// What the team's rounds do to the belief: after all else of the stamp, which was shared.
    Round(RoundWord),
    /// The gyro's yaw rate. It takes no place in an event: it drives, beside the wheels.
    Gyro(GyroSample),
}

/// Whether these are coordinates of something in this world.
#[inline]
fn check_numbers(numbers: &[f64]) -> Result<(), Verdict> {
    let is_near = |number: &f64| number.abs() <= FARTHEST;
    let all = numbers.iter().all(is_near);
    all.then_some(()).ok_or(Verdict::NotFinite)
}

/// A variance of zero says that a coordinate is known exactly. No sensor knows one so; it is what is sent where nothing is
/// known of the noise.
#[inline]
fn check_variances(variances: &[f64]) -> Result<(), Verdict> {
    let all = variances.iter().all(|&variance| variance > 0.0);
    all.then_some(()).ok_or(Verdict::NoNoise)
}

impl Origin {
    /// The word with this number of a source that is the only one of its kind.
    #[must_use]
    pub const fn counted(sequence: u64) -> Self {
        Self {
            source: 0,
            session: 0,
            sequence,
        }
    }
}

impl Key {
    #[inline]
    fn new(stamp: Stamp, kind: Kind, origin: Origin) -> Self {
        Self {
            stamp,
            kind,
            source: u32::from(origin.source),
            session: origin.session,
            sequence: origin.sequence,
        }
    }

    /// The same place among those of another kind.
    #[inline]
    fn as_kind(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }
}

impl Measurement {
    /// When it was measured; where an interval was, its end.
    #[must_use]
    pub fn stamp(&self) -> Stamp {
        self.key().stamp
    }

    /// Of which kind it is.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.key().kind
    }

    /// The velocity that drives the belief, if it is one.
    #[must_use]
    #[inline]
    pub fn as_odometry(&self) -> Option<&OdometrySample> {
        match self {
            Self::Odometry(sample) => Some(sample),
            _ => None,
        }
    }
}

impl Measurement {
    /// Whether it drives the belief, and corrects nothing.
    #[must_use]
    #[inline]
    pub(crate) fn drives(&self) -> bool {
        matches!(self, Self::Odometry(_) | Self::Gyro(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::{Covariance2, Covariance3};
    use crate::motion::Motion;
    use crate::parts::Parts;
    use crate::pose::Pose;

    fn odometry(source: u16, start: i64, stamp: i64) -> Key {
        let motion = Motion::standstill([0.0; 3]);
        let [start, stamp] = [start, stamp].map(Stamp::from_nanos);
        OdometrySample {
            source,
            start,
            stamp,
            motion,
        }
        .key()
    }

    fn sighting(stamp: i64, observed: u16, origin: Origin) -> Key {
        Sighting {
            stamp: Stamp::from_nanos(stamp),
            origin,
            observed: RobotId(observed),
            relative: Pose::default(),
            covariance: Covariance3::ZERO,
        }
        .key()
    }

    fn neighbour(stamp: i64, sender: u16, sequence: u64) -> Key {
        NeighbourPose {
            stamp: Stamp::from_nanos(stamp),
            origin: Origin {
                source: sender,
                ..Origin::counted(sequence)
            },
            pose: Pose::default(),
            parts: Parts::ZERO,
        }
        .key()
    }

    fn fix(stamp: i64, origin: Origin) -> Key {
        PositionFix {
            stamp: Stamp::from_nanos(stamp),
            origin,
            position: [0.0; 2],
            covariance: Covariance2::ZERO,
            lever: [0.0; 2],
            slow: SlowError::default(),
        }
        .key()
    }

    fn heading(stamp: i64, sequence: u64) -> Key {
        HeadingFix {
            stamp: Stamp::from_nanos(stamp),
            origin: Origin::counted(sequence),
            heading_rad: 0.0,
            variance: 0.0,
            slow: SlowError::default(),
            of: HeadingOf::Body,
        }
        .key()
    }

    fn pose(stamp: i64, sequence: u64) -> Key {
        PoseSaid {
            stamp: Stamp::from_nanos(stamp),
            origin: Origin::counted(sequence),
            pose: Pose::default(),
            covariance: Covariance3::ZERO,
            set: sequence == 0,
        }
        .key()
    }

    fn of(source: u16, session: u64, sequence: u64) -> Origin {
        Origin {
            source,
            session,
            sequence,
        }
    }

    #[test]
    fn an_event_is_in_the_order_of_algorithm_4() {
        let ordered = [
            fix(1, Origin::counted(9)),
            odometry(0, -1, 2),
            odometry(0, 1, 2),
            odometry(1, 0, 2),
            sighting(2, 4, Origin::counted(8)),
            sighting(2, 5, Origin::counted(7)),
            neighbour(2, 3, 7),
            neighbour(2, 3, 8),
            neighbour(2, 4, 1),
            heading(2, 5),
            fix(2, Origin::counted(0)),
            fix(2, Origin::counted(1)),
            pose(2, 0),
            pose(2, 1),
            odometry(0, 0, 3),
        ];
        assert!(ordered.is_sorted_by(|a, b| a < b));
        assert!(Kind::ALL.is_sorted());
    }

    #[test]
    fn a_tie_is_broken_by_the_source_and_by_the_session_only_within_it() {
        let fixes = [of(0, 7, 9), of(0, 8, 1), of(1, 2, 1), of(1, 2, 3)];
        assert!(
            fixes
                .map(|origin| fix(1, origin))
                .is_sorted_by(|a, b| a < b)
        );
        let seen = [(4, of(1, 7, 9)), (5, of(0, 9, 1)), (5, of(1, 2, 1))];
        let keys = seen.map(|(observed, origin)| sighting(1, observed, origin));
        assert!(keys.is_sorted_by(|a, b| a < b));
    }
}
