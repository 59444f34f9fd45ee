//! Computers in a box: network namespaces with a TUN device in each, and between them the same bad network as [`weather`](crate::weather) makes for
//! UDP, but of whole IP packets. For the demo; a robot never meets it.
//!
//! The kernel removes a namespace with the last process in it, and the device with its descriptor: nothing is left behind, however it ends.
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::net::IpAddr;
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::process::{Command, Stdio};
use std::rc::Rc;
use std::sync::Arc;

use rustix::fs::OFlags;
use rustix::ioctl::{Opcode, Setter, ioctl, opcode};
use rustix::thread::UnshareFlags;
use tokio::io::unix::AsyncFd;
use tokio::sync::Semaphore;
use tokio::task::spawn_local;

use crate::weather::{Air, LARGEST, LATE, Weather};

/// In every namespace: each has one of its own.
const DEVICE: &[u8] = b"tun0";
/// As Ethernet has it (bytes).
const MTU: u16 = 1500;
const TUNSETIFF: Opcode = opcode::write::<i32>(b'T', 202);
/// Bare IP packets (`IFF_TUN | IFF_NO_PI`).
const BARE_IP: i16 = 0x1001;
/// In both versions of IP.
const UDP: u8 = 17;

/// A namespace, as a robot's computer.
#[derive(Debug)]
pub struct Network {
    namespace: File,
    tunnel: File,
    addresses: Vec<IpAddr>,
}

/// `struct ifreq`.
#[repr(C)]
struct Request {
    name: [u8; 16],
    flags: i16,
    rest: [u8; 22],
}

impl Network {
    /// Makes one with these addresses, whose neighbours are in the same /24, and /64.
    ///
    /// # Errors
    /// If this user may not, or there is no `/dev/net/tun` or no `ip` (of iproute2).
    pub fn make(addresses: &[IpAddr]) -> io::Result<Self> {
        // A thread that ends at once: who calls stays where it is.
        let made = std::thread::scope(|scope| scope.spawn(|| Self::make_here(addresses)).join());
        made.unwrap_or_else(|_| Err(io::Error::other("the thread panicked")))
    }

    fn make_here(addresses: &[IpAddr]) -> io::Result<Self> {
        enter_new().map_err(|error| named("no network namespace can be made", &error.into()))?;
        let tunnel = tunnel().map_err(|error| named("no TUN device can be made", &error))?;
        set_up(addresses).map_err(|error| named("`ip` does not set the device up", &error))?;
        Ok(Self {
            namespace: File::open("/proc/thread-self/ns/net")?,
            tunnel,
            addresses: addresses.to_vec(),
        })
    }

    /// Where others find the namespace, for `nsenter --net=`, as long as this process runs.
    #[must_use]
    pub fn place(&self) -> String {
        let (own, descriptor) = (std::process::id(), self.namespace.as_raw_fd());
        format!("/proc/{own}/fd/{descriptor}")
    }
}

fn named(what: &str, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{what}: {error}"))
}

#[expect(
    unsafe_code,
    reason = "not offered safely, because of flags that are not used here"
)]
fn enter_new() -> rustix::io::Result<()> {
    // SAFETY: only UnshareFlags::FILES breaks what other code may rely on (its file descriptors).
    unsafe { rustix::thread::unshare_unsafe(UnshareFlags::NEWNET) }
}

#[expect(unsafe_code, reason = "the kernel offers TUN devices by ioctl")]
fn tunnel() -> io::Result<File> {
    let tunnel = OpenOptions::new()
        .read(true)
        .write(true)
        .custom_flags(i32::try_from(OFlags::NONBLOCK.bits()).unwrap_or_default())
        .open("/dev/net/tun")?;
    let mut request = Request {
        name: [0; 16],
        flags: BARE_IP,
        rest: [0; 22],
    };
    let places = request.name.iter_mut().zip(DEVICE);
    places.for_each(|(place, letter)| *place = *letter);
    // SAFETY: TUNSETIFF reads a `struct ifreq`, which Request is: 40 bytes, the name first and the flags behind it.
    unsafe { ioctl(&tunnel, Setter::<TUNSETIFF, Request>::new(request)) }?;
    Ok(tunnel)
}

fn set_up(addresses: &[IpAddr]) -> io::Result<()> {
    let device = String::from_utf8_lossy(DEVICE);
    let addressed = addresses.iter().map(|address| match address {
        IpAddr::V4(_) => format!("address add {address}/24 dev {device}\n"),
        IpAddr::V6(_) => format!("address add {address}/64 dev {device} nodad\n"),
    });
    let up = [
        "link set lo up\n".into(),
        format!("link set {device} mtu {MTU} up\n"),
    ];
    let lines: String = addressed.chain(up).collect();
    let mut ip = Command::new("ip")
        .args(["-batch", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    let written = ip
        .stdin
        .take()
        .map_or(Ok(()), |mut it| it.write_all(lines.as_bytes()));
    let ended = ip.wait_with_output()?;
    if ended.status.success() {
        return written;
    }
    let said = String::from_utf8_lossy(&ended.stderr);
    Err(io::Error::other(said.trim().replace('\n', "; ")))
}

/// The network between all of them.
#[derive(Debug)]
pub struct Between {
    ends: Vec<End>,
    /// As many as there are ends. What two say to one another goes through the later one's, as if the earlier one called it behind a
    /// [`Cloud`](crate::weather::Cloud) of the same seed.
    airs: Vec<Air>,
    late: Arc<Semaphore>,
}

#[derive(Debug)]
struct End {
    /// Others enter it by this.
    _namespace: File,
    tunnel: AsyncFd<File>,
    addresses: Vec<IpAddr>,
}

impl Between {
    /// Begins to carry packets, in tasks of this thread; the seed of each network is one more than that of the one before.
    ///
    /// # Errors
    /// What the system says.
    pub fn open(networks: Vec<Network>, weather: Weather, seed: u64) -> io::Result<Rc<Self>> {
        let seeds = (seed..).take(networks.len());
        let airs = seeds.map(|seed| Air::new(weather, seed)).collect();
        let end = |network: Network| {
            Ok(End {
                _namespace: network.namespace,
                tunnel: watched(network.tunnel)?,
                addresses: network.addresses,
            })
        };
        let between = Rc::new(Self {
            ends: networks.into_iter().map(end).collect::<io::Result<_>>()?,
            airs,
            late: Arc::new(Semaphore::new(LATE)),
        });
        for from in 0..between.ends.len() {
            spawn_local(Rc::clone(&between).carry(from));
        }
        Ok(between)
    }

    /// Changes the weather.
    pub fn set(&self, weather: Weather) {
        self.airs.iter().for_each(|air| air.set(weather));
    }

    async fn carry(self: Rc<Self>, from: usize) {
        let mut packet = vec![0; LARGEST];
        while let Some(end) = self.ends.get(from)
            && let Ok(length) = next(&end.tunnel, &mut packet).await
        {
            let packet = packet.get(..length).unwrap_or_default();
            let receivers = (0..self.ends.len()).filter(|to| *to != from);
            for to in receivers.filter(|to| self.is_for(*to, packet)) {
                let Some(air) = self.airs.get(from.max(to)) else {
                    continue;
                };
                let own = Rc::clone(&self);
                air.pass(&self.late, packet, async move |packet| own.put(to, &packet));
            }
        }
    }

    fn is_for(&self, to: usize, packet: &[u8]) -> bool {
        let end = self.ends.get(to);
        match destination(packet) {
            // What kernels tell one another of groups and routers is none of the robots' words.
            Some((address, protocol)) if address.is_multicast() => protocol == UDP,
            Some((address, _)) => end.is_some_and(|end| end.addresses.contains(&address)),
            None => false,
        }
    }

    /// What a device does not take is lost, as on every network.
    fn put(&self, to: usize, packet: &[u8]) {
        let tunnel = self.ends.get(to).map(|end| end.tunnel.get_ref());
        let _ = tunnel.map(|mut tunnel| tunnel.write(packet));
    }
}

#[expect(
    unsafe_code,
    reason = "not offered safely, because of descriptors that are exchanged"
)]
fn watched(tunnel: File) -> io::Result<AsyncFd<File>> {
    // SAFETY: a File has the same descriptor as long as it lives, and closes it after AsyncFd has let it go.
    Ok(unsafe { AsyncFd::register(tunnel) }?)
}

async fn next(tunnel: &AsyncFd<File>, packet: &mut [u8]) -> io::Result<usize> {
    loop {
        let mut ready = tunnel.readable().await?;
        if let Ok(read) = ready.try_io(|tunnel| tunnel.get_ref().read(packet)) {
            return read;
        }
    }
}

/// To whom an IP packet goes, and of which protocol it is.
fn destination(packet: &[u8]) -> Option<(IpAddr, u8)> {
    let version = packet.first()? >> 4;
    match version {
        4 => {
            let address: [u8; 4] = packet.get(16..20)?.try_into().ok()?;
            Some((address.into(), *packet.get(9)?))
        }
        6 => {
            let address: [u8; 16] = packet.get(24..40)?.try_into().ok()?;
            Some((address.into(), *packet.get(6)?))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packet_says_to_whom_it_goes() {
        let mut four = vec![0x45; 20];
        four[9] = UDP;
        four[16..].copy_from_slice(&[10, 1, 2, 3]);
        assert_eq!(destination(&four), Some((IpAddr::from([10, 1, 2, 3]), UDP)));
        let mut six = vec![0x60; 40];
        six[6] = 58;
        six[24..].copy_from_slice(&[0; 16]);
        six[39] = 1;
        assert_eq!(destination(&six), Some(("::1".parse().unwrap(), 58)));
        for nonsense in [&four[..19], &six[..39], &[0x50; 60], &[]] {
            assert_eq!(destination(nonsense), None);
        }
    }
}
