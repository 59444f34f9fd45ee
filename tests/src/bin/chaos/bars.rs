//! Times within which something has to happen.
//!
//! They are bars in the long form only. The short one is for machines that have other things to do: it waits for longer,
//! and says how long things took.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::fault::{Fault, Outcome};

static ARE_HELD: AtomicBool = AtomicBool::new(false);

/// What takes longer than this never comes, on any machine.
const BUSY: Duration = Duration::from_secs(60);

/// From now on: this is the long form.
pub(crate) fn hold() {
    ARE_HELD.store(true, Ordering::Relaxed);
}

pub(crate) fn are_held() -> bool {
    ARE_HELD.load(Ordering::Relaxed)
}

#[derive(Copy, Clone)]
pub(crate) struct Bar(pub(crate) Duration);

impl Bar {
    /// How long it is waited for.
    pub(crate) fn patience(self) -> Duration {
        if are_held() { self.0 } else { BUSY }
    }

    /// How much longer than the bar.
    pub(crate) fn beyond(self) -> Duration {
        self.patience().saturating_sub(self.0)
    }

    /// A fault in these words, if it took longer.
    pub(crate) fn hold(self, took: Duration, words: impl FnOnce() -> String) -> Outcome {
        if are_held() && took > self.0 {
            return Err(Fault::late(words()));
        }
        Ok(())
    }
}

impl fmt::Debug for Bar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.patience().fmt(f)
    }
}
