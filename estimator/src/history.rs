//! The fixed-capacity history of beliefs, odometry and measurements.

/// One place in the history's storage.
#[derive(Copy, Clone, Debug, Default)]
pub struct Slot;
