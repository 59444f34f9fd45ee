//! How who waits for a message is woken: a datagram of one byte, for which the kernel has a place.
//!
//! ```text
//! waiter:    take a bell ──► arm it ──► look ──► nothing? sleep ──► woken ──► look …
//! publisher: put the message ──► is a bell armed? ──► ring it ──► disarm it
//! ```
//!
//! * **Nobody waits: one load.** A page of shared memory, one for each service, says how many bells there ever were. No
//!   message makes a system call for which no bell is armed.
//! * **Nothing is lost.** Who arms looks once more before it sleeps; who publishes looks at the bells after the message is out.
//!   Both put a fence between the two, so one of them sees the other. What was rung counts as rung only if the bell was not
//!   armed again meanwhile: each arming has a number.
//! * **A bell rings once.** Who does not come back (stopped, killed, busy) costs one call, and none after that. The call is
//!   `send` with `MSG_DONTWAIT`, which the waiter cannot take back: the flags of an eventfd are its holders' alike.
//! * **A connected socket.** Looking up the path in every call takes as long as the wake-up itself once the caches are cold
//!   (22 of 98 µs). It is done when a bell is rung for the first time, as joining memory is.
//!
//! Bells are sockets in `/dev/shm`, of mode 0600: the path fits whatever the root, and what is left of the dead is found where
//! all else is.
mod page;
mod ringer;
mod waiter;

use std::path::{Path, PathBuf};

use rustix::io::Errno;
use rustix::net::SocketAddrUnix;

use super::config::Place;
use super::transport::SHARED_MEMORY;
pub(super) use page::Page;
pub(super) use ringer::Ringer;
pub(super) use waiter::Waiter;

/// Behind the name of a service's page.
const PAGE: &str = ".bells";
/// Behind the number of a bell.
pub(super) const BELL: &str = ".bell";

/// Bells of a service at once: as many as there may be subscribers, and one for the readers of a group.
pub(super) const BELLS: usize = 33;

/// Where the bell with this number is.
fn path(place: &Place, number: u64) -> PathBuf {
    let prefix = place.prefix();
    PathBuf::from(format!("{SHARED_MEMORY}/{prefix}{number:016x}{BELL}"))
}

/// Whether the bell there is of somebody who is dead.
pub(super) fn is_dead(path: &Path) -> bool {
    let tried = SocketAddrUnix::new(path).and_then(|address| ringer::connected(&address));
    matches!(tried, Err(Errno::CONNREFUSED))
}

/// The kernel's address for it.
fn address(place: &Place, number: u64) -> rustix::io::Result<SocketAddrUnix> {
    SocketAddrUnix::new(path(place, number))
}
