//! Other people's work: threads that never sleep.

use std::hint::spin_loop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::{LatencyError, on_thread};

/// Busy threads, until dropped.
pub(crate) struct Load(Arc<AtomicBool>);

impl Load {
    /// So many threads, at ordinary priority.
    pub(crate) fn start(threads: u16) -> Result<Self, LatencyError> {
        let load = Self(Arc::new(AtomicBool::new(false)));
        for _ in 0..threads {
            let stop = Arc::clone(&load.0);
            on_thread("busy thread", move || {
                while !stop.load(Ordering::Relaxed) {
                    spin_loop();
                }
            })?;
        }
        Ok(load)
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
