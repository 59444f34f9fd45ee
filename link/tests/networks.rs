//! Links that are not where they were, or were never said to be: other networks, IPv6, new addresses, multicast DNS.
#![allow(clippy::unwrap_used)] // A test may panic.

mod support;

use std::net::{IpAddr, Ipv6Addr, SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::thread::JoinHandle;

use coloc_link::networks::{Between, Network};
use coloc_link::roster::Role;
use coloc_link::weather::Weather;
use support::{Site, free_address, helped, member, roster};
use tokio::sync::oneshot;
use tokio::task::LocalSet;

const PORT: u16 = 7373;

/// Namespaces, and a network between them until it is dropped.
struct Networks {
    places: Vec<PathBuf>,
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Networks {
    /// `None`, and a word about it, if this user may not.
    fn make(addresses: &[[IpAddr; 2]], weather: Weather) -> Option<Self> {
        let made = addresses.iter().map(|it| Network::make(it));
        let made = match made.collect::<Result<Vec<_>, _>>() {
            Ok(made) => made,
            Err(error) => {
                println!("SKIPPED: network namespaces: {error}");
                return None;
            }
        };
        let places = made.iter().map(|it| it.place().into()).collect();
        let (end, ended) = oneshot::channel::<()>();
        let thread = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread();
            let runtime = { runtime }.enable_all().build().unwrap();
            LocalSet::new().block_on(&runtime, async {
                let _between: Rc<Between> = Between::open(made, weather, 1).unwrap();
                let _ = ended.await;
            });
        });
        Some(Self {
            places,
            end: Some(end),
            thread: Some(thread),
        })
    }
}

impl Drop for Networks {
    fn drop(&mut self) {
        drop(self.end.take());
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Robots 1 and 2 that listen there, not yet started.
fn two(home: &Path, listens: [SocketAddr; 2]) -> [Site; 2] {
    let [one, two] = listens;
    [Site::new(home, 1, one), Site::new(home, 2, two)]
}

fn team(version: u32, addresses: [Option<SocketAddr>; 2]) -> String {
    let [one, two] = addresses;
    let members = [(1, one), (2, two)];
    roster(
        version,
        members
            .map(|(id, address)| member(id, Role::Robot, address))
            .into(),
    )
}

fn both_help(sites: &[Site; 2]) {
    let [one, two] = sites;
    helped(one, two);
    helped(two, one);
}

fn six_is_here() -> bool {
    let is_here = UdpSocket::bind((Ipv6Addr::LOCALHOST, 0)).is_ok();
    if !is_here {
        println!("SKIPPED: IPv6: this computer has none");
    }
    is_here
}

#[test]
fn computers_with_networks_of_their_own_help_one_another_though_a_third_is_lost() {
    let addresses = [1, 2].map(|number: u8| {
        let six = [0xfd73, 0, 0, 0, 0, 0, 0, u16::from(number)];
        [IpAddr::from([10, 73, 73, number]), six.into()]
    });
    let weather = Weather {
        loss: 0.3,
        delay_s: [0.0, 0.02],
        doubled: 0.1,
        cut: false,
    };
    for version in 0..2 {
        let Some(networks) = Networks::make(&addresses, weather) else {
            return;
        };
        let home = tempfile::tempdir().unwrap();
        let listens = addresses.map(|it| SocketAddr::new(it[version], PORT));
        let mut sites = two(home.path(), listens);
        for (site, place) in sites.iter_mut().zip(&networks.places) {
            site.network = Some(place.clone());
            site.start(&team(1, listens.map(Some)));
        }
        both_help(&sites);
    }
}

#[test]
fn links_reach_one_another_by_the_newer_internet_protocol() {
    if !six_is_here() {
        return;
    }
    let home = tempfile::tempdir().unwrap();
    let listens = [(); 2].map(|()| {
        let socket = UdpSocket::bind((Ipv6Addr::LOCALHOST, 0)).unwrap();
        socket.local_addr().unwrap()
    });
    let mut sites = two(home.path(), listens);
    for site in &mut sites {
        site.start(&team(1, listens.map(Some)));
    }
    both_help(&sites);
}

#[test]
fn a_member_whose_address_is_another_one_in_a_newer_roster_is_helped_again() {
    let home = tempfile::tempdir().unwrap();
    let [first, before, after] = [(); 3].map(|()| free_address());
    let mut sites = two(home.path(), [first, before]);
    for site in &mut sites {
        site.start(&team(1, [None, Some(before)]));
    }
    both_help(&sites);
    let newer = team(2, [None, Some(after)]);
    let [one, two] = &mut sites;
    two.stop();
    two.listens = after;
    two.start(&newer);
    std::fs::write(one.directory.join("fleet.toml"), &newer).unwrap();
    both_help(&sites);
}

/// Whether a packet to the group of multicast DNS comes back on loopback.
fn multicast_is_heard() -> bool {
    let heard = || {
        let socket = UdpSocket::bind("0.0.0.0:0")?;
        let (group, own) = ([224, 0, 0, 251].into(), [127, 0, 0, 1].into());
        socket.join_multicast_v4(&group, &own)?;
        socket.set_read_timeout(Some(std::time::Duration::from_secs(1)))?;
        let sends = UdpSocket::bind("127.0.0.1:0")?;
        sends.send_to(b"?", (group, socket.local_addr()?.port()))?;
        socket.recv(&mut [0])
    };
    let heard = heard();
    if let Err(error) = &heard {
        println!("SKIPPED: multicast DNS: {error}");
    }
    heard.is_ok()
}

#[test]
fn members_without_an_address_find_one_another_and_one_that_moves_is_found_again() {
    if !multicast_is_heard() {
        return;
    }
    let home = tempfile::tempdir().unwrap();
    let [first, before, after] = [(); 3].map(|()| free_address());
    let mut sites = two(home.path(), [first, before]);
    let nowhere = team(1, [None, None]);
    for site in &mut sites {
        site.discover = true;
        site.start(&nowhere);
    }
    both_help(&sites);
    let [_, two] = &mut sites;
    two.stop();
    two.listens = after;
    two.start(&nowhere);
    both_help(&sites);
}
