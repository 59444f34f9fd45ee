//! Honest dead reckoning: the covariance between position and direction is carried from step to step.
//!
//! An error of the heading turns all of the way that follows by the same angle. A filter that makes a Gaussian of position and
//! heading at every tick forgets how the bend of the distribution lies to the direction: what it drops grows with the square of
//! the number of ticks, what it keeps with the number. So the bend is carried, and the first two moments of the pose are exact
//! for a pose that was Gaussian at the last measurement, however uncertain its heading; a heading's σ of π and more says "no idea".
//!
//! # State
//!
//! `x = [p, φ]`, the parts `P_i` and `P_d` of its covariance `P = P_i + P_d`, and the [`Bend`], `K_H = Cov((p, φ), w)`: `w` is
//! `u = (cos φ, sin φ)` without its mean and without its part that is linear in φ. `K_H = [k_a k_b] R(φ̄)ᵀ`, so that a turn does
//! not touch `k_a` and `k_b`, columns of three along and across the mean heading.
//!
//! # One step
//!
//! A displacement `t` in the body frame at its start \[m\], the turn Δ \[rad\], and the covariance `D = [[D_tt, d], [dᵀ, q]]` of
//! their noise. With `s = P_φφ`, `J = R(π/2)`, `r = R(φ̄) t`, `ρ = R(φ̄) d`, `N = R(φ̄) D_tt R(φ̄)ᵀ`:
//!
//! ```text
//! e = exp(−s/2)     F = 1 − e²     Ω_a = ½ F²     C_b = ½ (1 − e⁴)     Ω_b = C_b − s e²     the moments of u
//! A = [[I, e J r], [0, 1]]         G D Gᵀ = [[e² N, e ρ], [e ρᵀ, q]]        (h, κ) = A k
//! x̄⁺   = [p̄ + e r, φ̄ + Δ]
//! P_i⁺ = A P_i Aᵀ + G D Gᵀ
//! P_d⁺ = A P_d Aᵀ + ΔH in the position's block + (κ_a r + κ_b J r) between position and heading
//! ΔH   = r h_aᵀ + h_a rᵀ + (Jr) h_bᵀ + h_b (Jr)ᵀ + Ω_a r rᵀ + Ω_b (Jr)(Jr)ᵀ + F [½ (2 − F) J N Jᵀ + ½ F N]
//! k_a⁺ = exp(−q/2) (h_a + Ω_a r − C_b J ρ, κ_a)      k_b⁺ = exp(−q/2) (h_b + Ω_b J r + Ω_a ρ, κ_b)
//! ```
//!
//! Both parts go through the same linear map, so that neither can lose its sign; all that is curvature is dependent, because it
//! holds products of the own noise with whatever the heading rests on. `ΔH` alone may be negative (who drives back undoes the
//! bend), `P_d` is not. Nothing is a difference of large numbers.
//!
//! # A sighting, a measurement
//!
//! A sighting `z` with noise `R` is the same step with `t = z_p`, `Δ = z_φ`, `D = R`, from a belief that stays as it is. Of what is
//! told of it, the term of N in ΔH is independent too ([`crate::convert::tell`]): `n`, of mean zero, is new with every sighting, so that
//! `n` times anything known before is correlated with nothing but itself. With the noise turned by the heading's error δ,
//!
//! ```text
//! R*_i = A P_i Aᵀ + [[E R(δ) N R(δ)ᵀ, e ρ], [e ρᵀ, q]]      E R(δ) N R(δ)ᵀ = ½ tr N I + e⁴ (N − ½ tr N I)
//! R*_d = A P_d Aᵀ + what is left of ΔH without N, and (κ_a r + κ_b J r)
//! ```
//!
//! A
//! measurement with the gain W shrinks the bend as far as it shrinks the heading's variance: with `ϱ = min(1, s⁺/s)`
//! `k_a⁺ = ϱ² (I − W) k_a` and `k_b⁺ = ϱ³ (I − W) k_b`. What moves `P_i` into
//! `P_d` leaves the bend alone.

mod arc;
mod bend;
mod circle;
mod measure;
mod plane;
mod step;
mod there_and_back;

pub use arc::Increments;
pub(crate) use arc::{Swept, chord_of};
pub use bend::Bend;
pub(crate) use circle::Circle;
pub(crate) use measure::left;
pub use step::{Map, Moved, advance};
pub(crate) use step::{seen_from, step, step_with_column};
pub(crate) use there_and_back::ThereAndBack;
