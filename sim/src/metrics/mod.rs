//! How far the estimates are off, and whether their covariances say so.
//!
//! | figure | definition |
//! | --- | --- |
//! | error | e = x̂ − x, heading wrapped |
//! | RMSE per step | √(mean of e² over runs), per coordinate; tables give its mean and standard deviation over time |
//! | RMS | √(mean of e² over runs and time) |
//! | NEES | ε = eᵀ P⁻¹ e, nominal 3; share above χ²₃ 95 % = 7.8147, nominal 5 % |
//! | NIS | d² of the innovations that passed the gate, nominal 3 (neighbours) or 2 (fixes) |
//! | inside 3σ | share of time with \|e\| ≤ 3 √P, per coordinate, nominal 99.73 % |
//! | credibility | log₁₀ of the mean P over the mean e², per coordinate: 0 honest, below 0 overconfident |

pub mod paired;
pub mod samples;
pub mod statistics;
pub mod totals;

pub use paired::Paired;
pub use samples::{Sample, Samples};
pub use totals::{NisTotals, StepTotals, Totals};

/// 95 % quantile of χ² with three degrees of freedom.
pub const CHI2_3_95: f64 = 7.814_727_903_251_179;
