//! What the way from robot to robot takes, beside the bare engine with the same bytes; by hand:
//! `cargo test --release -p coloc-link --test cost -- --ignored --nocapture`.
#![allow(clippy::unwrap_used)] // A test may panic.

mod support;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use coloc_link::engine::{Door, Engine};
use coloc_link::keys::{Identity, PublicKey};
use coloc_link::roster::Role;
use coloc_link::tls::Members;
use coloc_link::wire::{self, Envelope, Parsed, seal};
use coloc_shm_types::{Clock, Neighbour, Plain as _, Publisher, Sender, Subscriber};
use support::{PATIENCE, Site, all, free_address, member, name, roster, wall_ns};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

/// Messages of each, taken in turn, at 10 Hz.
const MESSAGES: usize = 300;
const PERIOD: Duration = Duration::from_millis(100);
/// What a signed message has around its payload (bytes).
const AROUND: usize = 116;

#[derive(Debug)]
struct Everybody;

impl Members for Everybody {
    fn admits(&self, _: &PublicKey) -> bool {
        true
    }
}

fn local<T>(work: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = { runtime }.enable_all().build().unwrap();
    tokio::task::LocalSet::new().block_on(&runtime, work)
}

/// The engine alone, with the same keys and as many bytes: a thread that puts, a thread for each side, a thread that is told.
struct Bare {
    put: UnboundedSender<()>,
    /// When a message was handed to the engine.
    handed: mpsc::Receiver<Instant>,
    /// When it was there.
    heard: mpsc::Receiver<Instant>,
}

impl Bare {
    fn new() -> Self {
        let [called, caller] = [free_address(), free_address()];
        let (hears, heard) = mpsc::channel();
        let (hands, handed) = mpsc::channel();
        let (put, puts) = unbounded_channel();
        let everybody: Arc<dyn Members> = Arc::new(Everybody);
        let theirs = Arc::clone(&everybody);
        std::thread::spawn(move || local(listen(called, theirs, hears)));
        std::thread::spawn(move || local(say(caller, called, everybody, puts, hands)));
        Self { put, handed, heard }
    }

    /// From the engine's thread to the other engine's, and from who puts to who is told.
    fn way(&self) -> [Duration; 2] {
        let said = Instant::now();
        self.put.send(()).unwrap();
        let heard = self.heard.recv().unwrap();
        let told = said.elapsed();
        [heard - self.handed.recv().unwrap(), told]
    }
}

async fn listen(called: SocketAddr, members: Arc<dyn Members>, heard: mpsc::Sender<Instant>) {
    let engine = Engine::open(called, &Identity::insecure(2), &members).unwrap();
    let door = Door::default();
    let guest = door.admits(engine.knock().await.unwrap()).unwrap();
    let line = door.hear(guest).await.unwrap();
    while let Some(arriving) = line.stream().await {
        if arriving.whole().await.is_some() && heard.send(Instant::now()).is_err() {
            return;
        }
    }
}

async fn say(
    own: SocketAddr,
    called: SocketAddr,
    members: Arc<dyn Members>,
    mut puts: UnboundedReceiver<()>,
    handed: mpsc::Sender<Instant>,
) {
    let engine = Engine::open(own, &Identity::insecure(1), &members).unwrap();
    let line = engine.call(called).await.unwrap();
    let message = vec![0; Neighbour::BYTES + AROUND];
    while puts.recv().await.is_some() {
        if handed.send(Instant::now()).is_err() {
            return;
        }
        assert!(line.send_stream(&message, PERIOD * 50).await);
    }
}

/// Two robots: a publication in one space, a reader in the other.
struct Whole {
    port: Publisher<Neighbour>,
    ear: Subscriber<Neighbour>,
    sender: Sender,
    _sites: [Site; 2],
}

impl Whole {
    fn new(home: &Path) -> Self {
        let addresses = [free_address(), free_address()];
        let members = (1..).zip(addresses);
        let members = members.map(|(id, address)| member(id, Role::Robot, Some(address)));
        let text = roster(1, members.collect());
        let mut sites = [1, 2].map(|id| Site::new(home, id, addresses[usize::from(id) - 1]));
        for site in &mut sites {
            site.start(&text);
        }
        let mut whole = Self {
            port: sites[0].space.publisher(&name(2)).unwrap(),
            ear: sites[1].space.subscriber(&name(2)).unwrap(),
            sender: Sender::start(1, Clock::Realtime).unwrap(),
            _sites: sites,
        };
        let begin = Instant::now();
        while all(&whole.ear).is_empty() {
            whole.say();
            assert!(begin.elapsed() < PATIENCE, "never connected");
            std::thread::sleep(PERIOD);
        }
        whole
    }

    fn say(&mut self) -> u64 {
        let header = self.sender.header(wall_ns());
        let told = Neighbour {
            header,
            ..Neighbour::default()
        };
        self.port.send(told).unwrap();
        header.sequence
    }

    fn way(&mut self) -> Duration {
        all(&self.ear);
        let said = Instant::now();
        let sequence = self.say();
        while let Some(told) = self.ear.wait(PERIOD * 50).unwrap() {
            if told.header.sequence == sequence {
                break;
            }
        }
        said.elapsed()
    }
}

/// Signing such a message, and checking its signature.
fn signatures() -> [Vec<Duration>; 2] {
    let key = Identity::insecure(1);
    let verifier = key.public().verifier().unwrap();
    let envelope = Envelope {
        version: wire::NEWEST,
        team: 1,
        session: 2,
        sequence: 3,
        stamp_ns: 4,
        kind: 5,
        roster: 6,
        speaker: 1,
        receiver: 2,
    };
    let (body, mut bytes) = (vec![0; Neighbour::BYTES], Vec::new());
    let mut took = [Vec::new(), Vec::new()];
    for _ in 0..MESSAGES {
        let begin = Instant::now();
        assert!(seal(&envelope, &body, key.signing(), &mut bytes));
        took[0].push(begin.elapsed());
        let begin = Instant::now();
        assert!(Parsed::of(&bytes).unwrap().is_signed_by(&verifier));
        took[1].push(begin.elapsed());
    }
    took
}

fn tell(what: &str, took: &mut [Duration]) -> [f64; 2] {
    took.sort_unstable();
    let at = |part: usize| took[took.len() * part / 100];
    println!("{what:40} p50 {:?}, p99 {:?}", at(50), at(99));
    [50, 99].map(|part| at(part).as_secs_f64())
}

#[test]
#[ignore = "measures, and by hand"]
fn the_way_from_robot_to_robot_beside_the_bare_engine() {
    let home = tempfile::tempdir().unwrap();
    let (bare, mut whole) = (Bare::new(), Whole::new(home.path()));
    let mut took: [Vec<Duration>; 3] = Default::default();
    // One after the other, so that whatever else the computer does happens to all of them.
    for _ in 0..MESSAGES {
        let [engine, put] = bare.way();
        let way = whole.way();
        for (all, one) in took.iter_mut().zip([engine, put, way]) {
            all.push(one);
        }
        std::thread::sleep(PERIOD);
    }
    let [signed, checked] = &mut signatures();
    tell("a signature", signed);
    tell("checking it", checked);
    let [engine, put, way] = &mut took;
    let engine = tell("bare, from engine to engine", engine);
    let put = tell("bare, from who puts to who is told", put);
    let way = tell("from a publication to the other's reader", way);
    for (what, bare) in [("engine to engine", engine), ("put to told", put)] {
        println!(
            "of {what}: p50 {:.2} times, p99 {:.2} times",
            way[0] / bare[0],
            way[1] / bare[1]
        );
    }
}
