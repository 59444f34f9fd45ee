//! The port on which the status goes out, opened when there is the first one to send, and again when it was lost.

use coloc_shm_types::{Publisher, Space, Status};
use tracing::{error, info, warn};

use crate::config::Config;
use crate::retry::Retry;
use crate::start::StartError;

pub(super) struct StatusPort {
    config: Config,
    /// The port is closed before the space.
    open: Option<(Publisher<Status>, Space)>,
    retry: Retry,
    sequence: u64,
    reaches_all: bool,
}

impl StatusPort {
    pub(super) fn new(config: &Config) -> Self {
        Self {
            config: config.clone(),
            open: None,
            retry: Retry::default(),
            sequence: 0,
            reaches_all: true,
        }
    }

    /// To whoever listens, if that is possible.
    pub(super) fn send(&mut self, mut status: Status) {
        status.header.sequence = self.sequence;
        self.sequence += 1;
        if self.open.is_none() && self.retry.is_due() {
            self.open();
        }
        let Some((port, _)) = &self.open else { return };
        let sent = port.send(status);
        match (&sent, self.reaches_all) {
            (Err(problem), true) => warn!("status: {problem}"),
            (Ok(()), false) => info!("the status reaches everybody again"),
            _ => {}
        }
        self.reaches_all = sent.is_ok();
    }

    pub(super) fn close(&mut self) {
        self.open = None;
    }

    fn open(&mut self) {
        match self.opened() {
            Ok(open) => {
                self.open = Some(open);
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

    fn opened(&self) -> Result<(Publisher<Status>, Space), StartError> {
        let robot = &self.config.robot.name;
        let space = (self.config).open_space(&format!("colocd {robot} status"))?;
        Ok((space.publisher(robot)?, space))
    }
}
