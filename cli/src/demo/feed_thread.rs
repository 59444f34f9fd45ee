//! The thread on which the feed runs: with it on a thread of its own, drawing a table delays no frame.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;

use coloc_drivers::can::BusSpec;

use super::DemoError;
use super::feed::{Feed, Signals};
use super::world::Stage;

/// A feed that runs until it is stopped or dropped.
pub(crate) struct FeedThread {
    signals: Arc<Signals>,
    thread: Option<JoinHandle<Result<(), DemoError>>>,
}

impl FeedThread {
    /// Returns once all its buses and ports are open.
    pub(crate) fn start(
        stage: &Arc<Stage>,
        roots: &[PathBuf],
        buses: &[BusSpec],
    ) -> Result<Self, DemoError> {
        let (opened, is_open) = mpsc::sync_channel(1);
        let signals = Arc::new(Signals::default());
        let (stage, roots, buses) = (Arc::clone(stage), roots.to_vec(), buses.to_vec());
        let theirs = Arc::clone(&signals);
        let run = move || Feed::run(stage, &roots, &buses, &theirs, &opened);
        let thread = std::thread::Builder::new()
            .name("coloc-feed".into())
            .spawn(run)
            .map_err(|error| DemoError::Thread(error.to_string()))?;
        let mut feed = Self {
            signals,
            thread: Some(thread),
        };
        if is_open.recv().is_err() {
            // It ended before it was open.
            feed.stop()?;
            return Err(DemoError::Feed);
        }
        Ok(feed)
    }

    /// The robots may drive.
    pub(crate) fn go(&self) {
        self.signals.go.store(true, Ordering::Release);
    }

    /// When they started to \[ns of `CLOCK_BOOTTIME`\].
    pub(crate) fn start_ns(&self) -> Option<i64> {
        self.signals.start_ns.get().copied()
    }

    /// Whether it broke down.
    pub(crate) fn has_ended(&self) -> bool {
        self.thread.as_ref().is_some_and(JoinHandle::is_finished)
    }

    /// Ends it, and says what went wrong if something did.
    pub(crate) fn stop(&mut self) -> Result<(), DemoError> {
        self.signals.stop.store(true, Ordering::Release);
        self.thread.take().map_or(Ok(()), |thread| {
            thread.join().unwrap_or(Err(DemoError::Feed))
        })
    }
}

impl Drop for FeedThread {
    fn drop(&mut self) {
        // After an error: the thread must not outlive the folder it works in. Its own error comes second.
        let _ = self.stop();
    }
}
