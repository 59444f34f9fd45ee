//! A team whose robots are ports in spaces of their own, each with a link that runs in a thread.
use std::io::Write;
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use coloc_daemon::config::{self, Clock, ClockSource, Config, Shm};
use coloc_link::keys::Identity;
use coloc_link::post::{self, Office, Papers};
use coloc_link::roster::{self, Book, FORMAT, Moment, Role, Roster};
use coloc_link::section::Link;
use coloc_link::wire::Versions;
use coloc_sensors::Stop;
use coloc_shm_types::{Message, Neighbour, RobotName, Sender, Space, Subscriber};
use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};

/// Longer than anything here takes, on a machine that is busy too.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
pub(crate) const PREFIX: &str = "colocfleet";

pub(crate) fn name(id: u16) -> RobotName {
    RobotName::new(&format!("robot{id}")).unwrap()
}

/// A port of loopback that nobody has at this moment.
pub(crate) fn free_address() -> SocketAddr {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.local_addr().unwrap()
}

pub(crate) fn wall_ns() -> i64 {
    coloc_sensors::Moment::now().realtime_ns
}

/// A member of the team.
pub(crate) fn member(id: u16, role: Role, address: Option<SocketAddr>) -> roster::Member {
    roster::Member {
        name: name(id),
        id,
        role,
        key: Identity::insecure(id).public(),
        next_key: None,
        expires: Moment::of_ns(wall_ns()).later(3600),
        addresses: address.iter().map(ToString::to_string).collect(),
        says: None,
    }
}

/// A roster of these, as the team's key signs it.
pub(crate) fn roster(version: u32, member: Vec<roster::Member>) -> String {
    let team = Identity::insecure(0);
    let roster = Roster {
        format: FORMAT,
        version,
        name: "test".into(),
        team: team.public(),
        issued: Moment::of_ns(wall_ns()),
        datum: "hall".into(),
        periods: std::collections::BTreeMap::new(),
        leaders: Vec::new(),
        member,
    };
    roster.sign(&team).unwrap()
}

/// A robot's space and link.
pub(crate) struct Site {
    pub(crate) id: u16,
    pub(crate) space: Space,
    pub(crate) directory: std::path::PathBuf,
    config: Config,
    pub(crate) listens: SocketAddr,
    /// The network namespace that its link is in; none: that of the test.
    pub(crate) network: Option<PathBuf>,
    /// Whether its link announces itself.
    pub(crate) discover: bool,
    /// Which versions of the wire its link speaks.
    pub(crate) versions: Versions,
    link: Option<(UnixStream, JoinHandle<()>)>,
}

impl Site {
    pub(crate) fn new(home: &Path, id: u16, listens: SocketAddr) -> Self {
        let directory = home.join(format!("site{id}"));
        std::fs::create_dir_all(&directory).unwrap();
        let config = Config {
            shm: Shm {
                root: directory.join("shm"),
                prefix: PREFIX.into(),
                ..Shm::default()
            },
            clock: Clock {
                source: ClockSource::Realtime,
            },
            ..Config::of(config::Robot { name: name(id), id })
        };
        Self {
            id,
            space: Space::open(&config.shm.root, PREFIX, "test").unwrap(),
            directory,
            config,
            listens,
            network: None,
            discover: false,
            versions: Versions::OWN,
            link: None,
        }
    }

    /// Starts the link with a roster that is the newest it knows.
    pub(crate) fn start(&mut self, roster: &str) {
        let (stop, told) = Stop::by_hand().unwrap();
        let (config, directory, text) = (
            self.config.clone(),
            self.directory.clone(),
            roster.to_owned(),
        );
        let (id, listens, versions) = (self.id, self.listens, self.versions);
        let (network, discover) = (self.network.clone(), self.discover);
        let thread = std::thread::spawn(move || {
            if let Some(network) = network {
                let namespace = std::fs::File::open(network).unwrap();
                let kind = Some(LinkNameSpaceType::Network);
                move_into_link_name_space(namespace.as_fd(), kind).unwrap();
            }
            let papers = Papers {
                config,
                section: Link {
                    listen: listens.to_string(),
                    insecure: true,
                    discover,
                    watch_hz: 50.0,
                    max_offset_s: 1.0,
                    ..Link::default()
                },
                directory,
                identity: Identity::insecure(id),
                book: Book::open(text, Identity::insecure(0).public()).unwrap(),
                origin: 0,
                versions,
            };
            post::run(Office::open(papers).unwrap(), &stop).unwrap();
        });
        self.link = Some((told, thread));
    }

    pub(crate) fn stop(&mut self) {
        if let Some((mut told, thread)) = self.link.take() {
            told.write_all(b"!").unwrap();
            thread.join().unwrap();
        }
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.stop();
        }
    }
}

#[allow(dead_code)] // Not every test waits.
/// Does `act` again and again until `seen` has seen something.
pub(crate) fn until<T>(
    what: &str,
    mut act: impl FnMut(),
    mut seen: impl FnMut() -> Option<T>,
) -> T {
    let begin = Instant::now();
    loop {
        act();
        if let Some(it) = seen() {
            return it;
        }
        assert!(begin.elapsed() < PATIENCE, "never: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[allow(dead_code)] // Not every test needs it.
/// Waits until a robot hears what another says to it.
pub(crate) fn helped(from: &Site, to: &Site) {
    let port = from.space.publisher::<Neighbour>(&name(to.id)).unwrap();
    let mut sender = Sender::start(from.id, coloc_shm_types::Clock::Realtime).unwrap();
    let ear = to.space.subscriber::<Neighbour>(&name(to.id)).unwrap();
    until(
        "the other robot hears it",
        || {
            let header = sender.header(wall_ns());
            let message = Neighbour {
                header,
                pose: [1.0, 2.0, 0.5],
                independent: [0.1, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1],
                ..Neighbour::default()
            };
            port.send(message).unwrap();
        },
        || all(&ear).pop(),
    );
}

#[allow(dead_code)] // The same.
/// Everything that is there.
pub(crate) fn all<M: Message>(port: &Subscriber<M>) -> Vec<M> {
    std::iter::from_fn(|| port.receive().unwrap()).collect()
}
