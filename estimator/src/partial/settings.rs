//! How what is not a whole pose is fused.

use super::innovation::Numbers;
use crate::gate::{CHI2_1_99, CHI2_2_99};
use crate::pace::Pace;
use crate::settings::FusionSettings;
use crate::stamp::Span;

/// As [`FusionSettings`] for poses.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PositionSettings {
    /// L \[m\]: the weight minimises the trace of `diag(1, 1, L²) P⁺`.
    pub heading_lever_m: f64,
    /// β ∈ (0, 1]: the weight used is `1 − β (1 − α*)`.
    pub damping: f64,
    /// τ: β is at most the mean interval between what is heard over this. Zero: always β.
    pub memory: Span,
    /// Accept if d² at the update's weight is at most this (χ² with two degrees of freedom).
    pub gate: f64,
    /// The same of one number alone (χ² with one degree of freedom).
    pub gate_alone: f64,
}

impl Default for PositionSettings {
    fn default() -> Self {
        Self {
            heading_lever_m: 1.0,
            damping: 0.5,
            memory: Span::from_millis(300),
            gate: CHI2_2_99,
            gate_alone: CHI2_1_99,
        }
    }
}

impl PositionSettings {
    /// The greedy weight of the published algorithm.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            damping: 1.0,
            memory: Span::ZERO,
            ..Self::default()
        }
    }

    /// With β as `pace` allows.
    #[must_use]
    pub fn damped(&self, pace: &Pace) -> Self {
        let paced = pace.damped(&FusionSettings {
            damping: self.damping,
            memory: self.memory,
            ..FusionSettings::default()
        });
        Self {
            damping: paced.damping,
            ..*self
        }
    }

    pub(super) fn gate_of(&self, numbers: Numbers) -> f64 {
        match numbers {
            Numbers::One => self.gate_alone,
            Numbers::Two => self.gate,
        }
    }
}
