//! Sightings that say a part only: range and bearing, or one of the two, and what both robots learn of it.
//!
//! Who sees tells the robot seen where it must be ([`tell`], rank two: nothing is said of its heading). The robot seen answers where it
//! believed to be ([`SplitPosition::of`]), and so the observer learns its own pose ([`observed`]), the heading above all. A landmark is
//! a robot that answers at once ([`SplitPosition::known`]). Both are fused by [`fuse`], split covariance intersection of what is not a
//! whole pose. Of one number alone see [`tell_alone`] and [`observed_alone`].
//!
//! # What is seen
//!
//! What stands at `z` in the body's frame is at `p + C(φ) z`. With the direction `u = (cos φ, sin φ) = ū + √e J û (φ − φ̄) + w` of
//! [`crate::honest`], `e = exp(−P_φφ)`, that is `y + H δx + Z w`, exactly:
//!
//! ```text
//! d = C(φ̄) z     y = p̄ + √e d     H = [I | √e J d]     Z = [[z₀, −z₁], [z₁, z₀]]
//! ```
//!
//! `Z w` is the bend of the observer's own heading. It is an error of the observer's own, with `P_d`, never of the message: with the
//! message a poor heading would weigh out the very sightings that teach it.
//!
//! # Fusion
//!
//! ```text
//! ν = H δx + Z w + n     cov n = R_i + R_d     E = K_H Zᵀ     N = Z Ω Zᵀ     own = H P_d Hᵀ + H E + (H E)ᵀ + N
//! S = own/α + H P_i Hᵀ + R_d/(1−α) + R_i       G = ((P_d Hᵀ + E)/α + P_i Hᵀ) S⁻¹       F = I − G H
//! P_i⁺ = F P_i Fᵀ + G R_i Gᵀ     P_d⁺ = Q/α + G R_d Gᵀ/(1−α)     Q = F P_d Fᵀ − F E Gᵀ − G Eᵀ Fᵀ + G N Gᵀ
//! K_H⁺ = F K_H − G Z Ω, shrunk
//! ```
//!
//! `P_d`, `K_H` and Ω are parts of one positive semidefinite matrix. It is taken apart into five columns of weights `d_j`, each with
//! what it is in the state, `c_j`, and in ν, `b_j`: three of what the direction does not explain of `P_d`, and two of w. Then
//! `own = Σ d_j b_j b_jᵀ` and `Q = Σ d_j (c_j − G b_j)(c_j − G b_j)ᵀ`: sums of squares, so that no part can lose its sign.

mod alone;
mod columns;
mod fuse;
mod innovation;
mod place;
mod reading;
mod search;
mod settings;
mod symmetric;

pub use alone::{Alone, observed_alone, tell_alone};
pub use fuse::fuse;
pub(crate) use fuse::fuse_and_leave;
pub use innovation::{Innovation, Numbers};
pub use place::{SplitPosition, observed, tell, told};
pub use reading::{BodySighting, Reading, ReadingNoise};
pub use settings::PositionSettings;
