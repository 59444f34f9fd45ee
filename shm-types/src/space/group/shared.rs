//! The owner's side.
use std::path::PathBuf;
use std::sync::Arc;

use iceoryx2::prelude::SemanticString;
use iceoryx2_cal::named_concept::FileName;
use rustix::io::Errno;

use super::super::Space;
use super::super::bells::{Page, Waiter};
use super::super::error::OpenError;
use super::super::transport::SHARED_MEMORY;
use super::call::Call;
use super::page::{About, Pen};
use super::porter::Porter;
use super::users::Group;
use super::{PAGE, door};
use crate::private::unguessable;
use crate::{Estimate, RobotName};

/// What a group may read of a robot, for as long as this lives. The order of the fields is that of leaving.
#[derive(Debug)]
pub struct GroupPage {
    porter: Porter,
    call: Arc<Call>,
    _names: Names,
    pen: Pen,
}

/// Nobody else ever gets these, so they can be removed without a look.
#[derive(Debug)]
struct Names {
    door: PathBuf,
    page: PathBuf,
}

impl GroupPage {
    /// `bells` are those of the robot's estimates.
    pub(crate) fn open(
        space: &Space,
        bells: Page,
        robot: &RobotName,
        id: u16,
        group: &Group,
    ) -> Result<Self, OpenError> {
        let stem = format!("{}{:016x}", space.place().prefix(), number()?);
        let name = format!("{stem}.{robot}{PAGE}");
        let names = Names {
            door: door::path(&stem),
            page: format!("{SHARED_MEMORY}/{name}").into(),
        };
        let refused = |error| refusal(&names, group, error);
        let file = FileName::new(name.as_bytes()).map_err(|_| refused(Errno::NAMETOOLONG))?;
        let door = door::open(&names.door, group).map_err(refused)?;
        let bell = Waiter::new(space.place(), bells).map_err(refused)?;
        let call = Arc::new(Call::new().map_err(refused)?);
        let porter = Porter::start(door, bell, call.clone())
            .map_err(|error| refused(Errno::from_io_error(&error).unwrap_or(Errno::AGAIN)))?;
        // Whoever finds it finds the door.
        let about = About::new(id, space.place().root());
        let pen = Pen::new(&file, group, &about).map_err(refused)?;
        Ok(Self {
            porter,
            call,
            _names: names,
            pen,
        })
    }

    /// Readers are woken by a thread of this process: it gets real-time `priority`, for as long as they cost little of a processor.
    ///
    /// # Errors
    /// If the system does not grant it.
    pub fn hasten(&self, priority: u8) -> std::io::Result<()> {
        self.porter.hasten(priority)
    }

    /// Lets readers find `estimate`, before its publisher rings: in bounded time, without an allocation or a system call.
    pub fn write(&self, estimate: &Estimate) {
        self.pen.write(estimate);
        self.call.wrote();
    }

    /// That the next estimate is about to be written, in less than half a millisecond: readers have it sooner. A system call, if somebody
    /// waits.
    pub fn expect(&self) {
        self.call.call();
    }

    /// After the publisher has rung: it need not for an estimate that was [expected](Self::expect).
    pub fn settle(&self) {
        self.call.settle();
    }
}

impl Drop for Names {
    fn drop(&mut self) {
        // What is left is removed with what the dead leave.
        let _ = rustix::fs::unlink(&self.door);
        let _ = rustix::fs::unlink(&self.page);
    }
}

fn number() -> Result<u64, OpenError> {
    unguessable().map_err(|source| OpenError::System {
        action: "draw a number from",
        path: "/dev/urandom".into(),
        source,
    })
}

fn refusal(names: &Names, group: &Group, error: Errno) -> OpenError {
    if error == Errno::PERM {
        return group.not_a_member().into();
    }
    OpenError::System {
        action: "open to a group",
        path: names.page.clone(),
        source: error.into(),
    }
}
