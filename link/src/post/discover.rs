//! Announcing the link, and hearing others announce themselves, by multicast DNS; where that is not wanted nothing of it runs.
use std::cell::RefCell;
use std::net::{IpAddr, SocketAddr, SocketAddrV6};
use std::rc::Rc;
use std::time::{Duration, Instant};

use mdns_sd::{
    Error, IfKind, Receiver, ResolvedService, ScopedIp, ServiceDaemon, ServiceEvent, ServiceInfo,
};

use super::office::Office;
use crate::discovery::{Announced, SERVICE};

/// From one look at what is remembered to the next.
const LOOK: Duration = Duration::from_secs(1);
/// From one attempt to the next.
const AGAIN: Duration = Duration::from_secs(5);
/// More records than of any team on one network: somebody floods, and it begins anew with none.
const MOST: i64 = 8192;

/// Multicast DNS, with a thread of its own, which ends with this.
struct Voice {
    daemon: ServiceDaemon,
    heard: Receiver<ServiceEvent>,
}

/// Announces that the link listens on `address`, and hears others, until the end.
pub(super) async fn discover(office: Rc<RefCell<Office>>, address: SocketAddr) {
    loop {
        let voice = Voice::open(&office.borrow(), address);
        let why = match voice {
            Ok(voice) => voice.hear(&office, address).await,
            Err(error) => error.to_string(),
        };
        let text = format!("multicast DNS begins anew: {why}");
        office.borrow_mut().teller.remark(text);
        tokio::time::sleep(AGAIN).await;
    }
}

impl Voice {
    fn open(office: &Office, address: SocketAddr) -> Result<Self, Error> {
        let daemon = ServiceDaemon::new()?;
        let voice = Self {
            heard: daemon.browse(SERVICE)?,
            daemon,
        };
        voice.keep_to(address.ip())?;
        let (own, team) = (office.own, office.book.team().team());
        let name = format!("{own}-{team:016x}");
        let host = format!("coloc-{name}.local.");
        let properties = [("team", format!("{team:016x}")), ("id", own.to_string())];
        let port = address.port();
        let mut info = if address.ip().is_unspecified() {
            ServiceInfo::new(SERVICE, &name, &host, (), port, &properties[..])?.enable_addr_auto()
        } else {
            ServiceInfo::new(SERVICE, &name, &host, address.ip(), port, &properties[..])?
        };
        // Nobody else has the team's key and this number.
        info.set_requires_probe(false);
        voice.daemon.register(info)?;
        Ok(voice)
    }

    /// Nothing is said where the link does not listen.
    fn keep_to(&self, address: IpAddr) -> Result<(), Error> {
        if address.is_unspecified() {
            self.daemon
                .disable_interface(vec![IfKind::LoopbackV4, IfKind::LoopbackV6])?;
            if address.is_ipv4() {
                self.daemon.disable_interface(IfKind::IPv6)?;
            }
            return Ok(());
        }
        self.daemon.disable_interface(IfKind::All)?;
        self.daemon.enable_interface(IfKind::Addr(address))
    }

    /// Hears until it cannot go on; why it cannot.
    async fn hear(&self, office: &RefCell<Office>, own: SocketAddr) -> String {
        let mut looked = Instant::now();
        loop {
            match tokio::time::timeout(LOOK, self.heard.recv_async()).await {
                Ok(Ok(ServiceEvent::ServiceResolved(service))) => {
                    if let Some(announced) = announced(&service, own) {
                        office.borrow_mut().found(&announced);
                    }
                }
                Ok(Ok(_)) | Err(_) => {}
                Ok(Err(_)) => return "its thread has ended".into(),
            }
            if looked.elapsed() >= LOOK {
                looked = Instant::now();
                if !self.is_well().await {
                    return "more is announced than can be remembered".into();
                }
            }
        }
    }

    async fn is_well(&self) -> bool {
        let Ok(asked) = self.daemon.get_metrics() else {
            return false;
        };
        let told = tokio::time::timeout(LOOK, asked.recv_async()).await;
        let Ok(Ok(metrics)) = told else {
            return false;
        };
        let cached = metrics
            .iter()
            .filter(|(name, _)| name.starts_with("cached"));
        cached.map(|(_, count)| count).sum::<i64>() <= MOST
    }
}

impl Drop for Voice {
    fn drop(&mut self) {
        // It says good-bye first. That it has ended already is as well.
        let _ = self.daemon.shutdown();
    }
}

/// What a link announces, as far as it can be called from a socket like the own one.
fn announced(service: &ResolvedService, own: SocketAddr) -> Option<Announced> {
    let said = |key| service.txt_properties.get_property_val_str(key);
    let port = service.get_port();
    let addresses = service.get_addresses().iter();
    let addresses = addresses.filter(|it| own.is_ipv6() || it.is_ipv4());
    Some(Announced {
        team: u64::from_str_radix(said("team")?, 16).ok()?,
        id: said("id")?.parse().ok()?,
        addresses: addresses.map(|it| with_scope(it, port)).collect(),
    })
}

fn with_scope(address: &ScopedIp, port: u16) -> SocketAddr {
    match address {
        ScopedIp::V6(six) if six.addr().is_unicast_link_local() => {
            SocketAddrV6::new(*six.addr(), port, 0, six.scope_id().index).into()
        }
        other => SocketAddr::new(other.to_ip_addr(), port),
    }
}
