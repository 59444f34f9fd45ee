//! The payloads: plain `#[repr(C)]`, fixed size, versioned in their type name, the same bytes in every language.
mod can_counters;
mod estimate;
mod header;
mod latency;
mod losses;
mod neighbour;
mod odometry;
mod pose;
mod position;
mod relative_pose;
mod source_health;
mod status;
mod timing;

pub use can_counters::CanCounters;
pub use estimate::Estimate;
pub use header::Header;
pub use latency::Latency;
pub use losses::Losses;
pub use neighbour::Neighbour;
pub use odometry::{Odometry, OdometryKind};
pub use pose::Pose;
pub use position::Position;
pub use relative_pose::RelativePose;
pub use source_health::SourceHealth;
pub use status::Status;
pub use timing::Timing;
