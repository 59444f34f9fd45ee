//! Where landmarks stand, from a drive with fixes: joint least squares over the path, the landmarks and the slow errors of the sensors.
//!
//! ```text
//! wheels, fixes, sightings ──► nodes (path) ──► equations (model) ──► normal equations, by Schur complement (normal) ──► places, ellipses
//!                                                     ▲                        │
//!                                                     └── weights, what is off ┘
//! ```
//!
//! What a sensor errs by about all that is in an image, and a receiver, are states along the path, so that what is the same for seconds is
//! not counted as often as it was said; what the sensor errs by for the whole drive about all landmarks is sought beside their places. What it
//! errs by about one landmark alone is no state: sightings that share it count together for what their mean is worth,
//!
//! ```text
//! variance of one in the equations = white + (own² + stays²) Σ exp(−|Δt| / τ), over all sightings of its landmark
//! ```
//!
//! and the covariance of a landmark's place grows by `A diag(stays²) Aᵀ`, `A = (Σ JᵀWJ)⁻¹ Σ JᵀWH`: how its place follows an error that stays,
//! with `J` the slope of a sighting by the place, `H` that by the error, and `W` its weight. Seen from all sides, the `JᵀWH` cancel. What is
//! far off loses its weight at first, and is left out at last.

mod fit;
mod model;
mod normal;
mod path;

use std::fmt;

use nalgebra::{Matrix2, Matrix3};

pub use fit::survey;

/// What the wheels said of an interval.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Leg {
    /// Where it begins \[s\].
    pub start_s: f64,
    /// Where it ends \[s\].
    pub end_s: f64,
    /// Ahead, to the left, turn \[m/s, m/s, rad/s\].
    pub velocity: [f64; 3],
    /// What noise adds in each second to the covariance of way and turn \[m², m·rad, rad² in a second\].
    pub noise_per_s: Matrix3<f64>,
}

/// A fix.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Fix {
    /// \[s\]
    pub stamp_s: f64,
    /// \[m\]
    pub position: [f64; 2],
    /// Of what is new in it \[m²\].
    pub covariance: Matrix2<f64>,
    /// Where the antenna is in the body frame \[m\].
    pub lever: [f64; 2],
}

/// A landmark, by range and bearing.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sighting {
    /// \[s\]
    pub stamp_s: f64,
    /// Its number.
    pub landmark: u16,
    /// \[m\]
    pub range_m: f64,
    /// From ahead to the left, whichever way the sensor is turned \[rad\].
    pub bearing_rad: f64,
    /// Where the sensor is in the body frame \[m\].
    pub mount: [f64; 2],
    /// Variances of what is new in it \[m², rad²\].
    pub white: [f64; 2],
}

/// An error that stays for a while.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Slow {
    /// Standard deviation; 0: there is none.
    pub sigma: f64,
    /// How long it lasts \[s\].
    pub time_s: f64,
}

/// All that is known of a drive. Everything in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Journey {
    /// Of the wheels.
    pub legs: Vec<Leg>,
    /// Of one receiver.
    pub fixes: Vec<Fix>,
    /// Of one sensor.
    pub sightings: Vec<Sighting>,
    /// Slow errors that are the same for all in an image: of the range, as a part of it, and of the bearing \[rad\].
    pub sighting_slow: [Slow; 2],
    /// Slow errors about each landmark its own, beside those that are the same for all in an image: standard deviations, as a part of the
    /// range and of the bearing \[rad\]. They last as long.
    pub own: [f64; 2],
    /// Errors that stay for the whole drive, about each landmark its own: standard deviations, as a part of the range and of the bearing
    /// \[rad\].
    pub stays: [f64; 2],
    /// Slow error of the fixes, of each coordinate \[m\].
    pub fix_slow: Slow,
    /// Where it was believed to be, `[x, y, φ]` by time \[s\]: where the search begins.
    pub believed: Vec<(f64, [f64; 3])>,
}

/// What is enough.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Enough {
    /// So many sightings at least that agree.
    pub sightings: usize,
    /// In so many spells at least, each as long as a slow error lasts.
    pub spells: usize,
    /// The ellipse's longer half axis, σ, at most \[m\].
    pub sigma_m: f64,
    /// This part of its sightings may be far off.
    pub stray: f64,
}

impl Default for Enough {
    fn default() -> Self {
        Self {
            sightings: 10,
            spells: 3,
            sigma_m: 0.25,
            stray: 0.3,
        }
    }
}

/// Why a landmark is not to be used.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Unfit {
    /// Too few sightings that agree.
    Few {
        /// So many there are.
        sightings: usize,
        /// So many are needed.
        needed: usize,
    },
    /// All within too short a time.
    Brief {
        /// In so many spells it was seen.
        spells: usize,
        /// So many are needed.
        needed: usize,
    },
    /// Too many sightings are far off.
    Stray {
        /// This part of them.
        part: f64,
    },
    /// It is not known well enough.
    Vague {
        /// σ \[m\]
        sigma_m: f64,
    },
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Few { sightings, needed } => {
                write!(f, "{sightings} sightings agree, {needed} are needed")
            }
            Self::Brief { spells, needed } => write!(
                f,
                "seen in {spells} spells only, {needed} are needed: the sensor's error was the same in all of each"
            ),
            Self::Stray { part } => write!(
                f,
                "{:.0} % of its sightings are elsewhere: was it moved, or are there two with its number?",
                100.0 * part
            ),
            Self::Vague { sigma_m } => write!(f, "known to ± {sigma_m:.2} m only"),
        }
    }
}

/// A landmark, as it was found.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Found {
    /// Its number.
    pub landmark: u16,
    /// Where it is \[m\].
    pub position: [f64; 2],
    /// Of that \[m²\].
    pub covariance: Matrix2<f64>,
    /// Sightings that agree, and those that are far off.
    pub sightings: [usize; 2],
    /// Why it is not to be used; nothing: it is.
    pub unfit: Option<Unfit>,
}

impl Found {
    /// σ along the longer axis of its ellipse \[m\].
    #[must_use]
    pub fn sigma_m(&self) -> f64 {
        self.covariance
            .symmetric_eigenvalues()
            .max()
            .max(0.0)
            .sqrt()
    }
}

/// What a drive says of landmarks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// By their numbers.
    pub landmarks: Vec<Found>,
    /// By so much what is new in sightings, and in fixes, was larger than they said; σ, 1 at least.
    pub larger: [f64; 2],
    /// Fixes that are far off.
    pub stray_fixes: usize,
}

/// Why there is none.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoSurvey {
    /// Nothing says where in the world it was.
    #[error(
        "{0} fixes: ten at least are needed, or nothing says where in the world the landmarks are"
    )]
    Fixes(usize),
    /// Nothing was seen.
    #[error(
        "no landmark was seen by range and bearing: is each of them listed as [[landmark]], and [sighting] heard = true?"
    )]
    Sightings,
    /// Not believed to be anywhere.
    #[error("the drive does not say where the robot believed to be")]
    Path,
    /// Numbers that belong to no drive.
    #[error("the equations have no solution: the drive's numbers contradict one another")]
    Unsolvable,
}
