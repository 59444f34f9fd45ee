//! The estimator's functions against single cases of an independent implementation, most of them computed with
//! 60 digits.

#![allow(non_snake_case)] // P and R are called so in the files and in the equations.
#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

mod case;
mod cubature;
mod fix;
mod fusion;
mod rivals;
#[path = "../support/mod.rs"]
mod support;
