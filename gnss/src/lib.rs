//! `coloc-gnss`: satellite receivers, from their bytes to the channels `position` and `heading`.
//!
//! bytes → [`frame`] → [`sentence`], [`ubx`] → [`receiver`], which puts together what belongs to one moment → [`driver`], which asks
//! [`gate`], [`stamp`], [`datum`], [`local`] and [`sigma`] what becomes of it → [`publish`].
//!
//! * **The receiver's word is an input like any other.** It is never believed below a floor, and what its error has in common with that of the
//!   next fix is said.
//! * **A fix that is not published has a reason**, and each reason is counted.

pub mod datum;
pub mod driver;
pub mod fix;
pub mod frame;
pub mod gate;
pub mod local;
pub mod program;
pub mod publish;
pub mod receiver;
pub mod refusal;
pub mod section;
pub mod sentence;
pub mod sigma;
pub mod stamp;
pub mod ubx;
pub mod utc;
