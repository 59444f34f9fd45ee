//! Room in the kernel for frames that come while nobody takes them: the process was stopped, or its processor was taken.

use std::fmt;
use std::os::fd::BorrowedFd;

use rustix::io::Errno;
use rustix::net::sockopt;

/// What a frame takes of a socket's buffer, its bookkeeping included \[bytes\]; kernels take 768 to 960.
const FRAME_BYTES: usize = 1024;

/// A bus keeps fewer frames than it was asked to.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Shortage {
    /// So many were asked for.
    pub wanted: usize,
    /// So many are kept; what comes on top is lost, and counted.
    pub kept: usize,
    limit: Limit,
}

/// What the kernel does not allow more of.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Limit {
    /// Bytes of a socket's receive buffer.
    ReceiveBuffer,
    /// Datagrams of a Unix socket.
    Datagrams,
}

/// The sentence for whoever administrates the machine.
impl fmt::Display for Shortage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self { wanted, kept, .. }, setting) = (self, self.setting());
        let value = match self.limit {
            Limit::ReceiveBuffer => asked_bytes(*wanted),
            Limit::Datagrams => *wanted,
        };
        write!(
            f,
            "the kernel keeps {kept} frames while nobody takes them, of {wanted} that were asked for; more are lost. To keep all, as \
             root and before the start: sysctl -w {setting}={value}"
        )
    }
}

/// Asks for a receive buffer for so many frames; how many fit into what was granted. No allocation.
pub(super) fn make(socket: BorrowedFd<'_>, frames: usize) -> Result<usize, Errno> {
    let bytes = asked_bytes(frames);
    // Without the privilege to exceed the limit, up to the limit.
    if sockopt::set_socket_recv_buffer_size_force(socket, bytes).is_err() {
        sockopt::set_socket_recv_buffer_size(socket, bytes)?;
    }
    Ok(sockopt::socket_recv_buffer_size(socket)? / FRAME_BYTES)
}

/// The kernel grants twice what it is asked for, for its bookkeeping, and that is counted above.
fn asked_bytes(frames: usize) -> usize {
    frames.saturating_mul(FRAME_BYTES / 2)
}

impl Shortage {
    /// The kernel's setting that gives more.
    #[must_use]
    pub fn setting(&self) -> &'static str {
        match self.limit {
            Limit::ReceiveBuffer => "net.core.rmem_max",
            Limit::Datagrams => "net.unix.max_dgram_qlen",
        }
    }

    /// If fewer than `wanted` are kept.
    pub(super) fn of(wanted: usize, kept: usize, limit: Limit) -> Option<Self> {
        (kept < wanted).then_some(Self {
            wanted,
            kept,
            limit,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shortage_names_what_gives_more() {
        let said = |limit| Shortage::of(6000, 11, limit).map(|shortage| shortage.to_string());
        let buffer = said(Limit::ReceiveBuffer).unwrap_or_default();
        assert!(
            buffer.contains("keeps 11 frames")
                && buffer.ends_with("sysctl -w net.core.rmem_max=3072000"),
            "{buffer}"
        );
        let queue = said(Limit::Datagrams).unwrap_or_default();
        assert!(
            queue.ends_with("sysctl -w net.unix.max_dgram_qlen=6000"),
            "{queue}"
        );
        assert_eq!(Shortage::of(100, 100, Limit::Datagrams), None);
    }
}
