//! The two ends of a channel.
use std::cell::{Cell, OnceCell};
use std::fmt::Debug;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::port::{DegradationAction, DegradationFn};
use iceoryx2::prelude::{BackpressureStrategy, PortFactory as _, ServiceName};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as ServiceOpenError,
    PublishSubscribeOpenOrCreateError as ServiceError,
};

use rustix::io::Errno;

use super::bells::{BELLS, Page, Ringer, Waiter};
use super::error::{OpenError, PortError, ReceiveError, SendError, WaitError};
use super::gate::Pass;
use super::group::{Group, GroupPage};
use super::leftovers::{self, Turn};
use super::manner::Manner;
use super::services::Use;
use super::spoken;
use super::transport;
use super::transport::fault::{self, Site};
use super::{Node, Space};
use crate::{Estimate, Message, Quality, RobotName};

type Factory<M> =
    iceoryx2::service::port_factory::publish_subscribe::PortFactory<transport::Service, M, ()>;

/// Processes that come and go leave a service between states for a moment: for so long is it tried again.
const PATIENCE: Duration = Duration::from_millis(1200);
const PAUSE: Duration = Duration::from_millis(25);
/// What is still so after this is not just being made or removed.
const MOMENT: Duration = Duration::from_millis(250);

/// Sends the messages of one robot and channel. It stays on the thread that opened it.
#[derive(Debug)]
pub struct Publisher<M: Message> {
    port: iceoryx2::port::publisher::Publisher<transport::Service, M, ()>,
    missed: Missed,
    bells: Ringer,
    /// Something was put that was not rung for.
    put: Cell<bool>,
    stay: Stay,
}

impl<M: Message> Publisher<M> {
    pub(super) fn open(space: &Space, robot: &RobotName) -> Result<Self, PortError> {
        let missed = Missed::default();
        let create = |factory: &Factory<M>| {
            factory
                .publisher_builder()
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .set_degradation_handler(missed.handler())
                .create()
        };
        let explain = |error, service| match error {
            PublisherCreateError::ExceedsMaxSupportedPublishers => PortError::Full {
                service,
                port: "publisher",
                limit: M::CHANNEL.quality().publishers,
            },
            reason => failed(service, reason),
        };
        let name = service_name::<M>(robot);
        let (port, stay) = enter(space, name, Manner::Make, create, explain)?;
        let bells = stay.page().and_then(Ringer::new);
        let bells = bells.map_err(|error| stay.refusal(error))?;
        Ok(Self {
            port,
            missed,
            bells,
            put: Cell::new(false),
            stay,
        })
    }

    /// Sends `message` to whoever listens, and wakes who waits for it. Without an allocation while nobody joins; with a system call
    /// for each who waits, that returns at once.
    ///
    /// # Errors
    /// If it did not reach everybody; nothing needs to be done about it.
    pub fn send(&self, message: M) -> Result<(), SendError> {
        let sent = self.put(message);
        self.ring();
        sent
    }

    /// The first half of [`Self::send`]: nobody is woken before [`Self::ring`]. For who has more urgent things to do meanwhile:
    /// who is woken may take the processor.
    ///
    /// # Errors
    /// As [`Self::send`].
    pub fn put(&self, message: M) -> Result<(), SendError> {
        self.put_with(message, |_| ())
    }

    /// The same; `look` sees the message where it lies, before anybody else does. What is looked at so need not be copied.
    ///
    /// # Errors
    /// As [`Self::send`].
    pub fn put_with(&self, message: M, look: impl FnOnce(&M)) -> Result<(), SendError> {
        self.put.set(true);
        let slot = self
            .port
            .loan_uninit()
            .map_err(|error| SendError(error.into()))?;
        let sample = slot.write_payload(message);
        look(&sample);
        sample.send().map_err(SendError)?;
        if self.missed.take() {
            return Err(SendError(iceoryx2::port::SendError::UnableToDeliver));
        }
        Ok(())
    }

    /// Wakes who waits for what was put.
    pub fn ring(&self) {
        if self.put.replace(false) {
            // Who has come since the message was put gets it only so.
            let welcome = || {
                let _ = self.port.update_connections();
            };
            self.bells.ring(&self.stay.space, welcome);
        }
    }

    /// All of [`Self::send`] but the message: whoever has time does now what sending would do then.
    pub fn rehearse(&self) {
        // What fails here fails when a message is sent, and is told then.
        let _ = (self.refresh(), self.port.loan_uninit());
    }

    /// Connects to subscribers that have joined, and gives them the history: allocates, so call it before arming.
    ///
    /// # Errors
    /// If one of them could not be connected.
    pub fn refresh(&self) -> Result<(), SendError> {
        let connected = self.port.update_connections();
        self.bells.greet(&self.stay.space);
        connected.map_err(|error| SendError(error.into()))
    }
}

impl Publisher<Estimate> {
    /// Opens a page on which users of `group` may read the newest estimate of `robot`, whose number is `id`, and wait for it. Each
    /// estimate is to be [written](GroupPage::write) to it before it is sent.
    ///
    /// # Errors
    /// If this user may give nothing to that group, or the system refuses something.
    pub fn open_to(
        &self,
        group: &Group,
        robot: &RobotName,
        id: u16,
    ) -> Result<GroupPage, OpenError> {
        let space = &self.stay.space;
        let _pass = space.gate().pass();
        let bells = self.stay.page().map_err(|error| OpenError::System {
            action: "use",
            path: transport::SHARED_MEMORY.into(),
            source: error.into(),
        })?;
        GroupPage::open(space, bells, robot, id, group)
    }
}

/// Receives the messages of one robot and channel. It stays on the thread that opened it.
#[derive(Debug)]
pub struct Subscriber<M: Message> {
    port: iceoryx2::port::subscriber::Subscriber<transport::Service, M, ()>,
    /// Once somebody wants to wait.
    bell: OnceCell<Box<Waiter>>,
    stay: Stay,
}

impl<M: Message> Subscriber<M> {
    pub(super) fn open(
        space: &Space,
        robot: &RobotName,
        manner: Manner,
    ) -> Result<Self, PortError> {
        let create = |factory: &Factory<M>| factory.subscriber_builder().create();
        let explain = |error, service| match error {
            SubscriberCreateError::ExceedsMaxSupportedSubscribers => PortError::Full {
                service,
                port: "subscriber",
                limit: M::CHANNEL.quality().subscribers,
            },
            reason => failed(service, reason),
        };
        let name = service_name::<M>(robot);
        let (port, stay) = enter(space, name, manner, create, explain)?;
        Ok(Self {
            port,
            bell: OnceCell::new(),
            stay,
        })
    }

    /// The next message, copied out of shared memory: what is checked afterwards can no longer change.
    ///
    /// Neither allocates nor makes a system call while nobody joins. Messages of one publisher come in its order. After
    /// [`Self::wait`] or [`Self::bell`] it costs a system call to find nothing.
    ///
    /// # Errors
    /// If a publisher's messages could not be read; those of the others come with the next calls.
    pub fn receive(&self) -> Result<Option<M>, ReceiveError> {
        self.receive_with(|message| message)
    }

    /// [`Self::receive`], and what `take` makes of the message, which is not copied once more.
    ///
    /// # Errors
    /// As [`Self::receive`].
    #[inline]
    pub fn receive_with<T>(&self, mut take: impl FnMut(M) -> T) -> Result<Option<T>, ReceiveError> {
        let taken = self.look(&mut take)?;
        match self.bell.get() {
            Some(bell) if taken.is_none() && bell.arm() => self.look(&mut take),
            _ => Ok(taken),
        }
    }

    /// The next message, asleep until there is one; `None` if none came for as long as `timeout`, or a signal was handled.
    ///
    /// A message that is there already is returned at once, the oldest first: a reader that comes late or was busy gets the newest
    /// of those that the channel keeps for it, and no wake-up is lost in between. Publishers wake it that are of this crate;
    /// what programs in other languages say is found when it wakes up for another reason.
    ///
    /// # Errors
    /// As [`Self::receive`]; and with the first call, if there is nothing to be woken by.
    pub fn wait(&self, timeout: Duration) -> Result<Option<M>, WaitError> {
        let bell = self.waiter()?;
        let start = Instant::now();
        loop {
            if let Some(message) = self.receive()? {
                return Ok(Some(message));
            }
            let left = timeout.saturating_sub(start.elapsed());
            match bell.sleep(left) {
                Ok(true) => {}
                Ok(false) | Err(Errno::INTR) => return Ok(self.receive()?),
                Err(error) => return Err(self.stay.refusal(error).into()),
            }
        }
    }

    /// What is readable after a message has come, for `poll`, `epoll` and runtimes (tokio's `AsyncFd`), level- or edge-triggered.
    /// From now on: whenever [`Self::receive`] has found nothing, the next message makes it readable. It is to be waited on, never
    /// read from; sometimes there is nothing to receive after all.
    ///
    /// # Errors
    /// If there is nothing to be woken by.
    pub fn bell(&self) -> Result<BorrowedFd<'_>, PortError> {
        Ok(self.waiter()?.as_fd())
    }

    fn waiter(&self) -> Result<&Waiter, PortError> {
        if let Some(bell) = self.bell.get() {
            return Ok(bell);
        }
        let pass = self.stay.space.gate().pass();
        let place = self.stay.space.place();
        let bell = (self.stay.page()).and_then(|page| Waiter::new(place, page));
        drop(pass);
        let bell = bell.map_err(|error| self.stay.refusal(error))?;
        bell.arm();
        Ok(self.bell.get_or_init(|| Box::new(bell)))
    }

    #[inline]
    fn look<T>(&self, take: &mut impl FnMut(M) -> T) -> Result<Option<T>, ReceiveError> {
        let sample = self.port.receive().map_err(ReceiveError)?;
        Ok(sample.map(|sample| take(*sample)))
    }

    /// Connects to publishers that have joined: allocates, so call it before arming.
    ///
    /// # Errors
    /// If one of them could not be connected.
    pub fn refresh(&self) -> Result<(), ReceiveError> {
        self.port
            .update_connections()
            .map_err(|error| ReceiveError(error.into()))
    }
}

impl<M: Message> Drop for Publisher<M> {
    fn drop(&mut self) {
        self.stay.end();
    }
}

impl<M: Message> Drop for Subscriber<M> {
    fn drop(&mut self) {
        self.stay.end();
    }
}

/// What a port has of its service and its space. Dropped after it, the space last.
#[derive(Debug)]
struct Stay {
    used: Option<Use>,
    service: String,
    /// By which iceoryx2 knows it.
    hash: String,
    /// Held while the port is dropped.
    pass: Option<Pass>,
    space: Space,
}

impl Stay {
    fn begin<M: Message>(space: &Space, service: &str, factory: &Factory<M>) -> Self {
        let hash = factory.service_hash().as_str();
        Self {
            used: Some(space.services().enter(space.place(), service, hash)),
            service: service.into(),
            hash: hash.into(),
            pass: None,
            space: space.clone(),
        }
    }

    /// Where it stands who waits.
    fn page(&self) -> Result<Page, Errno> {
        Page::open(self.space.place(), &self.hash)
    }

    fn refusal(&self, error: Errno) -> PortError {
        let service = self.service.clone();
        if error == Errno::USERS {
            return PortError::Full {
                service,
                port: "waiting subscriber",
                limit: BELLS - 1,
            };
        }
        PortError::Refused {
            service,
            source: error.into(),
            advice: Site::Memory.advice(error),
        }
    }

    /// The port is about to be dropped, and may remove the service.
    fn end(&mut self) {
        self.pass = Some(self.space.gate().leave());
        self.used = None;
    }
}

/// Whether somebody was not reached: a connection waits to be made.
#[derive(Clone, Debug, Default)]
struct Missed(Arc<AtomicBool>);

impl Missed {
    /// Notes it, so that iceoryx2 neither logs it nor leaves out the others.
    fn handler(&self) -> impl DegradationFn + 'static {
        let missed = Arc::clone(&self.0);
        move |_, _| {
            missed.store(true, Ordering::Relaxed);
            DegradationAction::Ignore
        }
    }

    fn take(&self) -> bool {
        self.0.load(Ordering::Relaxed) && self.0.swap(false, Ordering::Relaxed)
    }
}

fn service_name<M: Message>(robot: &RobotName) -> String {
    format!("coloc/{robot}/{}", M::CHANNEL.name())
}

/// Opens the service with the quality of the table, and a port with `create`.
///
/// Whatever is in the way at first may be of the dead; and others, who know nothing of the gate, may be making or removing
/// it.
fn enter<M: Message, P, E>(
    space: &Space,
    service: String,
    manner: Manner,
    create: impl Fn(&Factory<M>) -> Result<P, E>,
    explain_port: impl FnOnce(E, String) -> PortError,
) -> Result<(P, Stay), PortError> {
    let name = ServiceName::new(&service).map_err(|reason| failed(service.clone(), reason))?;
    let start = Instant::now();
    let mut has_tried = false;
    loop {
        let pass = space.gate().pass();
        space.services().check_one(&service)?;
        fault::take();
        let factory = match try_open_service(space.node(), &name, manner) {
            Ok(factory) => factory,
            Err(error) if !has_tried || is_passing(error) && start.elapsed() < PATIENCE => {
                has_tried = true;
                clear_the_way(space, start.elapsed(), &pass);
                drop(pass);
                std::thread::sleep(PAUSE);
                continue;
            }
            Err(error) => return Err(explain::<M>(space, error, &name)),
        };
        return match reaping(space, || create(&factory)) {
            Ok(port) => Ok((port, Stay::begin(space, &service, &factory))),
            Err(error) => Err(explain_port(error, service)),
        };
    }
}

fn clear_the_way(space: &Space, since: Duration, pass: &Pass) {
    space.remove_leftovers(Turn::ALL);
    if pass.is_alone() && since > MOMENT {
        leftovers::remove_headless(space.place());
    }
}

fn try_open_service<M: Message>(
    node: &Node,
    name: &ServiceName,
    manner: Manner,
) -> Result<Factory<M>, ServiceError> {
    let quality = M::CHANNEL.quality();
    let builder = node
        .service_builder(name)
        .publish_subscribe::<M>()
        .enable_safe_overflow(true)
        .max_publishers(quality.publishers)
        .max_subscribers(quality.subscribers)
        .max_nodes(processes(quality))
        .subscriber_max_buffer_size(quality.buffer)
        .history_size(quality.history);
    match manner {
        Manner::Make => builder.open_or_create(),
        Manner::Find => Ok(builder.open()?),
    }
}

/// How many may use a service at once.
const fn processes(quality: Quality) -> usize {
    quality.publishers + quality.subscribers
}

fn is_passing(error: ServiceError) -> bool {
    use ServiceError::{PublishSubscribeCreateError as Create, PublishSubscribeOpenError as Open};
    matches!(
        error,
        ServiceError::SystemInFlux
            | Create(
                CreateError::AlreadyExists
                    | CreateError::IsBeingCreatedByAnotherInstance
                    | CreateError::HangsInCreation
                    | CreateError::ServiceInCorruptedState
            )
            | Open(
                ServiceOpenError::DoesNotExist
                    | ServiceOpenError::ExceedsMaxNumberOfNodes
                    | ServiceOpenError::HangsInCreation
                    | ServiceOpenError::IsMarkedForDestruction
                    | ServiceOpenError::ServiceInCorruptedState
            )
    )
}

fn explain<M: Message>(space: &Space, error: ServiceError, name: &ServiceName) -> PortError {
    use ServiceError::PublishSubscribeOpenError as Open;
    use ServiceOpenError as E;
    let service = name.to_string();
    match error {
        Open(E::IncompatibleTypes) => PortError::OtherType {
            service,
            theirs: spoken::on(space.place(), name).unwrap_or_else(|| "something else".into()),
            ours: M::TYPE_NAME,
        },
        Open(E::DoesNotExist) => PortError::NoChannel { service },
        Open(E::ExceedsMaxNumberOfNodes) => PortError::Full {
            service,
            port: "process",
            limit: processes(M::CHANNEL.quality()),
        },
        Open(
            reason @ (E::DoesNotSupportRequestedAmountOfPublishers
            | E::DoesNotSupportRequestedAmountOfSubscribers
            | E::DoesNotSupportRequestedAmountOfNodes
            | E::DoesNotSupportRequestedMinBufferSize
            | E::DoesNotSupportRequestedMinHistorySize
            | E::DoesNotSupportRequestedMinSubscriberBorrowedSamples
            | E::IncompatibleOverflowBehavior
            | E::IncompatibleMessagingPattern),
        ) => PortError::OtherQuality {
            service,
            reason: reason.to_string(),
        },
        reason => failed(service, reason),
    }
}

/// What the kernel has refused says more than what iceoryx2 makes of it.
fn failed(service: String, reason: impl Debug) -> PortError {
    match fault::take_or_ask() {
        Some((site, error)) => PortError::Refused {
            service,
            source: error.into(),
            advice: site.advice(error),
        },
        None => PortError::Transport {
            service,
            reason: format!("{reason:?}"),
        },
    }
}

/// Tries again once after the dead were reaped: they hold their places until somebody does.
fn reaping<T, E>(space: &Space, mut create: impl FnMut() -> Result<T, E>) -> Result<T, E> {
    fault::take();
    create().or_else(|_| {
        space.remove_leftovers(Turn::ALL);
        fault::take();
        create()
    })
}
