//! The honest heading against an independent implementation, most of it computed with 60 digits, and what must hold of it
//! whatever happens.

#![allow(non_snake_case)] // P and R are called so in the files and in the equations.
#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

mod case;
mod semidefinite;
mod sequence;
mod single;
#[path = "../support/mod.rs"]
mod support;
