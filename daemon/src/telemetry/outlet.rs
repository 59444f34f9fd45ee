//! A port of the telemetry thread, opened when there is the first message to send, and again when it was lost.

use std::time::{Duration, Instant};

use coloc_shm_types::{Message, PortError, Publisher, RobotName};
use tracing::{error, info, warn};

use super::place::Place;
use crate::retry::Retry;

/// Whether it reaches everybody is said no more often than that: listeners may come and go.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

pub(super) struct Outlet<M: Message> {
    robot: RobotName,
    port: Option<Publisher<M>>,
    retry: Retry,
    /// As it was said last, and when.
    reaches_all: bool,
    said: Option<Instant>,
}

impl<M: Message> Outlet<M> {
    pub(super) fn new(robot: RobotName) -> Self {
        Self {
            robot,
            port: None,
            retry: Retry::default(),
            reaches_all: true,
            said: None,
        }
    }

    /// To whoever listens, if that is possible.
    pub(super) fn send(&mut self, message: M, place: &mut Place) {
        if self.port.is_none() && self.retry.is_due() {
            self.open(place);
        }
        let Some(port) = &self.port else { return };
        let name = M::CHANNEL.name();
        match port.send(message) {
            Err(problem) if self.is_news(false) => warn!("{name}: {problem}"),
            Ok(()) if self.is_news(true) => info!("{name} reaches everybody again"),
            _ => {}
        }
    }

    fn is_news(&mut self, reaches_all: bool) -> bool {
        let recent = |said: Instant| said.elapsed() < BETWEEN_LINES;
        let is_news = reaches_all != self.reaches_all && !self.said.is_some_and(recent);
        if is_news {
            (self.reaches_all, self.said) = (reaches_all, Some(Instant::now()));
        }
        is_news
    }

    pub(super) fn close(&mut self) {
        self.port = None;
    }

    fn open(&mut self, place: &mut Place) {
        let Some(space) = place.space() else { return };
        let opened: Result<_, PortError> = space.publisher(&self.robot);
        match opened {
            Ok(port) => {
                self.port = Some(port);
                self.retry.worked();
            }
            Err(problem) => {
                let (name, pause_s) = (M::CHANNEL.name(), self.retry.failed().as_secs());
                error!(
                    pause_s,
                    "no {name} is published until this works: {problem}"
                );
            }
        }
    }
}
