//! The port on which the status goes out, opened when there is the first one to send, and again when it was lost.

use std::sync::mpsc::Receiver;

use coloc_shm_types::{Lost, PortError, Publisher, RobotName, Space, Status};
use tracing::{error, info, warn};

use crate::config::Config;
use crate::retry::Retry;

pub(super) struct StatusPort {
    robot: RobotName,
    /// Closed before the space is left.
    port: Option<Publisher<Status>>,
    space: Option<Space>,
    /// Brings the space once the robot is claimed.
    spaces: Receiver<Space>,
    retry: Retry,
    sequence: u64,
    reaches_all: bool,
    /// Connections that could not be made yet.
    waiting: usize,
}

impl StatusPort {
    pub(super) fn new(config: &Config, spaces: Receiver<Space>) -> Self {
        Self {
            robot: config.robot.name.clone(),
            port: None,
            space: None,
            spaces,
            retry: Retry::default(),
            sequence: 0,
            reaches_all: true,
            waiting: 0,
        }
    }

    /// Whether the space is still where others look for it. What the dead have left there is removed.
    pub(super) fn look_after_space(&mut self) -> Result<(), Lost> {
        let Some(space) = self.space() else {
            return Ok(());
        };
        space.check()?;
        let files = space.tidy();
        if files > 0 {
            info!(
                files,
                "removed what dead processes have left in shared memory"
            );
        }
        self.tell_waiting(Space::waiting_connections());
        Ok(())
    }

    fn tell_waiting(&mut self, waiting: usize) {
        match (self.waiting, waiting) {
            (0, 1..) => warn!(
                waiting,
                "connections to other programs wait: there is no room in shared memory, or no descriptor left"
            ),
            (1.., 0) => info!("all connections to other programs are made"),
            _ => {}
        }
        self.waiting = waiting;
    }

    fn space(&mut self) -> Option<&Space> {
        if self.space.is_none() {
            self.space = self.spaces.try_recv().ok();
        }
        self.space.as_ref()
    }

    /// To whoever listens, if that is possible.
    pub(super) fn send(&mut self, mut status: Status) {
        status.header.sequence = self.sequence;
        self.sequence += 1;
        if self.port.is_none() && self.retry.is_due() {
            self.open();
        }
        let Some(port) = &self.port else { return };
        let sent = port.send(status);
        match (&sent, self.reaches_all) {
            (Err(problem), true) => warn!("status: {problem}"),
            (Ok(()), false) => info!("the status reaches everybody again"),
            _ => {}
        }
        self.reaches_all = sent.is_ok();
    }

    pub(super) fn close(&mut self) {
        self.port = None;
    }

    fn open(&mut self) {
        let robot = self.robot.clone();
        let Some(space) = self.space() else { return };
        let opened: Result<_, PortError> = space.publisher(&robot);
        match opened {
            Ok(port) => {
                self.port = Some(port);
                self.retry.worked();
            }
            Err(problem) => {
                let pause_s = self.retry.failed().as_secs();
                error!(
                    pause_s,
                    "no status is published until this works: {problem}"
                );
            }
        }
    }
}
