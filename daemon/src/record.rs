//! A recording: everything that the estimator was given, tick by tick, and what it answered.
//!
//! The step is pure, so a recording goes through it again to the same bits. Lines of JSON; numbers are written so
//! that they read back exactly.
//!
//! ```text
//! begin ( tick (odometry | gyro | sighting | neighbour | partial | seen | answer | landmark | heading | fix | pose | round)*
//!         team_clock? (assist leader transition*)* assist_ack* (readings way? sight*)* estimate )*
//! ```
//!
//! The real-time thread only puts [`Record`]s into the ring. Where a full ring or a slow disk has lost lines there is a line
//! `lost`, and a reader goes on with the next whole tick; a tick says how many lines belong to it.

mod assist;
mod part;
mod read;
mod round;
mod write;

use coloc_estimator::assist::assistant::Words;
use coloc_estimator::{
    Estimate, GyroSample, GyroSettings, HeadingFix, HeadingOf, Measurement, Motion, NeighbourPose,
    OdometrySample, PoseSaid, PositionFix, Sighting, SlowError, Start, TickInputs, TrackPose,
};
use coloc_shm_types::Opinion;
use serde::{Deserialize, Serialize};

pub use part::Reading;
pub use read::{Gaps, RecordedTick, Recording, RecordingError};
pub use round::RecordedDeed;
pub use write::Recorder;

/// A line of a recording. Poses `[x, y, φ]` \[m, m, rad\], covariances row-major, stamps \[ns\].
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "record", rename_all = "snake_case", deny_unknown_fields)]
pub enum Record {
    /// The first line: who, and what it believes before anything is measured.
    Begin {
        /// Number in the team.
        robot: u16,
        /// Of `belief`.
        stamp_ns: i64,
        /// How much of it is known.
        #[serde(default, skip_serializing_if = "Known::is_pose")]
        known: Known,
        /// Mean.
        pose: [f64; 3],
        /// `P_i`
        independent: [f64; 9],
        /// `P_d`
        dependent: [f64; 9],
        /// `k_a` and `k_b`
        bend: [f64; 6],
        /// Bias of the gyro and its variance, if there is one \[rad/s, rad²/s²\].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        gyro: Option<[f64; 2]>,
    },
    /// Lines are missing here.
    Lost {
        /// How many.
        lines: u64,
    },
    /// A tick; its inputs and its estimate follow.
    Tick {
        /// Counted from 0; where one is missing, it was lost.
        tick: u64,
        /// The tick's own stamp.
        stamp_ns: i64,
        /// Lines with inputs.
        inputs: usize,
        /// What the estimator did with them.
        #[serde(default, skip_serializing_if = "Step::is_own")]
        step: Step,
    },
    /// Of the wheels.
    Odometry {
        /// Which wheels.
        #[serde(default)]
        source: u16,
        /// Interval's begin.
        start_ns: i64,
        /// Interval's end.
        stamp_ns: i64,
        /// Whether there is a sideways velocity.
        holonomic: bool,
        /// `[v_x, v_y, ω]` \[m/s, m/s, rad/s\].
        velocity: [f64; 3],
        /// Variances and covariances of these.
        noise: [f64; 9],
    },
    /// Own sighting of another robot.
    Sighting {
        /// When.
        stamp_ns: i64,
        /// Which sensor.
        #[serde(default)]
        source: u16,
        /// Which life of it.
        #[serde(default)]
        session: u64,
        /// Its count.
        sequence: u64,
        /// Whom.
        observed: u16,
        /// In the body frame.
        pose: [f64; 3],
        /// R
        covariance: [f64; 9],
        /// Whether it is a track's, of which nothing is independent.
        #[serde(default, skip_serializing_if = "is_not")]
        track: bool,
    },
    /// Pose from a neighbour.
    Neighbour {
        /// When the neighbour saw us.
        stamp_ns: i64,
        /// Who.
        sender: u16,
        /// Which life of it.
        #[serde(default)]
        session: u64,
        /// Its count of what it sent to us.
        sequence: u64,
        /// y*
        pose: [f64; 3],
        /// R*_i
        independent: [f64; 9],
        /// R*_d
        dependent: [f64; 9],
    },
    /// Satellite fix.
    Fix {
        /// When.
        stamp_ns: i64,
        /// Which receiver.
        #[serde(default)]
        source: u16,
        /// Which life of it.
        #[serde(default)]
        session: u64,
        /// Its count.
        sequence: u64,
        /// \[m\]
        position: [f64; 2],
        /// `R_A`
        covariance: [f64; 4],
        /// Variance of the slow error \[m²\].
        #[serde(default, skip_serializing_if = "is_zero")]
        slow_variance: f64,
        /// How long it lasts.
        #[serde(default, skip_serializing_if = "is_no_time")]
        slow_memory_ns: i64,
        /// Where the antenna is in the body frame \[m\].
        #[serde(default, skip_serializing_if = "is_no_lever")]
        lever: [f64; 2],
    },
    /// Heading.
    Heading {
        /// When.
        stamp_ns: i64,
        /// Which sensor.
        #[serde(default)]
        source: u16,
        /// Which life of it.
        #[serde(default)]
        session: u64,
        /// Its count.
        sequence: u64,
        /// \[rad\]
        heading: f64,
        /// \[rad²\]
        variance: f64,
        /// Variance of the slow error \[rad²\].
        #[serde(default, skip_serializing_if = "is_zero")]
        slow_variance: f64,
        /// How long it lasts.
        #[serde(default, skip_serializing_if = "is_no_time")]
        slow_memory_ns: i64,
        /// Of a course over ground its least speed \[m/s\].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        least_m_s: Option<f64>,
        /// Where its antenna is in the body frame \[m\].
        #[serde(default, skip_serializing_if = "is_no_lever")]
        lever: [f64; 2],
    },
    /// Pose from a person or a map.
    Pose {
        /// When.
        stamp_ns: i64,
        /// Which person or map.
        #[serde(default)]
        source: u16,
        /// Which life of it.
        #[serde(default)]
        session: u64,
        /// Its count.
        sequence: u64,
        /// In the common frame.
        pose: [f64; 3],
        /// Of it.
        covariance: [f64; 9],
        /// Whether it is believed, or one more source's word.
        set: bool,
    },
    /// Own sighting of another robot that says a part only.
    Partial {
        /// When.
        stamp_ns: i64,
        /// Which sensor.
        #[serde(default)]
        source: u16,
        /// Which life of it.
        #[serde(default)]
        session: u64,
        /// Its count.
        sequence: u64,
        /// Whom.
        observed: u16,
        /// What the sensor says.
        reading: Reading,
    },
    /// Another robot asks where this one believes to be; it comes with `seen`.
    Ask {
        /// When it saw this one.
        stamp_ns: i64,
        /// Who.
        sender: u16,
        /// With which of its sensors.
        sensor: u16,
        /// Which life of that.
        session: u64,
        /// Its count.
        sighting: u64,
    },
    /// Position from a robot that has seen this one in part.
    Seen {
        /// When.
        stamp_ns: i64,
        /// Who.
        sender: u16,
        /// With which of its sensors.
        sensor: u16,
        /// Which life of that.
        session: u64,
        /// Its count.
        sighting: u64,
        /// Where this robot must be; `null`: it is only asked.
        place: Option<part::Place>,
        /// Whether it is asked where it believes to be.
        asks: bool,
    },
    /// Position of a robot that this one has seen in part.
    Answer {
        /// When.
        stamp_ns: i64,
        /// Who was seen.
        sender: u16,
        /// With which of the own sensors.
        sensor: u16,
        /// Which life of that.
        session: u64,
        /// Its count.
        sighting: u64,
        /// Where it believed to be.
        place: part::Place,
    },
    /// Own sighting of a landmark.
    Landmark {
        /// When.
        stamp_ns: i64,
        /// Which sensor.
        #[serde(default)]
        source: u16,
        /// Which life of it.
        #[serde(default)]
        session: u64,
        /// Its count.
        sequence: u64,
        /// Which landmark.
        landmark: u16,
        /// What the sensor says.
        reading: Reading,
        /// Where the landmark is \[m\].
        position: [f64; 2],
        /// Of it.
        covariance: [f64; 4],
    },
    /// So much is the team's clock ahead of the stamps; nothing where it is not.
    TeamClock {
        /// \[ns\]
        ahead_ns: i64,
    },
    /// Pose from a leader; `leader` follows.
    Assist {
        /// When it holds.
        stamp_ns: i64,
        /// Who sent it.
        sender: u16,
        /// Which life of it.
        session: u64,
        /// Its count of what it sent to us.
        sequence: u64,
        /// Of which event.
        slot: i64,
        /// The leader, every child on the way, and this robot.
        path: [u16; 16],
        /// How many they are.
        robots: u8,
        /// Whether it is not to be handed on.
        is_final: bool,
        /// What its leader knew, where leaders know all readings.
        #[serde(default, skip_serializing_if = "is_none")]
        digest: u32,
        /// y*
        pose: [f64; 3],
        /// R*_i
        independent: [f64; 9],
        /// R*_d
        dependent: [f64; 9],
    },
    /// Where the leader of the last `assist` was; its transitions follow.
    Leader {
        /// `x_l`
        pose: [f64; 3],
        /// `P_l`
        covariance: [f64; 9],
        /// So many events ago its error began to go its way.
        #[serde(default)]
        known: u8,
    },
    /// What became of its error since an event, the last one first.
    Transition {
        /// Φ
        phi: [f32; 9],
    },
    /// What another robot saw of children in one event; its way and its sights follow.
    Readings {
        /// The middle of the event.
        stamp_ns: i64,
        /// Who saw it.
        sender: u16,
        /// Which life of it.
        session: u64,
        /// Its count.
        sequence: u64,
        /// Which event.
        slot: i64,
        /// Of a leader's covariance.
        trace: Option<f64>,
        /// Of its own way, which follows.
        way_covariance: Option<[f64; 9]>,
    },
    /// The way of who said the last of them.
    Way {
        /// Where each stretch of it ends.
        ends: [[f64; 3]; 8],
    },
    /// What the last of them saw.
    Sight {
        /// So long after the event's beginning.
        since_ns: i64,
        /// Whom.
        observed: u16,
        /// Where, in the frame of who saw it.
        pose: [f64; 3],
        /// Of that.
        covariance: [f64; 9],
    },
    /// What became of what this robot handed on.
    AssistAck {
        /// When that holds.
        stamp_ns: i64,
        /// Who answers.
        sender: u16,
        /// Of which event.
        slot: i64,
        /// Whose pose it was.
        leader: u16,
        /// Whether it is used.
        taken: bool,
    },
    /// What the team's rounds do; numbers that are not of it are zero.
    Round {
        /// From when on it holds; of a share when the slot begins.
        stamp_ns: i64,
        /// Zero.
        source: u16,
        /// Which life of who says it.
        session: u64,
        /// Its count.
        sequence: u64,
        /// What is to be done.
        deed: RecordedDeed,
        /// Of which slot.
        slot: u64,
        /// `x̂⁺`
        pose: [f64; 3],
        /// `P⁺`
        covariance: [f64; 9],
        /// Of the block bound.
        factor: f64,
    },
    /// Yaw rate.
    Gyro {
        /// When.
        stamp_ns: i64,
        /// Which gyro.
        #[serde(default)]
        source: u16,
        /// Which life of it.
        #[serde(default)]
        session: u64,
        /// Its count.
        sequence: u64,
        /// \[rad/s\]
        rate: f64,
        /// Density of its noise, if it says its own \[rad²/s\].
        #[serde(default, skip_serializing_if = "is_zero")]
        noise: f64,
    },
    /// What was published.
    Estimate {
        /// The tick's stamp.
        stamp_ns: i64,
        /// Mean.
        pose: [f64; 3],
        /// `P_i`
        independent: [f64; 9],
        /// `P_d`
        dependent: [f64; 9],
        /// `k_a` and `k_b`
        bend: [f64; 6],
        /// What `coloc-bounds` said of it, by the number of [`Opinion`].
        #[serde(default, skip_serializing_if = "is_no_opinion")]
        opinion: u8,
    },
}

/// How much a robot knows at the start.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Known {
    /// A pose.
    #[default]
    Pose,
    /// A position; the heading means nothing.
    Position,
    /// Nothing: pose and covariances mean nothing.
    Nothing,
}

impl Known {
    #[allow(clippy::trivially_copy_pass_by_ref)] // serde's signature.
    fn is_pose(&self) -> bool {
        *self == Self::Pose
    }
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde's signature.
fn is_zero(variance: &f64) -> bool {
    *variance == 0.0
}

fn is_no_lever([forward, left]: &[f64; 2]) -> bool {
    *forward == 0.0 && *left == 0.0
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde's signature.
fn is_no_time(nanos: &i64) -> bool {
    *nanos == 0
}

/// What the estimator did in a tick, or ahead of it.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Step {
    /// The step of the tick, up to its stamp.
    #[default]
    Own,
    /// A step ahead of the tick: there was more odometry than a step takes.
    Ahead,
    /// None: there was more than a tick has time for. The estimate is what the last step says of the tick's stamp.
    Behind,
}

impl Step {
    #[allow(clippy::trivially_copy_pass_by_ref)] // serde's signature.
    fn is_own(&self) -> bool {
        *self == Self::Own
    }
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde's signature.
fn is_none(digest: &u32) -> bool {
    *digest == 0
}

/// The lines of a tick's inputs, its own first.
pub fn of_inputs(tick: u64, step: Step, inputs: &TickInputs<'_>) -> impl Iterator<Item = Record> {
    let head = Record::Tick {
        tick,
        stamp_ns: inputs.stamp.as_nanos(),
        inputs: inputs.measurements.len(),
        step,
    };
    std::iter::once(head).chain(inputs.measurements.iter().map(Record::from))
}

/// The same, with what others say of the robot.
pub fn of_words(
    tick: u64,
    step: Step,
    inputs: &TickInputs<'_>,
    words: &Words<'_>,
) -> impl Iterator<Item = Record> {
    let more = assist::count(words);
    let lines = of_inputs(tick, step, inputs).map(move |mut record| {
        if let Record::Tick { inputs, .. } = &mut record {
            *inputs += more;
        }
        record
    });
    lines.chain(assist::lines(words))
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde's signature.
fn is_no_opinion(opinion: &u8) -> bool {
    *opinion == Opinion::None as u8
}

impl Record {
    /// What was published, with what was said of it.
    #[must_use]
    pub fn published(estimate: &Estimate, said: Opinion) -> Self {
        let mut record = Self::from(estimate);
        if let Self::Estimate { opinion, .. } = &mut record {
            *opinion = said as u8;
        }
        record
    }

    /// The first line.
    #[must_use]
    pub fn begin(robot: u16, stamp_ns: i64, start: &Start, gyro: Option<GyroSettings>) -> Self {
        let belief = start.belief();
        Self::Begin {
            robot,
            stamp_ns,
            known: match start {
                Start::Known(_) => Known::Pose,
                Start::Position(..) => Known::Position,
                Start::Unknown => Known::Nothing,
            },
            pose: belief.pose.to_vector().into(),
            independent: belief.parts.independent.to_row_major(),
            dependent: belief.parts.dependent.to_row_major(),
            bend: belief.bend.to_array(),
            gyro: gyro.map(|it| [it.bias, it.bias_variance]),
        }
    }
}

impl From<&Measurement> for Record {
    fn from(measurement: &Measurement) -> Self {
        match measurement {
            Measurement::Odometry(sample) => sample.into(),
            Measurement::Sighting(sighting) => sighted(sighting, false),
            Measurement::Track(TrackPose(sighting)) => sighted(sighting, true),
            Measurement::Neighbour(neighbour) => neighbour.into(),
            Measurement::Heading(heading) => heading.into(),
            Measurement::Fix(fix) => fix.into(),
            Measurement::Pose(said) => said.into(),
            Measurement::Gyro(sample) => sample.into(),
            Measurement::Partial(sighting) => sighting.into(),
            Measurement::Ask(ask) => ask.into(),
            Measurement::Seen(seen) => seen.into(),
            Measurement::Answer(answer) => answer.into(),
            Measurement::Landmark(sighting) => sighting.into(),
            Measurement::Assist(pose) => pose.into(),
            Measurement::Round(word) => word.into(),
        }
    }
}

impl From<&OdometrySample> for Record {
    fn from(sample: &OdometrySample) -> Self {
        let (holonomic, noise) = match sample.motion {
            Motion::Nonholonomic { noise, .. } => {
                let [vv, vw, wv, ww] = noise.to_row_major();
                (false, [vv, 0.0, vw, 0.0, 0.0, 0.0, wv, 0.0, ww])
            }
            Motion::Holonomic { noise, .. } => (true, noise.to_row_major()),
        };
        Self::Odometry {
            source: sample.source,
            start_ns: sample.start.as_nanos(),
            stamp_ns: sample.stamp.as_nanos(),
            holonomic,
            velocity: sample.motion.velocity(),
            noise,
        }
    }
}

#[allow(clippy::trivially_copy_pass_by_ref)] // As serde asks.
fn is_not(it: &bool) -> bool {
    !it
}

fn sighted(sighting: &Sighting, track: bool) -> Record {
    Record::Sighting {
        stamp_ns: sighting.stamp.as_nanos(),
        source: sighting.origin.source,
        session: sighting.origin.session,
        sequence: sighting.origin.sequence,
        observed: sighting.observed.0,
        pose: sighting.relative.to_vector().into(),
        covariance: sighting.covariance.to_row_major(),
        track,
    }
}

impl From<&NeighbourPose> for Record {
    fn from(neighbour: &NeighbourPose) -> Self {
        Self::Neighbour {
            stamp_ns: neighbour.stamp.as_nanos(),
            sender: neighbour.origin.source,
            session: neighbour.origin.session,
            sequence: neighbour.origin.sequence,
            pose: neighbour.pose.to_vector().into(),
            independent: neighbour.parts.independent.to_row_major(),
            dependent: neighbour.parts.dependent.to_row_major(),
        }
    }
}

impl From<&PositionFix> for Record {
    fn from(fix: &PositionFix) -> Self {
        Self::Fix {
            stamp_ns: fix.stamp.as_nanos(),
            source: fix.origin.source,
            session: fix.origin.session,
            sequence: fix.origin.sequence,
            position: fix.position,
            covariance: fix.covariance.to_row_major(),
            slow_variance: fix.slow.variance,
            slow_memory_ns: memory_ns(&fix.slow),
            lever: fix.lever,
        }
    }
}

impl From<&HeadingFix> for Record {
    fn from(heading: &HeadingFix) -> Self {
        let (least_m_s, lever) = match heading.of {
            HeadingOf::Body => (None, [0.0; 2]),
            HeadingOf::Course { least_m_s, lever } => (Some(least_m_s), lever),
        };
        Self::Heading {
            stamp_ns: heading.stamp.as_nanos(),
            source: heading.origin.source,
            session: heading.origin.session,
            sequence: heading.origin.sequence,
            heading: heading.heading_rad,
            variance: heading.variance,
            slow_variance: heading.slow.variance,
            slow_memory_ns: memory_ns(&heading.slow),
            least_m_s,
            lever,
        }
    }
}

/// Of an error that is none nothing is written.
fn memory_ns(slow: &SlowError) -> i64 {
    match slow.variance {
        0.0 => 0,
        _ => slow.memory.as_nanos(),
    }
}

impl From<&PoseSaid> for Record {
    fn from(said: &PoseSaid) -> Self {
        Self::Pose {
            stamp_ns: said.stamp.as_nanos(),
            source: said.origin.source,
            session: said.origin.session,
            sequence: said.origin.sequence,
            pose: said.pose.to_vector().into(),
            covariance: said.covariance.to_row_major(),
            set: said.set,
        }
    }
}

impl From<&GyroSample> for Record {
    fn from(sample: &GyroSample) -> Self {
        Self::Gyro {
            stamp_ns: sample.stamp.as_nanos(),
            source: sample.origin.source,
            session: sample.origin.session,
            sequence: sample.origin.sequence,
            rate: sample.rate_radps,
            noise: sample.noise,
        }
    }
}

impl From<&Estimate> for Record {
    fn from(estimate: &Estimate) -> Self {
        Self::Estimate {
            stamp_ns: estimate.stamp.as_nanos(),
            pose: estimate.belief.pose.to_vector().into(),
            independent: estimate.belief.parts.independent.to_row_major(),
            dependent: estimate.belief.parts.dependent.to_row_major(),
            bend: estimate.belief.bend.to_array(),
            opinion: Opinion::None as u8,
        }
    }
}
