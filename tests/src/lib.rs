//! What the tests of the whole share: a rig that drives a real robot tick by tick, the faults that it is
//! put through, a model of its edge, the doors by which bytes come in, a scene in which it gets all that a robot can get; and what programs say.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)] // What fails here fails the test.

pub mod edge;
pub mod faults;
pub mod fuzz;
pub mod output;
pub mod rig;
pub mod scene;
pub mod surroundings;
