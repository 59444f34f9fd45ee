//! The messages of coloc: what crosses shared memory, under which name, and how it is checked.
pub mod payload;
pub use payload::{Estimate, Neighbour, Position, RelativePose, Status};
