//! What users of a group may read of a robot: its newest estimate, and the wait for the next one.
//!
//! iceoryx2 admits one user or everybody, and who receives writes to memory that others map. So there is a way beside it:
//!
//! ```text
//! real-time thread: write the page ─► ring (one bell, if somebody waits)     page 0640: mapped by readers, read-only
//! porter, a thread:                     └─► a byte for each reader           door 0660: a socket, a connection each
//! ```
//!
//! * **Nothing that a reader has can be written to, or locks anybody.** The page is a file of mode 0640 that no program of
//!   ours locks. The root stays 0700.
//! * **The real-time thread touches nothing that a reader made.** Who sends to a socket wakes all who watch its other end, and
//!   nobody limits how many these are: with 1000 `epoll` instances a byte takes 55 µs instead of 1. So it rings for the porter, a
//!   thread of the same process, with a bell like any other; and the porter for the readers, when it may.
//! * **The porter is awake before there is something to pass on**, where the robot's thread knows that soon there is: it
//!   calls, and the porter looks at most [so long](call). It is in real time, as long as it [needs little](urgency).
//! * **Who reads without waiting costs nothing**, and who is connected and does not come back a few bytes, until its connection
//!   is full. It is rung for again when there is room.
//! * **Who comes in is counted by user**, as the kernel knows it: [`READERS`] in all, [`READERS_OF_A_USER`] of each, and none of
//!   them takes a place of the owner's. Where all are taken, who has most gives one to who has fewer.
//! * **Nobody is turned away from the page.** The queue at the door can be filled by whoever knocks without end, and the porter is
//!   slow on a busy machine. So a reader that is not let in has a clock for a bell, looks, and knocks again.
//! * **Who reads decides whom to believe**: the page's owner has to be that of the root, whose path stands in the page's name
//!   as a hash. Names are unguessable in their middle, so that nobody can take them first.
mod alarm;
mod call;
mod door;
mod error;
mod found;
mod page;
mod porter;
mod reader;
mod shared;
mod urgency;
mod users;

pub use error::{NoGroup, ReadError};
pub use reader::Reader;
pub use shared::GroupPage;
pub use users::Group;

pub(super) use found::{is_dead_page, owner, places, running};

/// Behind the name of a robot.
pub(super) const PAGE: &str = ".page";
/// Behind the number of a page.
pub(super) const DOOR: &str = ".door";

/// Connections at once.
pub(crate) const READERS: usize = 32;
/// Of them.
pub(crate) const READERS_OF_A_USER: usize = 8;
