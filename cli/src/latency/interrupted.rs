//! Ending early. A signal is the process's, and so is this: whoever waits, on any thread, asks here.

use std::sync::OnceLock;

use super::error::LatencyError;
use crate::demo::clock::{self, now_ns};
use crate::demo::interrupt::Interrupt;

/// How long a signal may go unnoticed by who sleeps \[ns\].
const LONGEST_SLEEP_NS: i64 = 100_000_000;

static INTERRUPT: OnceLock<Interrupt> = OnceLock::new();

/// From now on, signals that ask for the end do nothing else than show here.
pub(crate) fn catch() -> Result<(), LatencyError> {
    let interrupt = Interrupt::catch()
        .map_err(|error| LatencyError::Spawn(format!("handling signals: {error}")))?;
    // The first one stays.
    let _ = INTERRUPT.set(interrupt);
    Ok(())
}

/// The number of the signal that came, if one did.
pub(crate) fn signal() -> Option<i32> {
    INTERRUPT.get()?.signal()
}

/// Whether to go on.
pub(crate) fn check() -> Result<(), LatencyError> {
    signal().map_or(Ok(()), |_| Err(LatencyError::Interrupted))
}

/// Sleeps until `due_ns`, unless that is not to be waited for any more.
pub(crate) fn sleep_until(due_ns: i64) -> Result<(), LatencyError> {
    check()?;
    while now_ns() < due_ns {
        clock::sleep_until(due_ns.min(now_ns() + LONGEST_SLEEP_NS));
        check()?;
    }
    Ok(())
}
