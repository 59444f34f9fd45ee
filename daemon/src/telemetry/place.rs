//! The space in shared memory, which comes once the robot is claimed and is looked after from then on.

use std::sync::mpsc::Receiver;

use coloc_shm_types::{Lost, Space};
use tracing::{info, warn};

pub(super) struct Place {
    space: Option<Space>,
    /// Brings the space once the robot is claimed.
    spaces: Receiver<Space>,
    /// Connections that could not be made yet.
    waiting: usize,
}

impl Place {
    pub(super) fn new(spaces: Receiver<Space>) -> Self {
        Self {
            space: None,
            spaces,
            waiting: 0,
        }
    }

    pub(super) fn space(&mut self) -> Option<&Space> {
        if self.space.is_none() {
            self.space = self.spaces.try_recv().ok();
        }
        self.space.as_ref()
    }

    /// Whether the space is still where others look for it. What the dead have left there is removed.
    pub(super) fn look_after(&mut self) -> Result<(), Lost> {
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
}
