//! Ellipsoidal gates: quantiles of the χ² distribution.

/// χ² with two degrees of freedom, 99 %: position fixes.
pub const CHI2_2_99: f64 = 9.210_340_371_976_182;

/// χ² with three degrees of freedom, 99 %: neighbours' poses.
pub const CHI2_3_99: f64 = 11.344_866_730_144_373;
