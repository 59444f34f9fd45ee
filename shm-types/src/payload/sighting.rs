//! A robot's sighting of another, or of a landmark, that says a part only.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::all_zero;
use crate::{Limits, Reject};

/// `coloc/<robot>/sighting`: what a sensor of this robot sees of another one, or of a landmark, by range and bearing or by one of the
/// two.
///
/// The sensor's model, in its own frame: `range = r (1 + s) + n`, `bearing = azimuth + b + n`, the n new in every sighting, s and b
/// slow: for seconds the same, and for all that is seen in one image.
///
/// What `has` does not name is zero, and read by nobody: no huge variance stands for "unknown".
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Sighting.v1")]
pub struct Sighting {
    /// When it was seen (the moment of the exposure, the sensor's latency already taken off), by which clock, and which sensor saw it.
    pub header: Header,
    /// Number of the robot, in the team, or of the landmark, in the configuration, that was seen.
    pub observed: u16,
    /// What was measured: [`Self::RANGE`], [`Self::BEARING`], or both.
    pub has: u8,
    /// What was seen: [`Self::UNKNOWN`], [`Self::ROBOT`] or [`Self::LANDMARK`]; [`Self::PASSED_ON`] is `coloc-track`'s alone.
    pub who: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 4],
    /// From the sensor (m).
    pub range: f64,
    /// From the sensor's own axis, counter-clockwise seen from above (rad).
    pub bearing: f64,
    /// Variances of what is new in every sighting, of range and bearing (m², rad²).
    pub white: [f64; 2],
    /// Of what is slow: σ of s, how long that lasts, σ of b, how long that lasts (1, s, rad, s). σ = 0: there is none.
    pub slow: [f64; 4],
    /// Where the sensor is on the body: `[x, y, φ]` (m, m, rad). All zero: as the robot's configuration has it.
    pub mount: [f64; 3],
}

layout!(Sighting, 136; header: 0, observed: 40, has: 42, who: 43, reserved: 44, range: 48, bearing: 56, white: 64, slow: 80, mount: 112);

impl Sighting {
    /// In `has`: there is a range.
    pub const RANGE: u8 = 1;
    /// In `has`: there is a bearing.
    pub const BEARING: u8 = 2;

    /// `who` of a robot that the sensor cannot name: for `coloc-track` alone, and of range and bearing alone.
    pub const UNKNOWN: u8 = 0;
    /// `who` of a robot of the team.
    pub const ROBOT: u8 = 1;
    /// `who` of a landmark of the configuration.
    pub const LANDMARK: u8 = 2;
    /// `who` of a robot of the team whose sighting `coloc-track` has looked at and passes on, with the header that it had: for a `colocd`
    /// that hears of other robots by way of it.
    pub const PASSED_ON: u8 = 3;

    /// Checks everything that can be known of this message alone. The angle may be any finite number. Which landmarks there are is for
    /// the receiver to know.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        self.check(limits, matches!(self.who, Self::ROBOT | Self::LANDMARK))
    }

    /// [`Self::validate`], of who also takes in robots that have no name, and no landmarks.
    ///
    /// # Errors
    /// Likewise.
    pub fn validate_of_robot(&self, limits: &Limits) -> Result<(), Reject> {
        let is_whole = self.has_range() && self.has_bearing();
        let is_robot = self.who == Self::ROBOT || self.who == Self::UNKNOWN && is_whole;
        self.check(limits, is_robot)
    }

    /// [`Self::validate`], of who hears what is passed on: of that, and of landmarks.
    ///
    /// # Errors
    /// Likewise.
    pub fn validate_passed_on(&self, limits: &Limits) -> Result<(), Reject> {
        self.check(limits, matches!(self.who, Self::PASSED_ON | Self::LANDMARK))
    }

    fn check(&self, limits: &Limits, is_known: bool) -> Result<(), Reject> {
        Limits::check_finite(&[self.range, self.bearing])?;
        Limits::check_finite(&self.white)?;
        Limits::check_finite(&self.slow)?;
        Limits::check_finite(&self.mount)?;
        Limits::check_not_negative(&self.slow)?;
        self.check_variances()?;
        Limits::check_supported(is_known && self.is_supported())?;
        if matches!(self.who, Self::ROBOT | Self::PASSED_ON) {
            limits.check_other(self.observed)?;
        }
        limits.check_time(&self.header)?;
        if self.has_range() && self.range <= 0.0 {
            return Err(Reject::NoRange);
        }
        Ok(())
    }

    /// Whether there is a range.
    #[must_use]
    pub const fn has_range(&self) -> bool {
        self.has & Self::RANGE != 0
    }

    /// Whether there is a bearing.
    #[must_use]
    pub const fn has_bearing(&self) -> bool {
        self.has & Self::BEARING != 0
    }

    fn check_variances(&self) -> Result<(), Reject> {
        let [range, bearing] = self.white;
        let exact = (self.has_range() && range <= 0.0) || (self.has_bearing() && bearing <= 0.0);
        if exact {
            return Err(Reject::NoCovariance);
        }
        Ok(())
    }

    fn is_supported(&self) -> bool {
        let [range, bearing] = self.white;
        let [scale, scale_s, turn, turn_s] = self.slow;
        let lasts = (scale == 0.0 || scale_s > 0.0) && (turn == 0.0 || turn_s > 0.0);
        let silent = (self.has_range() || all_zero(&[self.range, range, scale]))
            && (self.has_bearing() || all_zero(&[self.bearing, bearing, turn]));
        let named = (1..=Self::RANGE | Self::BEARING).contains(&self.has);
        named && lasts && silent && self.reserved == [0; 4]
    }
}
