//! The bounds against an independent implementation with rational arithmetic.

#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

mod case;
mod diagnosis;
mod dynamic;
mod intervals;
mod polytopes;
mod rows;
mod sandwich;
