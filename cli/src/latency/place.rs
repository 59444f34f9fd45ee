//! Where the command works while it runs.

use super::error::LatencyError;
use crate::home::{Home, Kind, sweep};

/// Begins the name of every file of this command in shared memory.
pub(crate) const PREFIX: &str = "coloclat";

/// What it keeps while it runs.
const HOME: Kind = Kind {
    name: "coloc-latency-",
    shm_prefix: PREFIX,
};

/// A place to work in, once what runs that were killed have left is gone.
pub(crate) fn home() -> Result<Home, LatencyError> {
    let place = std::env::temp_dir();
    sweep(HOME, &place);
    Ok(Home::make(HOME, &place)?)
}
