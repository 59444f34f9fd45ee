//! How iceoryx2 is used: as `ipc::Service`, with the same names and the same bytes, but made so that no moment in which
//! a process dies, and no memory that is missing, stops those who live.
//!
//! * A file appears under its name complete or not at all ([`segment`], [`record`]).
//! * Opening never waits, and refuses what is half-made or cut off.
//! * Memory is reserved before it is written: what cannot be had is an error, not a signal.
//! * A connection that cannot be made now is tried again ([`connection`]).
//!
//! What is wrong in iceoryx2 itself stands in `docs/upstream.md`.
mod connection;
pub(crate) mod fault;
mod record;
mod segment;
mod storage;
mod unfinished;

use core::fmt::Debug;

use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_cal::shm_allocator::bump_allocator::BumpAllocator;
use iceoryx2_cal::shm_allocator::pool_allocator::PoolAllocator;
use iceoryx2_cal::{
    arc_sync_policy, event, hash, monitoring, reactor, resizable_shared_memory, serialize,
    shared_memory,
};

pub(crate) use connection::waiting;
pub(crate) use segment::{DIRECTORY as SHARED_MEMORY, Draft, Refusal, Segment};
pub(crate) use storage::is_complete;

type Memory<A> = shared_memory::common::details::Memory<
    A,
    storage::Storage<shared_memory::common::details::AllocatorDetails<A>>,
>;

/// Opens the same services as iceoryx2's `ipc::Service` of the same version.
#[derive(Clone, Debug)]
pub(crate) struct Service {}

impl iceoryx2::service::Service for Service {
    type StaticStorage = record::Storage;
    type ConfigSerializer = serialize::recommended::Recommended;
    type PersistentDynamicStorage<T: Debug + Send + Sync + 'static> = storage::Storage<T>;
    type DynamicStorage<T: Debug + Send + Sync + 'static> = storage::Storage<T>;
    type ServiceNameHasher = hash::recommended::Recommended;
    type SharedMemory = Memory<PoolAllocator>;
    type ResizableSharedMemory =
        resizable_shared_memory::dynamic::DynamicMemory<PoolAllocator, Memory<PoolAllocator>>;
    type Connection = connection::Connection;
    type Event = event::recommended::Ipc;
    type Monitoring = monitoring::recommended::Ipc;
    type Reactor = reactor::recommended::Ipc;
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> =
        arc_sync_policy::single_threaded::SingleThreaded<T>;
    type BlackboardMgmt<T: Send + Sync + Debug + 'static> = storage::Storage<T>;
    type BlackboardPayload = Memory<BumpAllocator>;
}

impl iceoryx2::service::internal::ServiceInternal<Service> for Service {}
