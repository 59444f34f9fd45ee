//! Who is reached, in words. It is called with a key of nobody's, so that no link that runs is disturbed: who is there proves its own
//! key before it asks for ours, and then sends us away.
use std::net::{Ipv6Addr, SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::Arc;
use std::time::Instant;

use coloc_sensors::EndError;

use super::Findings;
use crate::engine::{CallError, Engine, Line};
use crate::keys::{Identity, PublicKey};
use crate::roster::{Member, Roster};
use crate::tls::Members;

/// Everybody: whose key it was is said afterwards.
#[derive(Debug)]
struct Anybody;

impl Members for Anybody {
    fn admits(&self, _: &PublicKey) -> bool {
        true
    }
}

/// Calls every address of every other member.
pub(super) fn try_all(roster: &Roster, own: u16, findings: &mut Findings) -> Result<(), EndError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(EndError::of("there is no runtime"))?;
    runtime.block_on(async {
        let identity = Identity::generate().map_err(EndError::of("there are no random numbers"))?;
        let members: Arc<dyn Members> = Arc::new(Anybody);
        let engine = Engine::open(any_address(), &identity, &members);
        let engine = engine.map_err(|error| EndError::Input(error.to_string()))?;
        for member in roster.member.iter().filter(|it| it.id != own) {
            if member.addresses.is_empty() {
                findings.tell(
                    member.name.as_str(),
                    "has no address in the roster: it has to call, or be found by multicast DNS",
                );
            }
            for address in &member.addresses {
                try_one(&engine, roster, member, address, findings).await;
            }
        }
        engine.close().await;
        Ok(())
    })
}

/// Both families where the computer has both.
fn any_address() -> SocketAddr {
    let six = SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0));
    match UdpSocket::bind(six) {
        Ok(_) => six,
        Err(_) => SocketAddr::from(([0, 0, 0, 0], 0)),
    }
}

async fn try_one(
    engine: &Engine,
    roster: &Roster,
    member: &Member,
    address: &str,
    findings: &mut Findings,
) {
    let name = member.name.as_str();
    let found = match address.to_socket_addrs() {
        Ok(mut found) => found.next(),
        Err(error) => {
            return findings.warn(format!("{name}: {address} is no address: {error}"));
        }
    };
    let Some(found) = found else {
        return findings.warn(format!("{name}: {address} has no address"));
    };
    let since = Instant::now();
    match engine.call(reachable(engine, found)).await {
        Ok(line) => answered(&line, since, roster, member, address, findings),
        Err(CallError::Silence) => findings.warn(silence(name, address, found)),
        Err(CallError::Refused(error)) if is_silence(&error) => {
            findings.warn(silence(name, address, found));
        }
        Err(error) => findings.warn(format!("{name}: at {address} somebody answers that is no coloc-link, or of another version: {error}")),
    }
}

/// A socket of both families writes the older one's addresses in the newer one's way.
fn reachable(engine: &Engine, address: SocketAddr) -> SocketAddr {
    let is_six = engine.address().is_ok_and(|own| own.is_ipv6());
    match address {
        SocketAddr::V4(four) if is_six => {
            SocketAddr::from((four.ip().to_ipv6_mapped(), four.port()))
        }
        other => other,
    }
}

fn is_silence(error: &quinn::ConnectionError) -> bool {
    matches!(error, quinn::ConnectionError::TimedOut)
}

fn silence(name: &str, address: &str, found: SocketAddr) -> String {
    format!(
        "{name}: nothing comes back from {address}: is coloc-link running there, and does a firewall let UDP through to port {}?",
        found.port()
    )
}

fn answered(
    line: &Line,
    since: Instant,
    roster: &Roster,
    member: &Member,
    address: &str,
    findings: &mut Findings,
) {
    let name = member.name.as_str();
    if member.has(line.key()) {
        let millis = since.elapsed().as_secs_f64() * 1e3;
        let largest = line.largest_datagram();
        findings.tell(
            name,
            &format!("answers at {address}, of the roster, with its key, after {millis:.0} ms, datagrams up to {largest} bytes"),
        );
        return;
    }
    let whose = roster.owner(line.key());
    let whose = whose.map_or_else(
        || "a key that is not in the roster".into(),
        |owner| format!("the key of {}", owner.name),
    );
    findings.warn(format!("{name}: who answers at {address} proves {whose}"));
}
