//! QUIC, as the link needs it: connections between members, datagrams for what may be lost, a stream for each message that must
//! arrive, and a refusal of strangers that costs less than their knock.
//!
//! Nothing of `quinn` is seen outside of this module, and nothing of robots inside: a message is bytes.

mod door;
mod settings;
mod window;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use quinn::crypto::rustls::{NoInitialCipherSuite, QuicClientConfig, QuicServerConfig};
use quinn::{ClientConfig, Connection, Endpoint, ServerConfig, VarInt};
use rustls::pki_types::CertificateDer;

use crate::keys::{Identity, PublicKey};
use crate::tls::{self, Members, proven_key};
use crate::wire::LARGEST;

pub use door::{Door, Knocks};

/// Who is called: names play no part, keys do.
const ANYBODY: &str = "coloc.invalid";

/// So long may a handshake take. Half of the packets may be lost meanwhile, and the rest come half a second late.
pub const PATIENCE: Duration = Duration::from_secs(6);

/// The end of a connection, as the other side is told.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Closing {
    /// The program ends.
    Ended = 0,
    /// The key is not in the newest roster.
    Revoked = 1,
    /// The same member has called again since.
    Replaced = 2,
    /// Another member was called.
    Mistaken = 3,
    /// Nothing was said for a while, and the team is large.
    Idle = 4,
}

/// Why there is no engine.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// The address is taken, or not ours.
    #[error("it cannot be listened on {address}: {source}")]
    Listen {
        /// Where.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// TLS does not take the key.
    #[error("TLS does not take the key: {0}")]
    Tls(#[from] rustls::Error),
    /// TLS has no cipher that QUIC begins with.
    #[error(transparent)]
    Cipher(#[from] NoInitialCipherSuite),
}

/// Why nobody was reached.
#[derive(Debug, thiserror::Error)]
pub enum CallError {
    /// The address is none to call.
    #[error("{0}")]
    Address(#[from] quinn::ConnectError),
    /// Who is there did not take the call, or is no member.
    #[error("{0}")]
    Refused(#[from] quinn::ConnectionError),
    /// Nobody answered in [`PATIENCE`].
    #[error("nobody answers")]
    Silence,
    /// The other side proved no key.
    #[error("the other side proved no key")]
    NoKey,
}

/// One UDP socket, for all that calls and is called.
#[derive(Clone, Debug)]
pub struct Engine {
    endpoint: Endpoint,
    client: ClientConfig,
}

impl Engine {
    /// Listens on `address` as `own`; `members` decides at every handshake who is let in.
    ///
    /// # Errors
    /// If the address cannot be had, or TLS does not take the key.
    pub fn open(
        address: SocketAddr,
        own: &Identity,
        members: &Arc<dyn Members>,
    ) -> Result<Self, EngineError> {
        let transport = Arc::new(settings::transport());
        let tls = tls::server(own, Arc::clone(members))?;
        let mut server = ServerConfig::with_crypto(Arc::new(QuicServerConfig::try_from(tls)?));
        server.transport_config(Arc::clone(&transport));
        let endpoint = Endpoint::server(server, address);
        let endpoint = endpoint.map_err(|source| EngineError::Listen { address, source })?;
        let tls = tls::client(own, Arc::clone(members))?;
        let mut client = ClientConfig::new(Arc::new(QuicClientConfig::try_from(tls)?));
        client.transport_config(transport);
        Ok(Self { endpoint, client })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// What the system says.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.endpoint.local_addr()
    }

    /// Calls who listens at `address`.
    ///
    /// # Errors
    /// Why nobody was reached.
    pub async fn call(&self, address: SocketAddr) -> Result<Line, CallError> {
        let calling = self
            .endpoint
            .connect_with(self.client.clone(), address, ANYBODY)?;
        let answered = tokio::time::timeout(PATIENCE, calling).await;
        Line::of(answered.map_err(|_| CallError::Silence)??)
    }

    /// The next who knocks, once a door is there for it; `None` at the end.
    pub async fn knock(&self) -> Option<quinn::Incoming> {
        self.endpoint.accept().await
    }

    /// Ends all connections, and waits a moment until the other sides have been told.
    pub async fn close(&self) {
        self.endpoint.close(code(Closing::Ended), &[]);
        let _ = tokio::time::timeout(Duration::from_millis(200), self.endpoint.wait_idle()).await;
    }
}

/// A connection to a member, whose key it has proved.
#[derive(Clone, Debug)]
pub struct Line {
    connection: Connection,
    key: PublicKey,
}

/// How a connection is doing.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Vitals {
    /// There and back (s).
    pub round_trip_s: f64,
    /// Packets that were sent.
    pub sent: u64,
    /// Those of them that never arrived.
    pub lost: u64,
    /// Bytes that were sent, with all that QUIC and UDP add.
    pub sent_bytes: u64,
    /// Bytes that came.
    pub heard_bytes: u64,
}

impl Vitals {
    /// How many of the packets were lost (%).
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "counts, for people")]
    pub fn lost_percent(&self) -> f64 {
        100.0 * self.lost as f64 / self.sent.max(1) as f64
    }

    /// Counts another connection in; the round trip is the longer one.
    pub fn add(&mut self, more: &Self) {
        self.round_trip_s = self.round_trip_s.max(more.round_trip_s);
        self.sent += more.sent;
        self.lost += more.lost;
        self.sent_bytes += more.sent_bytes;
        self.heard_bytes += more.heard_bytes;
    }
}

impl Line {
    fn of(connection: Connection) -> Result<Self, CallError> {
        let shown = connection.peer_identity();
        let shown = shown.and_then(|shown| shown.downcast::<Vec<CertificateDer<'static>>>().ok());
        let key = shown.and_then(|shown| shown.first().and_then(proven_key));
        let key = key.ok_or(CallError::NoKey)?;
        Ok(Self { connection, key })
    }

    /// The key that the other side has proved.
    #[must_use]
    pub const fn key(&self) -> &PublicKey {
        &self.key
    }

    /// Where the other side is.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.connection.remote_address()
    }

    /// Whether it is the same connection.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        self.connection.stable_id() == other.connection.stable_id()
    }

    /// Sends what may be lost; whether it was small enough, and the other side still there.
    #[must_use]
    pub fn send_datagram(&self, message: &[u8]) -> bool {
        self.connection
            .send_datagram(message.to_vec().into())
            .is_ok()
    }

    /// The largest datagram at this moment (bytes).
    #[must_use]
    pub fn largest_datagram(&self) -> usize {
        self.connection.max_datagram_size().unwrap_or(0)
    }

    /// Sends what must arrive, and waits until it has; given up after `patience`, and then forgotten on both sides. Whether it arrived.
    pub async fn send_stream(&self, message: &[u8], patience: Duration) -> bool {
        let until = tokio::time::Instant::now() + patience;
        let opened = tokio::time::timeout_at(until, self.connection.open_uni()).await;
        let Ok(Ok(mut stream)) = opened else {
            return false;
        };
        let written = tokio::time::timeout_at(until, stream.write_all(message)).await;
        let written = matches!(written, Ok(Ok(()))) && stream.finish().is_ok();
        if written
            && matches!(
                tokio::time::timeout_at(until, stream.stopped()).await,
                Ok(Ok(None))
            )
        {
            return true;
        }
        // It may have been given up by the other side already.
        let _ = stream.reset(VarInt::from_u32(0));
        false
    }

    /// The next datagram; `None` once the connection is over.
    pub async fn datagram(&self) -> Option<Vec<u8>> {
        self.connection
            .read_datagram()
            .await
            .ok()
            .map(|it| it.to_vec())
    }

    /// The next message that has its own stream, which has just begun; `None` once the connection is over.
    pub async fn stream(&self) -> Option<Arriving> {
        self.connection.accept_uni().await.ok().map(Arriving)
    }

    /// Whether it has ended.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.connection.close_reason().is_some()
    }

    /// Waits for its end, and says why it ended.
    pub async fn ended(&self) -> String {
        self.connection.closed().await.to_string()
    }

    /// Ends it at once.
    pub fn close(&self, closing: Closing) {
        self.connection.close(code(closing), &[]);
    }

    /// How it is doing.
    #[must_use]
    pub fn vitals(&self) -> Vitals {
        let stats = self.connection.stats();
        Vitals {
            round_trip_s: stats.path.rtt.as_secs_f64(),
            sent: stats.path.sent_packets,
            lost: stats.path.lost_packets,
            sent_bytes: stats.udp_tx.bytes,
            heard_bytes: stats.udp_rx.bytes,
        }
    }
}

/// A message on its way.
#[derive(Debug)]
pub struct Arriving(quinn::RecvStream);

impl Arriving {
    /// All of it, once it is there; `None` if it was given up, or is larger than any message.
    pub async fn whole(mut self) -> Option<Vec<u8>> {
        self.0.read_to_end(LARGEST).await.ok()
    }
}

const fn code(closing: Closing) -> VarInt {
    VarInt::from_u32(closing as u32)
}
