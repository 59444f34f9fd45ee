//! The track against an independent implementation.

#![allow(non_snake_case)] // P and R are called so in the files and in the equations.
#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

mod case;
mod comparators;
mod observability;
mod sequence;
mod single;
