//! Every command with every output gone or full: a sentence and a status, never a panic, and no result lost that could be
//! written.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

mod files;
mod program;
mod streams;
