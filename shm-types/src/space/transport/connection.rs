//! The way from one port to another, as soon as it can be made.
//!
//! iceoryx2 tries to connect once, when the other port comes. If memory or descriptors are missing then, the two would
//! never meet; and the tick, which does this, cannot wait. So a connection that cannot be made counts as made, carries
//! nothing, and is tried again now and then when it is used.
#![expect(unsafe_code, reason = "iceoryx2's traits ask for it")]

use core::cell::{Cell, OnceCell, RefCell};
use core::ptr::NonNull;
use core::time::Duration;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use iceoryx2_bb_concurrency::atomic::AtomicU64;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_cal::named_concept::{
    FileName, NamedConcept, NamedConceptBuilder, NamedConceptDoesExistError, NamedConceptListError,
    NamedConceptMgmt, NamedConceptPathHintRemoveError, NamedConceptRemoveError, Path,
};
use iceoryx2_cal::zero_copy_connection::common::details::{self, SharedManagementData};
use iceoryx2_cal::zero_copy_connection::{
    BackpressureToReceiverAction, BackpressureToReceiverFn, ChannelId, ChannelState, PointerOffset,
    ZeroCopyConnection, ZeroCopyConnectionBuilder, ZeroCopyCreationError, ZeroCopyPortDetails,
    ZeroCopyPortRemoveError, ZeroCopyReceiveError, ZeroCopyReceiver, ZeroCopyReclaimError,
    ZeroCopyReleaseError, ZeroCopySendError, ZeroCopySender,
};

use super::storage::Storage;

type Made = details::Connection<Storage<SharedManagementData>>;
type MadeBuilder = details::Builder<Storage<SharedManagementData>>;
type Configuration = details::Configuration<Storage<SharedManagementData>>;

/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(100);

/// How many connections of this process wait to be made.
pub(crate) fn waiting() -> usize {
    WAITING.load(Ordering::Relaxed)
}

static WAITING: AtomicUsize = AtomicUsize::new(0);

/// Counts one that waits.
#[derive(Debug)]
struct Waiting;

impl Waiting {
    fn new() -> Self {
        WAITING.fetch_add(1, Ordering::Relaxed);
        Self
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        WAITING.fetch_sub(1, Ordering::Relaxed);
    }
}

/// iceoryx2's `zero_copy_connection`.
#[derive(Debug)]
pub(crate) struct Connection;

impl NamedConceptMgmt for Connection {
    type Configuration = Configuration;

    unsafe fn remove_cfg(
        name: &FileName,
        config: &Configuration,
    ) -> Result<bool, NamedConceptRemoveError> {
        // SAFETY: the caller's promise is handed on.
        unsafe { Made::remove_cfg(name, config) }
    }

    fn does_exist_cfg(
        name: &FileName,
        config: &Configuration,
    ) -> Result<bool, NamedConceptDoesExistError> {
        Made::does_exist_cfg(name, config)
    }

    fn list_cfg(config: &Configuration) -> Result<Vec<FileName>, NamedConceptListError> {
        Made::list_cfg(config)
    }

    fn remove_path_hint(path: &Path) -> Result<(), NamedConceptPathHintRemoveError> {
        Made::remove_path_hint(path)
    }
}

impl ZeroCopyConnection for Connection {
    type Sender = Sender;
    type Receiver = Receiver;
    type Builder = Builder;

    unsafe fn remove_sender(
        name: &FileName,
        config: &Configuration,
    ) -> Result<(), ZeroCopyPortRemoveError> {
        // SAFETY: the caller's promise is handed on.
        unsafe { Made::remove_sender(name, config) }
    }

    unsafe fn remove_receiver(
        name: &FileName,
        config: &Configuration,
    ) -> Result<(), ZeroCopyPortRemoveError> {
        // SAFETY: the caller's promise is handed on.
        unsafe { Made::remove_receiver(name, config) }
    }

    fn does_support_safe_overflow() -> bool {
        Made::does_support_safe_overflow()
    }

    fn has_configurable_buffer_size() -> bool {
        Made::has_configurable_buffer_size()
    }
}

/// What a connection is to be.
#[derive(Clone, Debug)]
pub(crate) struct Builder {
    name: FileName,
    config: Configuration,
    buffer: usize,
    overflows: bool,
    borrows: usize,
    segments: u8,
    samples: usize,
    channels: usize,
    state: ChannelState,
}

impl NamedConceptBuilder<Connection> for Builder {
    fn new(name: &FileName) -> Self {
        use iceoryx2_cal::zero_copy_connection as default;
        Self {
            name: *name,
            config: Configuration::default(),
            buffer: default::DEFAULT_BUFFER_SIZE,
            overflows: default::DEFAULT_ENABLE_SAFE_OVERFLOW,
            borrows: default::DEFAULT_MAX_BORROWED_SAMPLES_PER_CHANNEL,
            segments: default::DEFAULT_MAX_SUPPORTED_SHARED_MEMORY_SEGMENTS,
            samples: default::DEFAULT_NUMBER_OF_SAMPLES_PER_SEGMENT,
            channels: default::DEFAULT_NUMBER_OF_CHANNELS,
            state: default::CHANNEL_STATE_OPEN,
        }
    }

    fn config(self, config: &Configuration) -> Self {
        let config = config.clone();
        Self { config, ..self }
    }
}

impl ZeroCopyConnectionBuilder<Connection> for Builder {
    fn buffer_size(self, buffer: usize) -> Self {
        Self { buffer, ..self }
    }

    fn enable_safe_overflow(self, overflows: bool) -> Self {
        Self { overflows, ..self }
    }

    fn receiver_max_borrowed_samples_per_channel(self, borrows: usize) -> Self {
        Self { borrows, ..self }
    }

    fn max_supported_shared_memory_segments(self, segments: u8) -> Self {
        Self { segments, ..self }
    }

    fn number_of_samples_per_segment(self, samples: usize) -> Self {
        Self { samples, ..self }
    }

    fn number_of_channels(self, channels: usize) -> Self {
        Self { channels, ..self }
    }

    fn initial_channel_state(self, state: ChannelState) -> Self {
        Self { state, ..self }
    }

    /// Nothing here waits.
    fn timeout(self, _: Duration) -> Self {
        self
    }

    fn create_sender(self) -> Result<Sender, ZeroCopyCreationError> {
        Port::make(self, MadeBuilder::create_sender)
    }

    fn create_receiver(self) -> Result<Receiver, ZeroCopyCreationError> {
        Port::make(self, MadeBuilder::create_receiver)
    }
}

impl Builder {
    fn made(&self) -> MadeBuilder {
        MadeBuilder::new(&self.name)
            .config(&self.config)
            .buffer_size(self.buffer)
            .enable_safe_overflow(self.overflows)
            .receiver_max_borrowed_samples_per_channel(self.borrows)
            .max_supported_shared_memory_segments(self.segments)
            .number_of_samples_per_segment(self.samples)
            .number_of_channels(self.channels)
            .initial_channel_state(self.state)
    }
}

type Make<P> = fn(MadeBuilder) -> Result<P, ZeroCopyCreationError>;

pub(crate) type Sender = Port<details::Sender<Storage<SharedManagementData>>>;
pub(crate) type Receiver = Port<details::Receiver<Storage<SharedManagementData>>>;

/// One end of a connection. It stays on the thread of its port.
#[derive(Debug)]
pub(crate) struct Port<P> {
    made: OnceCell<P>,
    make: Make<P>,
    builder: Builder,
    waiting: RefCell<Option<Waiting>>,
    next_attempt: Cell<Instant>,
    /// What is said about each channel until it is made.
    state: AtomicU64,
}

impl<P> Port<P> {
    fn make(builder: Builder, make: Make<P>) -> Result<Self, ZeroCopyCreationError> {
        let (made, waiting) = match make(builder.made()) {
            Ok(made) => (OnceCell::from(made), None),
            Err(error) if is_passing(error) => (OnceCell::new(), Some(Waiting::new())),
            Err(error) => return Err(error),
        };
        Ok(Self {
            made,
            make,
            state: AtomicU64::new(builder.state.value()),
            builder,
            waiting: RefCell::new(waiting),
            next_attempt: Cell::new(Instant::now() + PAUSE),
        })
    }

    /// Tries again, if it is time to.
    #[inline]
    fn get(&self) -> Option<&P> {
        self.made.get().or_else(|| self.attempt())
    }

    #[cold]
    fn attempt(&self) -> Option<&P> {
        let now = Instant::now();
        if now < self.next_attempt.get() {
            return None;
        }
        self.next_attempt.set(now + PAUSE);
        let made = (self.make)(self.builder.made()).ok()?;
        self.waiting.take();
        Some(self.made.get_or_init(|| made))
    }
}

/// Whether it may be possible later.
fn is_passing(error: ZeroCopyCreationError) -> bool {
    matches!(
        error,
        ZeroCopyCreationError::InternalError
            | ZeroCopyCreationError::IsBeingCleanedUp
            | ZeroCopyCreationError::InitializationNotYetFinalized
    )
}

impl<P: Abandonable> Abandonable for Port<P> {
    unsafe fn abandon_in_place(mut this: NonNull<Self>) {
        // SAFETY: the caller promises that it is valid, and that nobody uses or drops it afterwards.
        unsafe {
            if let Some(made) = this.as_mut().made.take() {
                made.abandon();
            }
            core::ptr::drop_in_place(this.as_ptr());
        }
    }
}

impl<P: core::fmt::Debug> NamedConcept for Port<P> {
    #[inline]
    fn name(&self) -> &FileName {
        &self.builder.name
    }
}

impl<P: ZeroCopyPortDetails> ZeroCopyPortDetails for Port<P> {
    #[inline]
    fn number_of_channels(&self) -> usize {
        self.builder.channels
    }

    /// Nothing fits into it until it is made: no history is sent.
    #[inline]
    fn buffer_size(&self) -> usize {
        self.made.get().map_or(0, P::buffer_size)
    }

    #[inline]
    fn has_enabled_safe_overflow(&self) -> bool {
        self.builder.overflows
    }

    #[inline]
    fn max_borrowed_samples(&self) -> usize {
        self.builder.borrows
    }

    #[inline]
    fn max_supported_shared_memory_segments(&self) -> u8 {
        self.builder.segments
    }

    #[inline]
    fn is_connected(&self) -> bool {
        self.made.get().is_some_and(P::is_connected)
    }

    #[inline]
    fn __internal_get_channel_state(&self, channel: ChannelId) -> &AtomicU64 {
        self.made.get().map_or(&self.state, |made| {
            made.__internal_get_channel_state(channel)
        })
    }
}

impl ZeroCopySender for Sender {
    #[inline]
    fn try_send(
        &self,
        sample: PointerOffset,
        size: usize,
        channel: ChannelId,
    ) -> Result<Option<PointerOffset>, ZeroCopySendError> {
        match self.get() {
            Some(made) => made.try_send(sample, size, channel),
            // What the port makes of it is to go on with the others.
            None => Err(ZeroCopySendError::ConnectionCorrupted),
        }
    }

    #[inline]
    fn blocking_send<F: BackpressureToReceiverFn>(
        &self,
        sample: PointerOffset,
        size: usize,
        channel: ChannelId,
        handler: F,
        action: BackpressureToReceiverAction,
    ) -> Result<Option<PointerOffset>, ZeroCopySendError> {
        match self.get() {
            Some(made) => made.blocking_send(sample, size, channel, handler, action),
            None => Err(ZeroCopySendError::ConnectionCorrupted),
        }
    }

    #[inline]
    fn reclaim(&self, channel: ChannelId) -> Result<Option<PointerOffset>, ZeroCopyReclaimError> {
        self.made
            .get()
            .map_or(Ok(None), |made| made.reclaim(channel))
    }

    #[inline]
    unsafe fn acquire_used_offsets<F: FnMut(PointerOffset)>(&self, callback: F) {
        if let Some(made) = self.made.get() {
            // SAFETY: the caller's promise is handed on.
            unsafe { made.acquire_used_offsets(callback) }
        }
    }
}

impl ZeroCopyReceiver for Receiver {
    #[inline]
    fn has_data(&self, channel: ChannelId) -> bool {
        self.get().is_some_and(|made| made.has_data(channel))
    }

    #[inline]
    fn receive(&self, channel: ChannelId) -> Result<Option<PointerOffset>, ZeroCopyReceiveError> {
        self.get().map_or(Ok(None), |made| made.receive(channel))
    }

    #[inline]
    fn release(
        &self,
        sample: PointerOffset,
        channel: ChannelId,
    ) -> Result<(), ZeroCopyReleaseError> {
        self.made
            .get()
            .map_or(Ok(()), |made| made.release(sample, channel))
    }

    #[inline]
    fn borrow_count(&self, channel: ChannelId) -> usize {
        self.made.get().map_or(0, |made| made.borrow_count(channel))
    }
}
