//! The payloads: plain `#[repr(C)]`, fixed size, versioned in their type name, the same bytes in every language.
mod estimate;
mod header;
mod neighbour;
mod position;
mod relative_pose;
mod status;

pub use estimate::Estimate;
pub use header::Header;
pub use neighbour::Neighbour;
pub use position::Position;
pub use relative_pose::RelativePose;
pub use status::{CanCounters, Latency, Status};
