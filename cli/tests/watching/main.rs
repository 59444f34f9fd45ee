//! `coloc list` and `coloc listen`, as a person runs them, each test in a shared memory of its own. The robots are this
//! process, which says what they are to say; where one is to be killed it is a real daemon.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

mod anothers;
mod comings;
mod forms;
mod listing;
mod pipes;
mod program;
mod robot;
mod telling;
