//! The whole demo, as a person runs it: real daemons, a real bus, real shared memory.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

mod eyes;
mod leaders;
mod lost;
mod stage;
mod team;
mod trouble;
