//! Whether the process may have as many addresses as it takes.

use rustix::process::{Resource, getrlimit};

use crate::start::StartError;

/// A daemon with all its threads takes up to 471 MiB, of which 22 are used: the C library sets 64 MiB aside for each thread
/// that allocates, and twice that for a moment. Where it cannot, it tries again in every allocation, which makes them slow;
/// and where even the 22 are missing, the process dies without a word.
const NEEDED_MIB: u64 = 512;

/// # Errors
/// If there is a limit, and it is lower than that.
pub(crate) fn check() -> Result<(), StartError> {
    match getrlimit(Resource::As).current.map(|limit| limit >> 20) {
        Some(limit_mib) if limit_mib < NEEDED_MIB => Err(StartError::AddressSpace {
            limit_mib,
            needed_mib: NEEDED_MIB,
        }),
        _ => Ok(()),
    }
}
