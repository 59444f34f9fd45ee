//! What every payload begins with.
use iceoryx2::prelude::ZeroCopySend;

use crate::layout::layout;

/// Which moment, which start of the sender, which message: enough to tell a repetition from news.
///
/// | offset | field | |
/// | --- | --- | --- |
/// | 0 | `stamp_ns` | i64 |
/// | 8 | `session_ns` | i64 |
/// | 16 | `sequence` | u64 |
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Header.v1")]
pub struct Header {
    /// When it was measured (ns of the configured clock).
    pub stamp_ns: i64,
    /// When the sender started (ns of the configured clock): a restarted sender counts from 0 again.
    pub session_ns: i64,
    /// Counts the sender's messages on this channel.
    pub sequence: u64,
}

layout!(Header, 24; stamp_ns: 0, session_ns: 8, sequence: 16);
