//! How the estimator is to behave. `Default` is coloc's own choice; [`Settings::paper`] is the paper to the letter.

use crate::assist::fusion::Rule;
use crate::found::FoundSettings;
use crate::gate::{CHI2_1_99, CHI2_2_99, CHI2_3_99};
use crate::gyro::GyroSettings;
use crate::motion::Motion;
use crate::partial::PositionSettings;
use crate::rounds::RoundSettings;
use crate::stamp::Span;

/// What the weight α of split covariance intersection minimises.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// tr P⁺
    #[default]
    Trace,
    /// det P⁺
    Determinant,
}

/// The weight at which the gate of a neighbour's pose is evaluated.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum GateWeight {
    /// The weight of the update itself: the paper's; near the ends the bound is unbounded and outliers pass.
    #[default]
    Update,
    /// α = ½: valid whatever the weight.
    Half,
}

/// Algorithm 3: how a neighbour's pose is fused.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct FusionSettings {
    /// What the weight minimises.
    pub criterion: Criterion,
    /// L \[m\]: the trace is that of `diag(1, 1, L²) P⁺`, square metres where a neighbour L away is seen from here: how far off this
    /// robot would put it counts as much as where itself is. 1 adds m² and rad² as the paper does; the determinant does not depend on it.
    pub heading_lever_m: f64,
    /// β ∈ (0, 1]: the weight used is `1 − β (1 − α*)`. 1 is the paper's greedy weight.
    pub damping: f64,
    /// τ: in the history β is at most the mean interval between the poses received over this ([`crate::pace`]). Zero: always β.
    pub memory: Span,
    /// Also move `P_i` into `P_d` when a pose was sent, not only when one was received.
    pub reset_on_transmit: bool,
    /// What is told of a sighting counts all of its noise as independent ([`crate::convert::tell`]). Else what an uncertain heading
    /// does to that noise is dependent, as all other curvature is. The cubature transform counts it as independent anyway.
    pub sighting_noise_is_own: bool,
    /// Accept if d² is at most this (χ² with three degrees of freedom); infinite accepts everything.
    pub gate: f64,
    /// Where the gate is evaluated.
    pub gate_weight: GateWeight,
}

/// How a belief is carried through a motion or a sighting.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Propagation {
    /// Along arcs, with the bend of the distribution carried ([`crate::honest`]): the covariance holds however long no
    /// measurement comes and however uncertain the heading is.
    #[default]
    Honest,
    /// The paper's letter: along the heading at the start, a Gaussian made at every step by one cubature transform for the
    /// covariance and one for its independent part.
    Paper,
}

/// How the estimate goes on between and after odometry samples.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct OdometrySettings {
    /// The sample period for which every [`crate::Motion`]'s noise Q is stated. Over `dt` the noise used is
    /// `Q · reference_period / dt`: white noise, whatever way the time is cut; exactly Q where `dt` is the period.
    pub reference_period: Span,
    /// How long the last velocity is held beyond its stamp, its noise growing linearly with the time held.
    pub hold: Span,
    /// Growth of the held noise per reference period: over a stretch of time it is `Q · (1 + growth · t/T)`, with t the
    /// mean time held and T the reference period.
    pub hold_growth: f64,
    /// Noise variances `[v_x, v_y, ω]` per reference period once the velocity is taken as zero.
    pub outage_variance: [f64; 3],
}

/// No source is more certain than this, whatever it says: variances below these are raised to them. Zero: no floor.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Floors {
    /// Own sightings `[x, y, φ]` \[m², m², rad²\].
    pub sighting: [f64; 3],
    /// Neighbours' poses, and those that a person or a map says, `[x, y, φ]` \[m², m², rad²\].
    pub neighbour: [f64; 3],
    /// Position fixes `[x, y]` \[m²\].
    pub fix: [f64; 2],
    /// Headings \[rad²\].
    pub heading: f64,
}

/// All settings of one estimator.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Settings {
    /// Algorithms 1 and 2.
    pub propagation: Propagation,
    /// Algorithm 3.
    pub fusion: FusionSettings,
    /// How what says a part only is fused ([`crate::partial`]).
    pub partial: PositionSettings,
    /// How what a leader says is fused ([`crate::assist`]).
    pub assist: Rule,
    /// Accept a fix if d² is at most this (χ² with two degrees of freedom).
    pub position_gate: f64,
    /// Accept a heading if d² is at most this (χ² with one degree of freedom).
    pub heading_gate: f64,
    /// A robot that does not know where it is, or no longer.
    pub found: FoundSettings,
    /// What is not believed to be better.
    pub floors: Floors,
    /// Between the samples.
    pub odometry: OdometrySettings,
    /// Beside the wheels, if there is a gyro. With [`Propagation::Paper`] it is not used.
    pub gyro: Option<GyroSettings>,
    /// Where the robot may take part in its team's rounds ([`crate::rounds`]). With [`Propagation::Paper`], and beside a gyro, it does not.
    pub rounds: Option<RoundSettings>,
    /// A measurement older than the tick by more than this is rejected as too old.
    pub history: Span,
    /// A measurement stamped after the tick by more than this is rejected as from the future.
    pub future_tolerance: Span,
}

impl FusionSettings {
    /// The paper to the letter: greedy weight of m² and rad², `P_i` moved on receipt only.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            heading_lever_m: 1.0,
            damping: 1.0,
            memory: Span::ZERO,
            reset_on_transmit: false,
            sighting_noise_is_own: false,
            ..Self::default()
        }
    }
}

impl Default for FusionSettings {
    fn default() -> Self {
        Self {
            criterion: Criterion::Trace,
            heading_lever_m: 4.0,
            damping: 0.5,
            memory: Span::from_millis(1000),
            reset_on_transmit: true,
            sighting_noise_is_own: true,
            gate: CHI2_3_99,
            gate_weight: GateWeight::Update,
        }
    }
}

/// 50 Hz; a velocity is held for ten samples, then taken as zero with what Table 2 gives for 1 m/s.
impl Default for OdometrySettings {
    fn default() -> Self {
        Self {
            reference_period: Span::from_millis(20),
            hold: Span::from_millis(200),
            hold_growth: 0.5,
            outage_variance: [5.075, 5.075, 0.345],
        }
    }
}

impl OdometrySettings {
    /// `motion` with the noise that it has over `span`, measured: Q · T/dt, exactly Q for a whole period.
    #[inline]
    pub(crate) fn measured(&self, motion: &Motion, span: Span) -> Motion {
        motion.with_noise_scaled(self.reference_period.as_seconds() / span.as_seconds())
    }
}

impl Settings {
    /// The gyro's, where it is used.
    #[inline]
    pub(crate) fn gyro(&self) -> Option<&GyroSettings> {
        match self.propagation {
            Propagation::Honest => self.gyro.as_ref(),
            Propagation::Paper => None,
        }
    }

    /// How it takes part in rounds, if it may.
    #[inline]
    pub(crate) fn rounds(&self) -> Option<&RoundSettings> {
        match self.propagation {
            Propagation::Honest if self.gyro.is_none() => self.rounds.as_ref(),
            _ => None,
        }
    }

    /// The paper to the letter ([`Propagation::Paper`], [`FusionSettings::paper`]).
    #[must_use]
    pub fn paper() -> Self {
        Self {
            propagation: Propagation::Paper,
            fusion: FusionSettings::paper(),
            partial: PositionSettings::paper(),
            assist: Rule::paper(),
            found: FoundSettings::OFF,
            ..Self::default()
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            propagation: Propagation::default(),
            fusion: FusionSettings::default(),
            partial: PositionSettings::default(),
            assist: Rule::default(),
            position_gate: CHI2_2_99,
            heading_gate: CHI2_1_99,
            found: FoundSettings::default(),
            floors: Floors::default(),
            odometry: OdometrySettings::default(),
            gyro: None,
            rounds: None,
            history: Span::from_millis(1000),
            future_tolerance: Span::from_millis(100),
        }
    }
}
