//! What a source says of where the robot is: a fix, a neighbour's pose or a map's, in one form.

use nalgebra::Matrix2;

use super::COMPARABLE;
use super::lifted::Lifted;
use crate::angle::wrap;
use crate::belief::Belief;
use crate::convert::GlobalPose;
use crate::covariance::Covariance2;
use crate::factor::Factor;
use crate::gate::{CHI2_2_99, CHI2_3_99};
use crate::kind::{Kind, LeaderPose, Measured, Measurement, NeighbourPose, PoseSaid, PositionFix};
use crate::output::Source;
use crate::partial::{Reading, SplitPosition};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::stamp::Stamp;
use crate::symmetric::Symmetric3;

/// χ² with two degrees of freedom, 99.9 %: a source and its own hypothesis.
const OWN_GATE: f64 = 13.815_510_557_964_274;

/// No slow error explains more than this: 3e-7 with two degrees of freedom and with three.
const GROSS_FIX: f64 = 30.0;
const GROSS_POSE: f64 = 36.0;

/// Not even a receiver with heavy tails is off by so much three times in a row.
const FLAGRANT: f64 = 100.0;

/// How long what a neighbour says depends on what it said before \[s\].
const NEIGHBOUR_MEMORY_S: f64 = 1.0;

/// What is seen in part, whoever says it, feeds one hypothesis: of each robot alone there is too little of it.
const IN_PART: Source = Source::new(Kind::Answer, 0);

/// Errors that robots and sightings have in common last for so many words of them.
const SHARED: f64 = 4.0;

/// A word, and what its source is like.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Word {
    pub(crate) source: Source,
    pub(crate) stamp: Stamp,
    pub(crate) said: Said,
    /// How far it is from the belief; of no meaning where there is none.
    pub(crate) gauge: Gauge,
}

/// What was said.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) enum Said {
    /// A position of the antenna at `lever` with white noise and a slow error of a variance, forgotten within a time
    /// \[m, m, m², m², s\].
    Fix {
        position: [f64; 2],
        lever: [f64; 2],
        white: Matrix2<f64>,
        slow: f64,
        memory_s: f64,
    },
    /// A pose with noise of its own and with what it may share with anybody.
    Pose { pose: Pose, parts: Parts },
}

/// How far a word is from the belief before it, taken when it was applied: who judges it need not go back there.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Gauge {
    /// Of the whole. What a neighbour shares with the belief may be anything: α = ½ holds for all.
    pub(crate) d2: f64,
    /// Of a fix: the innovation, of covariance one where all is as it is said to be.
    pub(crate) normalised: [f64; 2],
    /// It is a fix, and the heading is too uncertain for it to be fused.
    pub(crate) wide: bool,
}

/// A test of a word: d², and what it may be.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Test {
    pub(crate) d2: f64,
    limit: f64,
    gross: f64,
}

impl Word {
    /// Of a measurement that says where the robot is.
    #[inline(always)]
    #[allow(clippy::inline_always)] // What is not asked of it is not copied.
    pub(crate) fn of(stamp: Stamp, measurement: &Measurement, gauge: Gauge) -> Option<Self> {
        let said = match measurement {
            Measurement::Fix(fix) => Said::of_fix(fix),
            Measurement::Neighbour(NeighbourPose { pose, parts, .. }) => Said::Pose {
                pose: *pose,
                parts: *parts,
            },
            Measurement::Assist(LeaderPose { said, .. }) => Said::Pose {
                pose: said.pose,
                parts: said.parts,
            },
            Measurement::Pose(said) if !said.set => Said::Pose {
                pose: said.pose,
                parts: said.parts(),
            },
            Measurement::Seen(_) | Measurement::Answer(_) | Measurement::Landmark(_) => {
                return Self::of_part(stamp, measurement, gauge);
            }
            Measurement::Gyro(_)
            | Measurement::Odometry(_)
            | Measurement::Sighting(_)
            | Measurement::Track(_)
            | Measurement::Partial(_)
            | Measurement::Ask(_)
            | Measurement::Heading(_)
            | Measurement::Round(_)
            | Measurement::Pose(PoseSaid { .. }) => {
                return None;
            }
        };
        Some(Self {
            source: measurement.source(),
            stamp,
            said,
            gauge,
        })
    }

    /// Of what says a part only: heard by who does not know which way the robot looks. Others have fused it.
    #[cold]
    fn of_part(stamp: Stamp, measurement: &Measurement, gauge: Gauge) -> Option<Self> {
        if !gauge.wide {
            return None;
        }
        let said = match measurement {
            Measurement::Seen(seen) => Said::of_place(&seen.place?, None),
            Measurement::Answer(answer) => Said::of_place(&answer.place, Some(&answer.reading?)),
            Measurement::Landmark(it) => {
                let place = SplitPosition::known(it.position, it.covariance);
                Said::of_place(&place, Some(&it.reading))
            }
            _ => None,
        };
        Some(Self {
            source: IN_PART,
            stamp,
            said: said?,
            gauge,
        })
    }

    /// Whether it is an own receiver's.
    fn is_receivers(&self) -> bool {
        self.source.kind == Kind::Fix
    }

    /// Whether it says which way the robot looks, though the robot has not moved.
    pub(crate) fn tells_heading(&self) -> bool {
        !(self.is_fix() && self.is_receivers())
    }

    pub(crate) fn is_fix(&self) -> bool {
        matches!(self.said, Said::Fix { .. })
    }

    /// Where what it says the position of is, in the body frame \[m\].
    pub(crate) fn lever(&self) -> [f64; 2] {
        match self.said {
            Said::Fix { lever, .. } => lever,
            Said::Pose { .. } => [0.0; 2],
        }
    }

    /// The variance of a receiver's slow error, zero where it has none \[m²\].
    pub(crate) fn slow(&self) -> f64 {
        match self.said {
            Said::Fix { slow, .. } => slow,
            Said::Pose { .. } => 0.0,
        }
    }

    /// How long an error of it lasts \[s\]; zero where each is new.
    pub(crate) fn memory_s(&self) -> f64 {
        match self.said {
            Said::Fix { slow, memory_s, .. } if slow > 0.0 => memory_s,
            Said::Fix { .. } => 0.0,
            Said::Pose { .. } => NEIGHBOUR_MEMORY_S,
        }
    }

    /// A receiver with a slow error: its own hypothesis knows it, and so tells more than the belief does.
    pub(crate) fn is_watched(&self) -> bool {
        self.slow() > 0.0
    }

    /// Whether each error is new, so that the mean of many is near zero.
    pub(crate) fn is_white(&self) -> bool {
        self.is_fix() && self.is_receivers() && !self.is_watched()
    }

    /// All of its noise, with zeros for the heading of a fix.
    pub(crate) fn noise(&self) -> Symmetric3 {
        match &self.said {
            Said::Fix { white, slow, .. } => Symmetric3 {
                xx: white.m11 + slow,
                yy: white.m22 + slow,
                xy: white.m12,
                ..Symmetric3::ZERO
            },
            Said::Pose { parts, .. } => parts.total().symmetric(),
        }
    }

    /// Its distance from the pose of what it says the position of.
    pub(crate) fn innovation(&self, from: &Pose) -> [f64; 3] {
        match self.said {
            Said::Fix { position, .. } => [position[0] - from.x, position[1] - from.y, 0.0],
            Said::Pose { pose, .. } => {
                [pose.x - from.x, pose.y - from.y, wrap(pose.phi - from.phi)]
            }
        }
    }

    /// On the belief.
    pub(crate) fn test_belief(&self) -> Test {
        if self.is_fix() {
            Test::of_fix(self.gauge.d2)
        } else {
            Test::of_pose(self.gauge.d2)
        }
    }

    /// On another source's hypothesis; `doubled` where a neighbour is behind that one or this.
    pub(crate) fn test_hypothesis(&self, lifted: &Lifted, doubled: bool) -> Test {
        let lifted = &lifted.at(self.lever());
        let with_heading = !self.is_fix() && lifted.direction().sigma() < COMPARABLE;
        let factor = if doubled { 2.0 } else { 1.0 };
        let sum = (lifted.pose_covariance() + self.noise()) * factor;
        let innovation = self.innovation(&lifted.pose());
        if with_heading {
            Test::of_pose(Factor::new(&sum).distance(innovation))
        } else {
            let [x, y, _] = innovation;
            Test::of_fix(Factor::new(&planar(&sum)).distance([x, y, 0.0]))
        }
    }

    /// On the hypothesis that it feeds.
    pub(crate) fn test_own(&self, lifted: &Lifted) -> Test {
        let d2 = match &self.said {
            Said::Fix {
                position,
                lever,
                white,
                ..
            } => lifted.distance(*position, *lever, white),
            Said::Pose { parts, .. } => {
                let sum = lifted.pose_covariance() * 2.0 + halved_weights(parts);
                let [x, y, _] = self.innovation(&lifted.pose());
                Factor::new(&planar(&sum)).distance([x, y, 0.0])
            }
        };
        Test {
            d2,
            limit: OWN_GATE,
            gross: GROSS_FIX,
        }
    }
}

impl Gauge {
    /// Of what says a part only, and was not fused.
    pub(crate) fn of_part(d2: f64) -> Self {
        Self {
            d2,
            wide: true,
            ..Self::default()
        }
    }

    /// Of a neighbour's pose, or a map's.
    pub(crate) fn of_pose(belief: &Belief, received: &GlobalPose) -> Self {
        let sum = halved_weights(&belief.parts) + halved_weights(&received.parts);
        let (said, from) = (&received.pose, &belief.pose);
        let turned = wrap(said.phi - from.phi);
        let innovation = [said.x - from.x, said.y - from.y, turned];
        Self {
            d2: Factor::new(&sum).distance(innovation),
            ..Self::default()
        }
    }
}

impl Said {
    /// Of a position, with what a sensor says of where in the body frame that is. Its noise is turned by a heading that may be any.
    fn of_place(place: &SplitPosition, reading: Option<&Reading>) -> Option<Self> {
        let sighting = match reading {
            Some(Reading::Place(sighting)) => Some(sighting),
            Some(Reading::Alone(_)) => return None, // One number is not linear in the direction.
            None => None,
        };
        let round = |noise: &Covariance2| {
            let [x, y] = noise.variances();
            Matrix2::identity() * (x + y) // No less than its largest eigenvalue.
        };
        let noise = sighting.map_or_else(Matrix2::zeros, |it| {
            round(&it.white) + round(&it.slow) * SHARED
        });
        Some(Self::Fix {
            position: place.position,
            lever: sighting.map_or([0.0; 2], |it| it.at),
            white: place.independent.matrix() + place.dependent.matrix() * SHARED + noise,
            slow: 0.0,
            memory_s: 0.0,
        })
    }

    fn of_fix(fix: &PositionFix) -> Self {
        Self::Fix {
            position: fix.position,
            lever: fix.lever,
            white: fix.covariance.matrix(),
            slow: if fix.slow.is_there() {
                fix.slow.variance
            } else {
                0.0
            },
            memory_s: fix.slow.memory.as_seconds(),
        }
    }
}

impl Test {
    /// Of what a hypothesis begins with.
    pub(crate) const PASSED: Self = Self {
        d2: 0.0,
        limit: OWN_GATE,
        gross: GROSS_FIX,
    };

    /// Of a fix that is so far off.
    pub(crate) fn of_fix(d2: f64) -> Self {
        Self {
            d2,
            limit: CHI2_2_99,
            gross: GROSS_FIX,
        }
    }

    /// Of a pose that is so far off.
    fn of_pose(d2: f64) -> Self {
        Self {
            d2,
            limit: CHI2_3_99,
            gross: GROSS_POSE,
        }
    }

    pub(crate) fn passes(&self) -> bool {
        self.d2 <= self.limit
    }

    /// More than any slow error explains.
    pub(crate) fn is_gross(&self) -> bool {
        self.d2 > self.gross
    }

    /// Far more than that.
    pub(crate) fn is_flagrant(&self) -> bool {
        self.d2 > FLAGRANT
    }
}

/// Without the heading.
pub(crate) fn planar(a: &Symmetric3) -> Symmetric3 {
    Symmetric3 {
        xx: a.xx,
        yy: a.yy,
        xy: a.xy,
        ..Symmetric3::ZERO
    }
}

/// `P_i + 2 P_d`
fn halved_weights(parts: &Parts) -> Symmetric3 {
    parts.independent.symmetric() + parts.dependent.symmetric() * 2.0
}
