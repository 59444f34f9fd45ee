//! Leaders and children against an independent implementation, and what must hold of them whatever happens.

#![allow(non_snake_case)] // P and R are called so in the files and in the equations.
#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

mod case;
mod composition;
mod delayed;
mod distributed;
mod network;
mod properties;
mod refusals;
mod replay;
mod sequence;
#[path = "../support/mod.rs"]
mod support;
mod sync;
mod tables;
mod trees;
mod updates;
