//! The shared-memory space: a root directory and a prefix, opened once by every process that takes part.
mod bells;
mod claim;
mod config;
mod disk;
mod error;
mod gate;
mod ground;
mod group;
mod key;
mod leftovers;
mod lock;
mod manner;
mod port;
mod residence;
mod roll;
mod segments;
mod services;
mod spoken;
mod transport;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use iceoryx2::node::NodeCreationFailure;
use iceoryx2::prelude::{LogLevel, NodeBuilder, NodeName, SignalHandlingMode, set_log_level};
use rustix::io::Errno;

pub use claim::Claim;
pub use error::{Lost, OpenError, PortError, ReceiveError, Remark, SendError, WaitError};
pub use group::{Group, GroupPage, NoGroup, ReadError, Reader};
pub use port::{Publisher, Subscriber};
pub use roll::Running;

use crate::private::PrivateDirectory;
use crate::{Message, RobotName, places};
use config::Place;
use gate::Gate;
use leftovers::{Broom, Turn};
use manner::Manner;
use residence::Residence;
use services::Services;
use transport::fault::{self, Site};

pub(crate) type Node = iceoryx2::node::Node<transport::Service>;

/// A process's share in a shared-memory space.
///
/// Cloning is cheap and shares it; ports and claims keep it open. When the last process leaves, the space is empty:
/// nothing remains in the root directory or in `/dev/shm`.
#[derive(Clone, Debug)]
pub struct Space {
    tenancy: Arc<Tenancy>,
}

/// What is held while taking part. The order of the fields is the order of leaving: first the node, then the lock.
#[derive(Debug)]
struct Tenancy {
    node: Node,
    residence: Residence,
    broom: Mutex<Broom>,
}

impl Space {
    /// What can be known to be wrong with a root and a prefix before anything is touched.
    ///
    /// # Errors
    /// [`OpenError::BadRoot`], [`OpenError::BadPrefix`].
    pub fn check_place(root: &Path, prefix: &str) -> Result<(), OpenError> {
        config::check(root, prefix)
    }

    /// Takes part in the space at `root` and `prefix`, under `name` (shown by iceoryx2's tools).
    ///
    /// The directory is made if it does not exist, and belongs to the space alone. What killed processes have left in
    /// it is removed if nobody else is alive. Installs no signal handlers, and silences iceoryx2.
    ///
    /// # Errors
    /// Each [`OpenError`] says what to do about it.
    pub fn open(root: &Path, prefix: &str, name: &str) -> Result<Self, OpenError> {
        Self::enter(root, prefix, name, Manner::Make)
    }

    /// The same, where the directory is there: for whoever wants to hear those who made it.
    ///
    /// # Errors
    /// As [`Self::open`], and if the directory is gone.
    pub fn join(root: &Path, prefix: &str, name: &str) -> Result<Self, OpenError> {
        Self::enter(root, prefix, name, Manner::Find)
    }

    fn enter(root: &Path, prefix: &str, name: &str, manner: Manner) -> Result<Self, OpenError> {
        // Its errors come back as values; printing them would wait for whoever reads standard error, also within a tick.
        set_log_level(LogLevel::Fatal);
        let mut residence = Residence::enter(root, prefix, manner)?;
        let node = create_node(&residence, name)?;
        let files = {
            let _pass = residence.gate().pass();
            leftovers::remove(residence.place(), Turn::ALL)
        };
        if files > 0 {
            residence.remark(Remark::Tidied {
                root: residence.place().root().into(),
                files,
            });
        }
        let space = Self {
            tenancy: Arc::new(Tenancy {
                node,
                residence,
                broom: Mutex::default(),
            }),
        };
        space.look_around();
        Ok(space)
    }

    /// Takes part in the space that is used if no other is configured: [`places::shared_memory_root`] and
    /// [`places::DEFAULT_PREFIX`].
    ///
    /// # Errors
    /// As [`Self::open`], and if there is no such place.
    pub fn open_default(name: &str) -> Result<Self, OpenError> {
        let root = places::shared_memory_root()?;
        Self::open(&root.path, places::DEFAULT_PREFIX, name)
    }

    /// The robots for which a process acts in a space at `root`, by name. For whoever does not take part: nothing is made,
    /// and of those who were killed none is among them. In another user's place, those that this one may [read](Reader).
    ///
    /// # Errors
    /// If the place is another user's who lets this one read nothing, or cannot be looked at. One that is not there is no error.
    pub fn running(root: &Path) -> Result<Vec<Running>, OpenError> {
        roll::running(root)
    }

    /// Whether `root` is another user's, so that its robots can be [read](Reader) at most.
    #[must_use]
    pub fn is_anothers(root: &Path) -> bool {
        roll::is_anothers(root)
    }

    /// Root and prefix of every space that this user's processes have on this computer, or have left when they were killed; and of
    /// those of other users where this one may [read](Reader) a robot.
    #[must_use]
    pub fn places() -> Vec<(PathBuf, String)> {
        roll::places()
    }

    /// A port that sends `robot`'s messages of type `M`.
    ///
    /// # Errors
    /// Each [`PortError`] says what to do about it.
    pub fn publisher<M: Message>(&self, robot: &RobotName) -> Result<Publisher<M>, PortError> {
        let publisher = Publisher::open(self, robot)?;
        self.look_around();
        Ok(publisher)
    }

    /// A port that receives `robot`'s messages of type `M`; of channels with a history, first the newest so far.
    ///
    /// # Errors
    /// Each [`PortError`] says what to do about it.
    pub fn subscriber<M: Message>(&self, robot: &RobotName) -> Result<Subscriber<M>, PortError> {
        let subscriber = Subscriber::open(self, robot, Manner::Make)?;
        self.look_around();
        Ok(subscriber)
    }

    /// The same, where somebody has opened that channel before: it is not made.
    ///
    /// # Errors
    /// [`PortError::NoChannel`] if nobody has, after a moment in which somebody may be about to.
    pub fn existing<M: Message>(&self, robot: &RobotName) -> Result<Subscriber<M>, PortError> {
        let subscriber = Subscriber::open(self, robot, Manner::Find)?;
        self.look_around();
        Ok(subscriber)
    }

    /// Makes this process the only one that may act for `robot`, and for any robot with the number `id`, until the claim
    /// is dropped or the process ends.
    ///
    /// # Errors
    /// [`OpenError::AlreadyClaimed`] or [`OpenError::SameNumber`], with the process that came first.
    pub fn claim_robot(&self, robot: &RobotName, id: u16) -> Result<Claim, OpenError> {
        Claim::take(self, robot, id)
    }

    /// Makes this process the only one that may speak as the driver `driver` of the sensor `source` of `robot`, until the claim is dropped
    /// or the process ends.
    ///
    /// # Errors
    /// [`OpenError::DriverRuns`], with the process that came first.
    pub fn claim_driver(
        &self,
        robot: &RobotName,
        driver: &str,
        source: u16,
    ) -> Result<Claim, OpenError> {
        Claim::take_driver(self, robot, driver, source)
    }

    /// Whether the place is still there: anybody who may can delete a directory, and the system does so at a logout.
    /// A few system calls; worth them once a second.
    ///
    /// # Errors
    /// What was deleted or exchanged. Those who are connected stay so; nobody else can join.
    pub fn check(&self) -> Result<(), Lost> {
        self.tenancy.residence.check()
    }

    /// What a person should know about how the space was entered.
    #[must_use]
    pub fn remarks(&self) -> &[Remark] {
        self.tenancy.residence.remarks()
    }

    /// Removes what processes have left that died, and says how many files of theirs it was: for whoever lives long, now
    /// and then. In a big fleet it takes several calls until everything was looked at, and some do nothing, so that it
    /// never takes more than half a percent of a processor.
    ///
    /// Not for a thread that must not wait: it looks through directories.
    #[allow(
        clippy::must_use_candidate,
        reason = "most callers do not care how many"
    )]
    pub fn tidy(&self) -> usize {
        // Whoever holds it is at it.
        let (Ok(mut broom), Some(_pass)) =
            (self.tenancy.broom.try_lock(), self.gate().pass_at_once())
        else {
            return 0;
        };
        broom.sweep(|turn| self.remove_leftovers(turn))
    }

    /// For whoever has passed the gate.
    fn remove_leftovers(&self, turn: Turn) -> usize {
        leftovers::remove(self.place(), turn)
    }

    /// How many connections of this process to others wait for memory or descriptors to be made.
    #[must_use]
    pub fn waiting_connections() -> usize {
        transport::waiting()
    }

    /// How every file in `/dev/shm` begins that ever was of this root and prefix.
    #[must_use]
    pub fn full_prefix(&self) -> &str {
        self.place().family()
    }

    /// The prefix under which iceoryx2 knows this space, as programs in other languages must state it: the full prefix,
    /// the content of the file `key` in the root, and `_`. It changes when everybody has left.
    #[must_use]
    pub fn middleware_prefix(&self) -> &str {
        self.place().prefix()
    }

    /// What is there now is what has to stay: for right after it was made.
    fn look_around(&self) {
        // What is lost already is told by the next check.
        let _ = self.check();
    }

    pub(crate) fn place(&self) -> &Place {
        self.tenancy.residence.place()
    }

    pub(crate) fn node(&self) -> &Node {
        &self.tenancy.node
    }

    fn gate(&self) -> &Gate {
        self.tenancy.residence.gate()
    }

    fn services(&self) -> &Services {
        self.tenancy.residence.services()
    }

    fn directory(&self) -> &PrivateDirectory {
        self.tenancy.residence.directory()
    }
}

/// So often is it tried again while others are just making what all nodes share.
const TRIES: usize = 20;
const PAUSE: Duration = Duration::from_millis(25);

fn create_node(residence: &Residence, name: &str) -> Result<Node, OpenError> {
    let place = residence.place();
    let name: NodeName = name
        .try_into()
        .map_err(|_| OpenError::BadNodeName { name: name.into() })?;
    disk::check(place.root()).map_err(|error| refused(place, Site::Root, error))?;
    let mut tries = 0..TRIES;
    loop {
        let pass = residence.gate().pass();
        match try_create_node(place, &name) {
            // Full is full.
            Err(NodeCreationFailure::InternalError)
                if fault::peek().is_none() && tries.next().is_some() =>
            {
                leftovers::remove(place, Turn::ALL);
                drop(pass);
                std::thread::sleep(PAUSE);
            }
            result => return result.map_err(|reason| failed(place, reason)),
        }
    }
}

fn try_create_node(place: &Place, name: &NodeName) -> Result<Node, NodeCreationFailure> {
    fault::take();
    NodeBuilder::new()
        .name(name)
        .config(place.config())
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
}

fn failed(place: &Place, reason: NodeCreationFailure) -> OpenError {
    match fault::take_or_ask() {
        Some((site, error)) => refused(place, site, error),
        None => OpenError::Node {
            root: place.root().into(),
            reason,
        },
    }
}

fn refused(place: &Place, site: Site, error: Errno) -> OpenError {
    OpenError::Refused {
        root: place.root().into(),
        source: error.into(),
        advice: site.advice(error),
    }
}

/// A space may be opened on one thread and its ports on others.
const _: () = {
    const fn is_shared<T: Send + Sync>() {}
    is_shared::<Space>();
    is_shared::<Claim>();
};
