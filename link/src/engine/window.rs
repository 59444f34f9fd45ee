//! What may be on its way at once.
//!
//! TCP's rules take every lost packet for a full queue and send less; on a radio that loses half of them they would send next to nothing,
//! of messages that are worth nothing a second later. How much a link sends is bounded before it gets here, by `max_bytes_per_s`; so what
//! is on its way has one bound, and loss does not change it.
use std::any::Any;
use std::sync::Arc;
use std::time::Instant;

use quinn::congestion::{Controller, ControllerFactory};

/// What may be on its way (bytes): more than the largest message, twice.
const MOST: u64 = 128 * 1024;

/// One bound.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window;

impl Controller for Window {
    fn on_congestion_event(&mut self, _: Instant, _: Instant, _: bool, _: u64) {}

    fn on_mtu_update(&mut self, _: u16) {}

    fn window(&self) -> u64 {
        MOST
    }

    fn clone_box(&self) -> Box<dyn Controller> {
        Box::new(*self)
    }

    fn initial_window(&self) -> u64 {
        MOST
    }

    fn into_any(self: Box<Self>) -> Box<dyn Any> {
        self
    }
}

impl ControllerFactory for Window {
    fn build(self: Arc<Self>, _: Instant, _: u16) -> Box<dyn Controller> {
        Box::new(*self)
    }
}
