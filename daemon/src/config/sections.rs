//! The sections of `robot.toml`, each with its defaults. `daemon/robot.toml` shows them all with comments.

use std::path::PathBuf;

use coloc_shm_types::RobotName;
use serde::{Deserialize, Deserializer, de::Error};

/// `[robot]`: who this robot is.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Part of its service names: `coloc/<name>/estimate`.
    #[serde(deserialize_with = "robot_name")]
    pub name: RobotName,
    /// Its number in the team.
    pub id: u16,
}

/// `[[team]]`: a robot of the team.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// As in that robot's own `[robot]`.
    #[serde(deserialize_with = "robot_name")]
    pub name: RobotName,
    /// As in that robot's own `[robot]`.
    pub id: u16,
}

fn robot_name<'de, D: Deserializer<'de>>(value: D) -> Result<RobotName, D::Error> {
    RobotName::new(&String::deserialize(value)?).map_err(D::Error::custom)
}

/// `[clock]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Clock {
    /// The clock of every stamp; robots that talk to one another must share one.
    pub source: ClockSource,
    /// A jump of the kernel's frame stamps against `source` between two ticks beyond this is a clock step \[s\].
    pub step_s: f64,
}

/// Clocks that stamps can be of.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClockSource {
    /// `CLOCK_REALTIME`: shared by machines that run NTP or PTP; leaps.
    #[default]
    Realtime,
    /// `CLOCK_TAI`: the same without leap seconds.
    Tai,
    /// `CLOCK_MONOTONIC`: never steps; for robots on one machine.
    Monotonic,
}

/// `[tick]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tick {
    /// Ticks per second.
    pub rate_hz: f64,
    /// What starts a tick.
    pub trigger: Trigger,
    /// How it is waited for.
    pub wait: WaitMode,
}

/// What starts a tick.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Trigger {
    /// Absolute deadlines on `CLOCK_MONOTONIC`; frames wait for the next one.
    #[default]
    Timer,
    /// A frame's arrival; the timer is the fallback when frames stop.
    Encoder,
}

/// How the tick's thread waits.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WaitMode {
    /// In the kernel, leaving the processor to others.
    #[default]
    Sleep,
    /// Asking again and again: the fastest, for a processor of its own at ordinary priority.
    Poll,
}

/// `[shm]`
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shm {
    /// Directory for the middleware's files; every program that is to meet names the same. If empty it is
    /// `/run/coloc`, or `$XDG_RUNTIME_DIR/coloc` for a user who cannot make that.
    pub root: PathBuf,
    /// First letters of every file in `/dev/shm`.
    pub prefix: String,
}

/// `[motion]`: noise of an odometry sample, `σ² = a + b v² + c ω²`, and what happens without one.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Motion {
    /// Of the forward velocity \[m²/s²\].
    pub forward: Variance,
    /// Of the sideways velocity \[m²/s²\]; robots without sideways velocity do not use it.
    pub sideways: Variance,
    /// Of the turning rate \[rad²/s²\].
    pub turning: Variance,
    /// The sample period for which these variances are stated \[s\]; other intervals are scaled as white noise.
    pub reference_period_s: f64,
    /// How long the last velocity is held when samples stop \[s\].
    pub hold_s: f64,
    /// Growth of the noise per reference period held.
    pub hold_growth: f64,
    /// Variances `[v_x, v_y, ω]` per reference period after that, the velocity being taken as zero.
    pub outage_variance: [f64; 3],
}

/// Coefficients of `σ² = a + b v² + c ω²`.
#[derive(Copy, Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Variance {
    /// At standstill.
    pub a: f64,
    /// Per (m/s)².
    pub b: f64,
    /// Per (rad/s)².
    pub c: f64,
}

/// `[initial]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Initial {
    /// `[x, y, φ]` in the common frame \[m, m, rad\].
    pub pose: [f64; 3],
    /// Standard deviations of `pose` \[m, m, rad\].
    pub sigma: [f64; 3],
    /// Go on from the last belief that was saved, inflated by the time since, where there is one.
    pub resume: bool,
    /// A saved belief older than this is not used \[s\].
    pub resume_max_age_s: f64,
}

/// `[fusion]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Fusion {
    /// The published algorithm to the letter: overrides `heading_lever_m` (1), `damping` (1),
    /// `memory_s` (0), `reset_on_transmit` (false) and `gate_weight`.
    pub paper: bool,
    /// What the weight minimises.
    pub criterion: Criterion,
    /// In the trace a radian counts as that many metres \[m\].
    pub heading_lever_m: f64,
    /// The largest β ∈ (0, 1]; 1 is the greedy weight.
    pub damping: f64,
    /// β is at most the mean interval between poses received over this; 0: always `damping` \[s\].
    pub memory_s: f64,
    /// What was sent is no longer independent.
    pub reset_on_transmit: bool,
    /// Largest normalised innovation squared of a neighbour's pose (χ², 3 degrees of freedom; 99 %).
    pub neighbour_gate: f64,
    /// The weight at which that gate is evaluated.
    pub gate_weight: GateWeight,
    /// Largest normalised innovation squared of a fix (χ², 2 degrees of freedom; 99 %).
    pub position_gate: f64,
}

/// What the weight of split covariance intersection minimises.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Criterion {
    /// tr P⁺
    #[default]
    Trace,
    /// det P⁺
    Determinant,
}

/// Where the gate of a neighbour's pose is evaluated.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GateWeight {
    /// At the weight of the update.
    #[default]
    Update,
    /// At ½, which is valid whatever the weight.
    Half,
}

/// `[history]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct History {
    /// A measurement older than this is rejected \[s\].
    pub length_s: f64,
    /// A measurement further ahead than this is rejected \[s\].
    pub future_tolerance_s: f64,
    /// Measurements that fit; reserved at start.
    pub capacity: usize,
}

/// `[health]`: a sensor is stale when its newest sample is older than this at a tick \[s\].
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Health {
    /// Wheels.
    pub odometry_stale_s: f64,
    /// Own sightings.
    pub relative_pose_stale_s: f64,
    /// Satellite fixes.
    pub position_stale_s: f64,
    /// Poses from neighbours.
    pub neighbours_stale_s: f64,
}

/// `[realtime]`
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Realtime {
    /// Scheduling class of the tick's thread.
    pub scheduler: Scheduler,
    /// Of `fifo` and `rr`.
    pub priority: u8,
    /// Processors that the tick's thread may run on; empty is any.
    pub cpus: Vec<usize>,
    /// Keep all memory resident (`mlockall`).
    pub lock_memory: bool,
    /// Stack of the tick's thread, touched before the first tick \[KiB\].
    pub prefault_stack_kib: usize,
    /// Exit when any of these is refused, rather than going on with a warning.
    pub required: bool,
}

/// Scheduling classes.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scheduler {
    /// `SCHED_FIFO`
    #[default]
    Fifo,
    /// `SCHED_RR`
    Rr,
    /// `SCHED_OTHER`: nothing is asked for.
    Other,
}

/// `[telemetry]`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Telemetry {
    /// Least severe level that is logged.
    pub log: LogLevel,
    /// Logs go here; standard error if empty.
    pub log_file: PathBuf,
    /// Where the last belief is saved if `initial.resume`; beside `shm.root`, with the robot's name, if empty.
    pub state_file: PathBuf,
    /// How often it is saved.
    pub state_hz: f64,
    /// Everything the estimator is given and answers goes here, to be gone through again; empty records nothing.
    pub record: PathBuf,
    /// The watchdog speaks when no tick was seen for as many periods.
    pub watchdog_ticks: u32,
}

/// Severities of a log line.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum LogLevel {
    Error,
    Warn,
    #[default]
    Info,
    Debug,
    Trace,
}
