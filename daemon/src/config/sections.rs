//! The sections of `robot.toml`. What stands here at a setting is all there is to say about it, and said once:
//! `daemon/robot.toml`, `docs/configuration.md` and the refusals are made from it (by `shape`).
//!
//! The comment is what a person reads, its unit at the end in brackets; `range` and `length` are what is allowed.
//! A number without an upper end may be `inf`.

use std::path::PathBuf;

use coloc_shm_types::RobotName;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sensors::Receiver;

/// `[robot]`: who this robot is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Part of its services' names, as in `coloc/robot1/estimate`: letters, digits, `_` and `-`.
    #[serde(with = "robot_name")]
    #[schemars(with = "String", length(min = 1, max = 32))]
    pub name: RobotName,
    /// Its number in the team, which no other robot of the team has.
    pub id: u16,
}

/// `[[team]]`: a robot of the team.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// Its name, as in its own `[robot]`.
    #[serde(with = "robot_name")]
    #[schemars(with = "String", length(min = 1, max = 32))]
    pub name: RobotName,
    /// Its number, as in its own `[robot]`.
    pub id: u16,
}

impl Robot {
    pub(super) fn example() -> impl Serialize {
        serde_json::json!({ "name": "robot1", "id": 1 })
    }
}

impl Member {
    pub(super) fn example() -> impl Serialize {
        serde_json::json!({ "name": "robot2", "id": 2 })
    }
}

mod robot_name {
    use coloc_shm_types::RobotName;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(name: D) -> Result<RobotName, D::Error> {
        RobotName::new(&String::deserialize(name)?).map_err(D::Error::custom)
    }

    pub(super) fn serialize<S: Serializer>(name: &RobotName, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(name.as_str())
    }
}

/// `[clock]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Clock {
    /// The clock of the stamps that it sends and is sent; robots that talk to one another must share one. Inside it runs on
    /// `CLOCK_BOOTTIME`, whatever is done to this one.
    pub source: ClockSource,
}

/// Clocks that stamps can be of.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ClockSource {
    /// `CLOCK_REALTIME`: shared by machines that run NTP or PTP; leaps.
    #[default]
    Realtime,
    /// `CLOCK_TAI`: the same without leap seconds.
    Tai,
    /// `CLOCK_BOOTTIME`: nobody sets it, and it counts while the computer is suspended; for robots on one machine.
    Boottime,
}

/// `[tick]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Tick {
    /// Ticks per second \[Hz\].
    #[schemars(range(min = 1, max = 1000))]
    pub rate_hz: f64,
    /// What starts a tick.
    pub trigger: Trigger,
    /// How it is waited for.
    pub wait: WaitMode,
}

/// What starts a tick.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Trigger {
    /// A frame's arrival where wheels alone are heard, on CAN, and their frames come at the tick's rate; else deadlines, right after
    /// frames and messages where these come regularly.
    #[default]
    Auto,
    /// Absolute deadlines on `CLOCK_BOOTTIME`; frames wait for the next one.
    Timer,
    /// A frame's arrival; the timer is the fallback when frames stop.
    Encoder,
}

/// How the tick's thread waits.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WaitMode {
    /// In the kernel, leaving the processor to others.
    #[default]
    Sleep,
    /// Asking again and again: the fastest, for a processor of its own; with `realtime.scheduler = "other"` only.
    Poll,
}

/// `[shm]`
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Shm {
    /// Directory of the middleware's files, an absolute path, its user's alone; programs that are to meet name the same.
    /// Empty: `/run/coloc`, or `$XDG_RUNTIME_DIR/coloc` for a user who cannot make that.
    #[schemars(length(max = 100))]
    pub root: PathBuf,
    /// First letters of its files in `/dev/shm`: letters, digits and `_`.
    #[schemars(length(min = 1, max = 16))]
    pub prefix: String,
    /// Other users who may read the robot's newest estimate and wait for it, and nothing else: the members of this group, by
    /// name or by number (`"1001"`). The user who runs colocd has to be a member too. Empty: nobody.
    #[schemars(length(max = 64))]
    pub group: String,
}

/// `[motion]`: noise of an odometry sample and what happens without one. What is not written is the preset's, which serde's
/// defaults cannot say: `presets` reads it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Motion {
    /// The robot whose noise it is where nothing else is written here. Of `forward`, `sideways` and `turning` a table that is
    /// written takes the place of the preset's whole table.
    pub preset: Preset,
    /// Noise of the forward velocity \[m²/s²\].
    pub forward: Variance,
    /// Noise of the sideways velocity; of a robot that cannot move sideways, its slip \[m²/s²\].
    pub sideways: Variance,
    /// Noise of the turning rate \[rad²/s²\].
    pub turning: Variance,
    /// What says that a robot stands: from then on `creep_per_hour` takes the place of the noise above.
    pub stands_by: StandsBy,
    /// A robot that stands, or is pushed with its wheels blocked, may creep steadily so far in an hour, forward, sideways and
    /// turning, and is within 3 σ all that hour; in four hours, within 3 σ, twice as far \[m, m, rad\].
    #[schemars(inner(range(min = 0, max = 1e6)))]
    pub creep_per_hour: [f64; 3],
    /// The sample period for which `a`, `b`, `c` and `outage_variance` are stated; other intervals are scaled as white noise
    /// \[s\].
    #[schemars(range(min = 1e-4, max = 10))]
    pub reference_period_s: f64,
    /// How long the last velocity is held when samples stop \[s\].
    #[schemars(range(min = 0, max = 60))]
    pub hold_s: f64,
    /// Meanwhile its variance grows by this part of itself in each reference period.
    #[schemars(range(min = 0, max = 1e6))]
    pub hold_growth: f64,
    /// After that the velocity is taken as zero, with these variances of forward, sideways and turning
    /// \[m²/s², m²/s², rad²/s²\].
    #[schemars(inner(range(min = 0, max = 1e6)))]
    pub outage_variance: [f64; 3],
}

/// Robots whose odometry's noise is known.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Two driven wheels on a hard floor, calibrated: 2 cm after a metre along it and 1 cm across, 3° after a minute, 1.1° after
    /// a radian. Noise that grows with the way as in Chong and Kleeman, Accurate Odometry and Error Modelling for a Mobile
    /// Robot, ICRA 1997; the numbers are judgement.
    #[default]
    Differential,
    /// Four wheels or tracks that skid to turn: 7 cm after a metre, 5 cm across, 6° after a minute, 6° after a radian. Along as
    /// Pentzer, Brennan and Reichard, Journal of Field Robotics 2014, found with learned kinematics, 0.42 m after 40.5 m; the
    /// rest is judgement.
    SkidSteer,
    /// Steered wheels with tyres on a road, heading by the wheels of an axle: 1 cm after a metre along and across, 1° after a
    /// minute, 0.1° after a metre, 1.1° after a radian. Judgement; Carlson, Gerdes and Powell, Error Sources when Land Vehicle
    /// Dead Reckoning with Differential Wheelspeeds, 2003, find the heading limited by how uneven the road is.
    Car,
    /// The robots of the MR.CLAM recordings, odometry 0.005 + 5.075 v² forward, 0.001 sideways, 0.345 turning: Table 2 of the paper,
    /// with the floor and the slip at which a filter of all of them was found honest on recording 1 and, not chosen by it, 6;
    /// nothing says that they stand, since they were seen to roll on.
    Mrclam,
    /// Table 2 of the paper (Wanasinghe, Mann and Gosine, Journal of Robotics 2016, 2560573): 5.075 v² forward, and sideways
    /// where that is measured, 0.345 turning; nothing says that it stands.
    Paper,
}

/// What says that a robot stands.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StandsBy {
    /// Counts or distances that have not changed for a second while they came.
    #[default]
    Counts,
    /// Those, and speeds of exactly 0 for a second: where speeds are made of counts, and not 0 up to some speed.
    Speeds,
    /// Nothing: a velocity of zero is one like any other.
    Nothing,
}

/// Coefficients of a variance in one direction.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Variance {
    /// At standstill.
    #[schemars(range(min = 0, max = 1e6))]
    pub a: f64,
    /// Times v².
    #[schemars(range(min = 0, max = 1e6))]
    pub b: f64,
    /// Times ω².
    #[schemars(range(min = 0, max = 1e6))]
    pub c: f64,
    /// What every second adds to the variance of the way or angle, in m²/s or rad²/s.
    #[schemars(range(min = 0, max = 1e6))]
    pub per_s: f64,
    /// What every metre adds, in m²/m or rad²/m: (2 cm after a metre)² is 4e-4, and makes 20 cm after 100 m.
    #[schemars(range(min = 0, max = 1e6))]
    pub per_m: f64,
    /// What every radian turned adds, in m²/rad or rad²/rad.
    #[schemars(range(min = 0, max = 1e6))]
    pub per_rad: f64,
}

/// `[initial]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Initial {
    /// Position x, y and heading φ in the frame that all robots share. `"unknown"`: the robot finds itself once it drives and
    /// fixes or neighbours say where it is. Left out: unknown where `[position]` has receivers, else the origin \[m, m, rad\].
    #[schemars(with = "[f64; 3]", inner(range(min = -1e9, max = 1e9)), extend("x-word" = UNKNOWN), example = [0.0, 0.0, 0.0])]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<InitialPose>,
    /// Whether the heading in `pose` is known.
    pub heading: InitialHeading,
    /// Standard deviations of `pose` \[m, m, rad\].
    #[schemars(inner(range(min = 0, max = 1e6)))]
    pub sigma: [f64; 3],
    /// Go on from the last belief that was saved, inflated by the time since, where there is one.
    pub resume: bool,
    /// A saved belief older than this is not used \[s\].
    #[schemars(range(min = 0, max = 86400))]
    pub resume_max_age_s: f64,
}

/// What is written where a pose is not known.
pub const UNKNOWN: &str = "unknown";

/// A pose \[m, m, rad\], or that it is not known.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum InitialPose {
    /// It is known.
    Given([f64; 3]),
    /// Nothing is known of it.
    Unknown,
}

/// Whether a heading is known.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum InitialHeading {
    /// As `pose` says.
    #[default]
    Given,
    /// The robot may look anywhere; the number in `pose` means nothing.
    Unknown,
}

/// `[position]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Position {
    /// How many receivers say on the channel `position` where the robot is: with one it need not be told where it starts.
    #[schemars(range(min = 0, max = 16))]
    pub receivers: u16,
    /// What it means that the only one of them is off by the same way from some moment on: the data are the same.
    pub trust_jump: TrustJump,
    /// Where the antenna is in the robot's body frame, forward and left of the point whose pose is published; used where a message says
    /// zero. Its fixes then depend on the heading, and teach it \[m, m\].
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub lever_m: [f64; 2],
    /// Standard deviation of the slow error in each coordinate, where a message does not say its own: what the next fix has again, of
    /// atmosphere, orbits and reflections. 0: each fix errs anew \[m\].
    #[schemars(range(min = 0, max = 1e3))]
    pub slow_sigma_m: f64,
    /// How long it lasts, where a message does not say its own \[s\].
    #[schemars(range(max = 86400), extend("exclusiveMinimum" = 0))]
    pub slow_time_s: f64,
    /// How late its stamps are: a fix is of so long before its stamp. Below zero they are early \[s\].
    #[schemars(range(min = -10, max = 10))]
    pub delay_s: f64,
    /// Receivers that are not so, an entry each.
    #[schemars(example = [Receiver::example()])]
    pub receiver: Vec<Receiver>,
}

/// What a lone source that jumps means.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TrustJump {
    /// The robot was carried: it is followed after 12 s.
    #[default]
    Robot,
    /// The receiver is wrong: the belief is kept, and called contradicted.
    Receiver,
}

/// `[fusion]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Fusion {
    /// Whether what others say is fused at once, or the team's `coloc-rounds` fuse all that it knows, twice a second or so. Until its
    /// `coloc-rounds` runs a robot with `"rounds"` is as one with `"split-ci"`.
    pub mode: Mode,
    /// The published algorithm to the letter: overrides `heading_lever_m` (1), `damping` (1),
    /// `memory_s` (0), `reset_on_transmit` (false), `gate_weight` (`"update"`) and `propagation` (`"paper"`).
    pub paper: bool,
    /// How the belief is carried through what the wheels say, and through a sighting.
    pub propagation: Propagation,
    /// What the weight of split covariance intersection minimises.
    pub criterion: Criterion,
    /// In the trace a radian counts as that many metres: how far off neighbours are \[m\].
    #[schemars(range(min = 0, max = 1000))]
    pub heading_lever_m: f64,
    /// At most this part of the greedy weight is used ...
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub damping: f64,
    /// ... and less where poses come faster than `damping * memory_s`, so that this long is remembered; 0: never less
    /// \[s\].
    #[schemars(range(min = 0, max = 3600))]
    pub memory_s: f64,
    /// What was sent is no longer independent.
    pub reset_on_transmit: bool,
    /// Largest normalised innovation squared of a neighbour's pose, or one that a map says (χ², 3 degrees of freedom: 99 %);
    /// `inf` accepts everything.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub neighbour_gate: f64,
    /// The weight at which that is evaluated.
    pub gate_weight: GateWeight,
    /// Largest normalised innovation squared of a fix (χ², 2 degrees of freedom: 99 %); `inf` accepts everything.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub position_gate: f64,
    /// Largest normalised innovation squared of a heading (χ², 1 degree of freedom: 99 %); `inf` accepts everything.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub heading_gate: f64,
    /// How what says a part only is fused: sightings by range and bearing, told, answered, or of landmarks.
    pub position: Partial,
    /// No own sighting of another robot is taken to be more certain than this, whatever it says: least standard deviations
    /// of x, y and heading \[m, m, rad\].
    #[schemars(inner(range(min = 0, max = 1e3)))]
    pub relative_pose_floor: [f64; 3],
    /// The same for a neighbour's pose, and one that a person or a map says \[m, m, rad\].
    #[schemars(inner(range(min = 0, max = 1e3)))]
    pub neighbour_floor: [f64; 3],
    /// The same for a fix; where a receiver claims millimetres and its antenna sways by centimetres, write centimetres
    /// \[m, m\].
    #[schemars(inner(range(min = 0, max = 1e3)))]
    pub position_floor: [f64; 2],
    /// The same for a heading \[rad\].
    #[schemars(range(min = 0, max = 1e3))]
    pub heading_floor: f64,
}

/// `[fusion.position]`: `paper` overrides all but the gates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Partial {
    /// In the trace a radian counts as that many metres \[m\].
    #[schemars(range(min = 0, max = 1000))]
    pub heading_lever_m: f64,
    /// At most this part of the greedy weight is used ...
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub damping: f64,
    /// ... and less where such messages, and poses, come faster than `damping * memory_s`; 0: never less \[s\].
    #[schemars(range(min = 0, max = 3600))]
    pub memory_s: f64,
    /// Largest normalised innovation squared of range and bearing (χ², 2 degrees of freedom: 99 %); `inf` accepts everything.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gate: f64,
    /// The same of one of the two (χ², 1 degree of freedom: 99 %).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gate_alone: f64,
}

/// How the belief is carried through a motion or a sighting.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Propagation {
    /// Along arcs, the bend of the distribution with it: the ellipse holds however long no fix comes.
    #[default]
    Honest,
    /// The published one: a Gaussian at every step, by cubature.
    Paper,
}

/// How a team fuses what its robots know of one another.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Split covariance intersection of what comes, when it comes: nobody has to be there.
    #[default]
    SplitCi,
    /// One joint filter of the team, in rounds: needs a team that can talk regularly.
    Rounds,
}

/// What the weight of split covariance intersection minimises.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Criterion {
    /// The trace of the covariance.
    #[default]
    Trace,
    /// Its determinant.
    Determinant,
}

/// Where the gate of a neighbour's pose is evaluated.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GateWeight {
    /// At the weight of the update.
    #[default]
    Update,
    /// At ½, which is valid whatever the weight.
    Half,
}

/// `[history]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct History {
    /// A measurement older than this is rejected; at least a tick's period, since a tick takes in what came since the last one
    /// \[s\].
    #[schemars(range(max = 60), extend("exclusiveMinimum" = 0))]
    pub length_s: f64,
    /// A measurement further ahead of the clock than this is rejected \[s\].
    #[schemars(range(min = 0, max = 1))]
    pub future_tolerance_s: f64,
    /// Measurements that fit: at least two for every tick of `length_s`, and no more than a tick can apply again in a
    /// quarter of its period when one comes late, which takes 450 ns each; reserved at start.
    #[schemars(range(min = 64, max = 4096))]
    pub capacity: usize,
}

/// `[health]`: a source is stale when its newest sample is older at a tick than this \[s\] and, but for wheels, than 2.5 of its own
/// intervals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Health {
    /// Wheels \[s\].
    #[schemars(range(min = 1e-3, max = 60))]
    pub odometry_stale_s: f64,
    /// Own sightings of other robots \[s\].
    #[schemars(range(min = 1e-3, max = 3600))]
    pub relative_pose_stale_s: f64,
    /// Satellite fixes, headings, and poses that a map says \[s\].
    #[schemars(range(min = 1e-3, max = 3600))]
    pub position_stale_s: f64,
    /// Poses from neighbours \[s\].
    #[schemars(range(min = 1e-3, max = 3600))]
    pub neighbours_stale_s: f64,
    /// The estimate is called fit to drive on while σ of the position, in its worst direction, is at most this \[m\]; 0 asks
    /// for nothing.
    #[schemars(range(min = 0, max = 1e6))]
    pub fit_position_m: f64,
    /// The same for the heading \[rad\].
    #[schemars(range(min = 0, max = 1e6))]
    pub fit_heading_rad: f64,
}

/// `[realtime]`
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Realtime {
    /// Scheduling class of the tick's thread.
    pub scheduler: Scheduler,
    /// Priority within `fifo` and `rr`.
    #[schemars(range(min = 1, max = 99))]
    pub priority: u8,
    /// Processors that the tick's thread may run on, as in `[3]`; empty is any.
    #[schemars(inner(range(max = 1023)))]
    pub cpus: Vec<usize>,
    /// Keep all memory resident (`mlockall`).
    pub lock_memory: bool,
    /// Stack of the tick's thread, touched before the first tick \[KiB\].
    #[schemars(range(min = 16, max = 6144))]
    pub prefault_stack_kib: usize,
    /// Exit when any of this is refused, rather than going on with a warning.
    pub required: bool,
}

/// Scheduling classes.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scheduler {
    /// `SCHED_FIFO`: the tick runs whenever it is due.
    #[default]
    Fifo,
    /// `SCHED_RR`: the same, in turns with others of its priority.
    Rr,
    /// `SCHED_OTHER`: nothing is asked for.
    Other,
}

/// `[telemetry]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Telemetry {
    /// Least severe level that is logged.
    pub log: LogLevel,
    /// Where logs go; empty: standard error. A relative path begins where this file is.
    pub log_file: PathBuf,
    /// Where the last belief is saved if `initial.resume`; empty: `<robot.name>.belief.toml` in the place for state. A
    /// relative path begins where this file is.
    pub state_file: PathBuf,
    /// How often it is saved, each time to the disk itself \[Hz\].
    #[schemars(range(min = 0.1, max = 100))]
    pub state_hz: f64,
    /// Where everything goes that the estimator is given and answers, tick by tick, as lines of JSON; empty: nowhere. If
    /// the file is there, `.1` and so on behind its name. A relative path begins where this file is.
    pub record: PathBuf,
    /// The watchdog speaks up when no tick was seen for so many periods.
    #[schemars(range(min = 2, max = 1_000_000))]
    pub watchdog_ticks: u32,
}

/// Severities of a log line.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LogLevel {
    /// What ends or stops something.
    Error,
    /// What a person should look at.
    Warn,
    /// What happens seldom and is as it should be.
    #[default]
    Info,
    /// What helps to find a fault.
    Debug,
    /// Everything.
    Trace,
}
