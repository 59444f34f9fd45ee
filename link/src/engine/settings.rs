//! How QUIC is set.
use std::sync::Arc;
use std::time::Duration;

use quinn::{IdleTimeout, TransportConfig, VarInt};

use super::window::Window;

/// After so long without a packet the other side is gone. Its next call is answered at once, whatever became of this connection.
const GONE: Duration = Duration::from_millis(2500);
const KEEP_ALIVE: Duration = Duration::from_millis(400);
/// Before anything was measured: a lost first packet is sent again after three of them.
const FIRST_ROUND_TRIP: Duration = Duration::from_millis(100);
/// Messages that may be on their way at once, each on its stream.
const STREAMS: u32 = 256;
/// Datagrams that wait; the oldest give way (bytes).
const DATAGRAMS: usize = 32 * 1024;
/// What one member may have on its way to us (bytes).
const HELD: u32 = 512 * 1024;

pub(super) fn transport() -> TransportConfig {
    let mut transport = TransportConfig::default();
    let gone = VarInt::from_u32(u32::try_from(GONE.as_millis()).unwrap_or(u32::MAX));
    transport
        .max_idle_timeout(Some(IdleTimeout::from(gone)))
        .keep_alive_interval(Some(KEEP_ALIVE))
        .initial_rtt(FIRST_ROUND_TRIP)
        .max_concurrent_uni_streams(VarInt::from_u32(STREAMS))
        .max_concurrent_bidi_streams(VarInt::from_u32(0))
        .datagram_send_buffer_size(DATAGRAMS)
        .datagram_receive_buffer_size(Some(DATAGRAMS))
        .receive_window(VarInt::from_u32(HELD))
        .send_window(HELD.into())
        .congestion_controller_factory(Arc::new(Window));
    transport
}
