//! What the tests of the whole share: a rig that drives a real robot tick by tick, and the faults that it is put through.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)] // What fails here fails the test.

pub mod faults;
pub mod rig;
pub mod scene;
pub mod surroundings;
