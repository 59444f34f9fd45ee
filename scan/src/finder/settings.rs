//! What is asked of a sighting, and how the scanner errs.

use crate::shape::Look;

/// How the scanner errs, and how far a robot differs from what is said of it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Noise {
    /// Of each range \[m\].
    pub range_sigma_m: f64,
    /// Of each beam's angle \[rad\].
    pub angle_sigma_rad: f64,
    /// Of where a robot's surface or a mark is \[m\].
    pub shape_sigma_m: f64,
}

impl Default for Noise {
    /// A scanner of the middle class, and a robot that was measured by hand.
    fn default() -> Self {
        Self {
            range_sigma_m: 0.015,
            angle_sigma_rad: 0.001,
            shape_sigma_m: 0.005,
        }
    }
}

/// What is asked of a sighting.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What robots look like; robots say which of these by its place.
    pub looks: Vec<Look>,
    /// The errors.
    pub noise: Noise,
    /// Beyond that nothing is looked for \[m\].
    pub farthest_m: f64,
    /// So many beams at least must meet a robot.
    pub least_beams: usize,
    /// So bright is a reflective mark.
    pub bright: f32,
    /// A position with a larger σ is not said \[m\].
    pub most_sigma_m: f64,
    /// A heading with a larger σ is not said \[rad\].
    pub most_heading_sigma_rad: f64,
    /// How often something that is none of the team looks like one \[1/m²\].
    pub clutter_per_m2: f64,
    /// That a robot whose place is known is not seen.
    pub missed: f64,
    /// So sure must it be that a robot is the one that was seen.
    pub least_own: f64,
    /// So unlikely must it be that what was seen is another robot.
    pub most_others: f64,
}

impl Settings {
    /// With these looks, all else as it is by default.
    #[must_use]
    pub fn of(looks: Vec<Look>) -> Self {
        Self {
            looks,
            noise: Noise::default(),
            farthest_m: 6.5,
            least_beams: 5,
            bright: f32::INFINITY,
            most_sigma_m: 0.15,
            most_heading_sigma_rad: 0.1,
            clutter_per_m2: 0.06,
            missed: 0.2,
            least_own: 0.9,
            most_others: 1e-5,
        }
    }
}
