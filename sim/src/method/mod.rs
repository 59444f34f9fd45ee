//! The estimators under comparison. They share the inputs, the fixes and the gates, and the rivals the paper's propagation and
//! conversion of sightings, so that what differs is the fusion. `coloc` carries the bend of its beliefs beside ([`honest`](coloc_estimator::honest)).
//!
//! | name | what a robot does with a pose received from a neighbour |
//! | --- | --- |
//! | `sl` | ignores it: prediction and own fixes |
//! | `sl-plain` | the same with plain integration of the mean instead of the cubature mean |
//! | `nb` | naive Bayes: takes it as independent, Kalman update |
//! | `ei` | ellipsoidal intersection ([`ellipsoidal`]) |
//! | `ci`, `ci-det` | covariance intersection, weight by trace or determinant |
//! | `split-ci` | split covariance intersection, the paper to the letter |
//! | `damped` | the same with β = 0.2 and reset on transmit: a reference point |
//! | `coloc` | the same with a memory and a trace in m² too: the product's default |
//! | `coloc-step` | the product's `step` with its history, message by message: the bits of the daemon |
//! | `leader-kf`, `leader-split`, `leader-cross` | ignores it: robots with a receiver tell all others, also those that they do not see ([`leader`]) |
//! | `ccl` | no messages: one extended Kalman filter of the whole team ([`joint`]) |
//! | `rounds`, `rounds-5` | no poses: the same in rounds at 2 and 5 Hz, own fixes silent ([`rounds`](crate::rounds)) |
//! | `rounds-step`, `rounds-step-5` | the same through the product's `step` and what `coloc-rounds` does ([`Flight`]) |
//! | `dkf` | the same, distributed to the letter: factors of the cross-covariances, three rounds of messages ([`dkf`](crate::dkf)) |

pub mod ellipsoidal;
pub mod joint;
pub mod leader;
pub mod plain;
pub mod rule;
pub mod stepwise;
pub mod team;
pub mod wheels;

use coloc_estimator::noise::{OdometryNoise, Variance};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Motion, Pose, Propagation, Settings, Stamp, propagate,
};
use nalgebra::Matrix3;
use serde::Serialize;

use crate::random::Noise;
use crate::rounds::{Crew, Flight, Plan};
use crate::scenario::{Odometry, Radio, Scenario};
use crate::sensors::StepInputs;
use rule::Rule;

/// Which estimator.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Single localization.
    Sl,
    /// Single localization by plain integration.
    SlPlain,
    /// Naive Bayes.
    Nb,
    /// Ellipsoidal intersection.
    Ei,
    /// Covariance intersection by trace.
    Ci,
    /// Covariance intersection by determinant.
    CiDet,
    /// Split covariance intersection, the paper's.
    SplitCi,
    /// Split covariance intersection with a fixed damping.
    Damped,
    /// The product's default.
    Coloc,
    /// The product's default through its `step`.
    ColocStep,
    /// Leaders and children, the thesis's fusion.
    LeaderKf,
    /// The same by split covariance intersection.
    LeaderSplit,
    /// The same with the correlation tracked.
    LeaderCross,
    /// Centralized.
    Ccl,
    /// The same, distributed.
    Dkf,
    /// The same, in rounds at 2 Hz.
    Rounds,
    /// In rounds at 5 Hz.
    Rounds5,
    /// In rounds at 2 Hz, as it flies.
    RoundsStep,
    /// In rounds at 5 Hz, as it flies.
    RoundsStep5,
}

impl Kind {
    /// Every estimator.
    pub const ALL: [Self; 19] = [
        Self::Sl,
        Self::SlPlain,
        Self::Nb,
        Self::Ei,
        Self::Ci,
        Self::CiDet,
        Self::SplitCi,
        Self::Damped,
        Self::Coloc,
        Self::ColocStep,
        Self::LeaderKf,
        Self::LeaderSplit,
        Self::LeaderCross,
        Self::Ccl,
        Self::Dkf,
        Self::Rounds,
        Self::Rounds5,
        Self::RoundsStep,
        Self::RoundsStep5,
    ];

    /// What the command line calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sl => "sl",
            Self::SlPlain => "sl-plain",
            Self::Nb => "nb",
            Self::Ei => "ei",
            Self::Ci => "ci",
            Self::CiDet => "ci-det",
            Self::SplitCi => "split-ci",
            Self::Damped => "damped",
            Self::Coloc => "coloc",
            Self::ColocStep => "coloc-step",
            Self::LeaderKf => "leader-kf",
            Self::LeaderSplit => "leader-split",
            Self::LeaderCross => "leader-cross",
            Self::Ccl => "ccl",
            Self::Dkf => "dkf",
            Self::Rounds => "rounds",
            Self::Rounds5 => "rounds-5",
            Self::RoundsStep => "rounds-step",
            Self::RoundsStep5 => "rounds-step-5",
        }
    }

    /// What it is, in a line.
    #[must_use]
    pub fn description(self) -> &'static str {
        match self {
            Self::Sl => "single localization: odometry and own fixes only",
            Self::SlPlain => {
                "the same by plain integration instead of cubature, as in the paper's figures"
            }
            Self::Nb => "naive Bayes: takes what neighbours say as independent",
            Self::Ei => "ellipsoidal intersection",
            Self::Ci => "covariance intersection, weight by trace: takes nothing as independent",
            Self::CiDet => "covariance intersection, weight by determinant",
            Self::SplitCi => "split covariance intersection, the paper to the letter",
            Self::Damped => "the same with a fixed damping of 0.2 and reset on transmit",
            Self::Coloc => {
                "the product's default: damped to a memory of 1 s, a trace in m², reset on transmit"
            }
            Self::ColocStep => "the same through the daemon's step and its history of measurements",
            Self::LeaderKf => {
                "robots with a receiver lead: they tell all others where they are, by what others see too"
            }
            Self::LeaderSplit => "the same, the leader's error bounded",
            Self::LeaderCross => "the same, the correlation with the leader's error tracked",
            Self::Ccl => {
                "centralized: one extended Kalman filter of the whole team, a bound for the others"
            }
            Self::Dkf => {
                "the same, distributed to the letter (Roumeliotis and Bekey): three rounds of messages an update"
            }
            Self::Rounds => {
                "the same in rounds at 2 Hz over a network that loses, own fixes between them"
            }
            Self::Rounds5 => "the same in rounds at 5 Hz",
            Self::RoundsStep => {
                "rounds at 2 Hz through the daemon's step, its history and coloc-rounds' part"
            }
            Self::RoundsStep5 => "the same at 5 Hz",
        }
    }

    /// What one message holds, at eight bytes a number: pose and covariances as upper triangles; for `ccl` the
    /// relative pose, which goes to the centre (as does all odometry, not counted).
    #[must_use]
    pub fn message_bytes(self) -> usize {
        match self {
            // All but the first two count what they send.
            Self::Sl
            | Self::SlPlain
            | Self::Dkf
            | Self::Rounds
            | Self::Rounds5
            | Self::RoundsStep
            | Self::RoundsStep5 => 0,
            Self::Nb | Self::Ei | Self::Ci | Self::CiDet | Self::LeaderKf => 8 * (3 + 6),
            Self::SplitCi | Self::Damped | Self::Coloc | Self::ColocStep | Self::LeaderSplit => {
                8 * (3 + 6 + 6)
            }
            // The leader's own pose, its covariance and eight transitions too, those of four bytes a number.
            Self::LeaderCross => 8 * (3 + 6 + 6 + 3 + 6) + 4 * (8 * 9),
            Self::Ccl => 8 * 3,
        }
    }

    /// The estimator of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// What all estimators are told about the sensors, and how the product's are set.
#[derive(Clone, Debug)]
pub struct FilterSettings {
    /// Length of a step \[s\].
    pub dt_s: f64,
    /// Q as a function of the velocity.
    pub odometry: OdometryNoise,
    /// R of relative poses.
    pub relative: Covariance3,
    /// `R_A` of fixes.
    pub fix: Covariance2,
    /// Gates, holding of odometry, and how `coloc` fuses.
    pub product: Settings,
    /// The longest that a message is under way \[steps\].
    pub longest_delay: usize,
    /// Robots that have a receiver.
    pub receivers: Vec<usize>,
    /// `rounds` at another rate than 2 Hz \[Hz\].
    pub rounds_hz: Option<f64>,
    /// What happens to messages of methods that have a network of their own …
    pub radio: Radio,
    /// … and its chance.
    pub noise: Noise,
}

impl FilterSettings {
    /// Filters that know the scenario's sensors, and its odometry up to the scenario's error.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few steps.
    pub fn new(scenario: &Scenario, dt_s: f64) -> Self {
        let variances = scenario.sightings.sigma.map(|sigma| sigma * sigma);
        let fix = scenario.fixes.sigma_m * scenario.fixes.sigma_m;
        Self {
            dt_s,
            odometry: scaled(scenario.odometry.noise(), scenario.noise_factor),
            relative: Covariance3::diagonal(variances).unwrap_or_default(),
            fix: Covariance2::diagonal([fix, fix]).unwrap_or_default(),
            product: Settings::default(),
            longest_delay: (scenario.radio.delay_s[1] / dt_s).ceil() as usize,
            receivers: scenario.fixes.robots.clone(),
            rounds_hz: None,
            radio: scenario.radio,
            noise: Noise::new(1, 0),
        }
    }
}

impl Odometry {
    /// Per sample of 50 Hz.
    #[must_use]
    pub fn noise(self) -> OdometryNoise {
        let constant = |a| Variance {
            a,
            ..Variance::default()
        };
        let paper = OdometryNoise::paper();
        match self {
            Self::Paper => paper,
            Self::Slip => OdometryNoise {
                forward: Variance {
                    a: 5e-3,
                    ..paper.forward
                },
                sideways: constant(1e-3),
                ..paper
            },
        }
    }
}

impl FilterSettings {
    /// `belief` after a step of `motion`.
    #[must_use]
    pub(crate) fn propagated(&self, belief: &Belief, motion: &Motion) -> Belief {
        propagate(belief, motion, self.dt_s, self.product.propagation)
    }

    /// The same with the paper's propagation: the rivals' own.
    fn on_paper(&self) -> Self {
        let product = Settings {
            propagation: Propagation::Paper,
            ..self.product
        };
        Self {
            product,
            ..self.clone()
        }
    }

    /// The stamp of `step`.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // Milliseconds, whole; steps below 2^40.
    pub fn stamp(&self, step: usize) -> Stamp {
        Stamp::from_nanos(step as i64 * (self.dt_s * 1e9).round() as i64)
    }
}

fn scaled(noise: OdometryNoise, factor: f64) -> OdometryNoise {
    let scale = |v: coloc_estimator::noise::Variance| coloc_estimator::noise::Variance {
        a: v.a * factor,
        b: v.b * factor,
        c: v.c * factor,
        per_speed: v.per_speed * factor,
        per_turn_rate: v.per_turn_rate * factor,
    };
    OdometryNoise {
        forward: scale(noise.forward),
        sideways: scale(noise.sideways),
        turning: scale(noise.turning),
    }
}

/// The sensor that an innovation belongs to.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Another robot: a pose received, or in `ccl` the relative pose itself.
    Neighbour,
    /// The satellites.
    Fix,
}

/// What became of a measurement.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Innovation {
    /// Which sensor.
    pub sensor: Sensor,
    /// Whose estimate it was to improve.
    pub robot: usize,
    /// Whether it passed the gate.
    pub accepted: bool,
    /// Normalised innovation squared.
    pub d2: f64,
}

/// The estimators of a whole team.
pub trait Method {
    /// Goes on to `inputs.step`, and tells every innovation when it is first seen.
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation));
    /// Where `robot` is believed to be, and P.
    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>);
    /// What was sent so far, of methods that count it themselves; else it is a message of [`Kind::message_bytes`] for each sighting.
    fn sent(&self) -> Option<Sent> {
        None
    }
}

/// Messages.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// How many; one to everybody counts once.
    pub messages: u64,
    /// Of all together.
    pub bytes: u64,
}

/// The estimator `kind` of a team that begins at `initial`.
#[must_use]
pub fn build(kind: Kind, settings: &FilterSettings, initial: &[Belief]) -> Box<dyn Method + Send> {
    let on_paper = settings.on_paper();
    let team = |rule| Box::new(team::Team::new(rule, on_paper.clone(), initial));
    let leaders = |fusion| Box::new(leader::Leaders::new(fusion, settings.clone(), initial));
    match kind {
        Kind::Sl => team(Rule::Single),
        Kind::SlPlain => Box::new(plain::Plain::new(settings.clone(), initial)),
        Kind::Nb => team(Rule::naive(&settings.product)),
        Kind::Ei => team(Rule::ellipsoidal(&settings.product)),
        Kind::Ci => team(Rule::intersection(
            &settings.product,
            coloc_estimator::settings::Criterion::Trace,
        )),
        Kind::CiDet => team(Rule::intersection(
            &settings.product,
            coloc_estimator::settings::Criterion::Determinant,
        )),
        Kind::SplitCi => team(Rule::paper(&settings.product)),
        Kind::Damped => team(Rule::damped(&settings.product)),
        Kind::Coloc => Box::new(team::Team::new(
            Rule::Split(settings.product.fusion),
            settings.clone(),
            initial,
        )),
        Kind::ColocStep => Box::new(stepwise::Stepwise::new(settings.clone(), initial)),
        Kind::LeaderKf => leaders(leader::Fusion::Kalman),
        Kind::LeaderSplit => leaders(leader::Fusion::Split),
        Kind::LeaderCross => leaders(leader::Fusion::Default),
        Kind::Ccl => Box::new(joint::Joint::new(settings.clone(), initial)),
        Kind::Dkf => Box::new(crate::dkf::Dkf::new(settings.clone(), initial)),
        Kind::Rounds => Box::new(Crew::new(
            settings.clone(),
            initial,
            Plan::at(settings.rounds_hz.unwrap_or(2.0)),
        )),
        Kind::Rounds5 => Box::new(Crew::new(settings.clone(), initial, Plan::at(5.0))),
        Kind::RoundsStep => Box::new(Flight::new(settings.clone(), initial, Plan::at(2.0))),
        Kind::RoundsStep5 => Box::new(Flight::new(settings.clone(), initial, Plan::at(5.0))),
    }
}
