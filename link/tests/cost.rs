//! What the way from robot to robot takes, beside the bare engine with the same bytes; by hand:
//! `cargo test --release -p coloc-link --test cost -- --ignored --nocapture`.
#![allow(clippy::unwrap_used)] // A test may panic.

mod support;

use std::sync::Arc;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use coloc_link::engine::{Door, Engine};
use coloc_link::keys::{Identity, PublicKey};
use coloc_link::roster::Role;
use coloc_link::tls::Members;
use coloc_shm_types::{Clock, Message as _, Neighbour, Plain as _, Sender};
use support::{Site, all, free_address, member, name, roster, until, wall_ns};

/// Messages of each, at 50 Hz.
const MESSAGES: usize = 500;
const PERIOD: Duration = Duration::from_millis(20);
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

/// From a stream's beginning on one side to its message on the other, without shared memory and signatures.
fn bare() -> Vec<Duration> {
    let [called, caller] = [free_address(), free_address()];
    let (heard, hears) = mpsc::channel();
    let everybody: Arc<dyn Members> = Arc::new(Everybody);
    let theirs = Arc::clone(&everybody);
    std::thread::spawn(move || {
        local(async move {
            let engine = Engine::open(called, &Identity::insecure(2), &theirs).unwrap();
            let door = Door::default();
            let guest = door.admits(engine.knock().await.unwrap()).unwrap();
            let line = door.hear(guest).await.unwrap();
            while let Some(arriving) = line.stream().await {
                if arriving.whole().await.is_some() && heard.send(Instant::now()).is_err() {
                    return;
                }
            }
        });
    });
    let message = vec![0; Neighbour::BYTES + AROUND];
    local(async move {
        let engine = Engine::open(caller, &Identity::insecure(1), &everybody).unwrap();
        let line = engine.call(called).await.unwrap();
        let mut took = Vec::new();
        while took.len() < MESSAGES {
            let said = Instant::now();
            assert!(line.send_stream(&message, PERIOD * 50).await);
            took.push(hears.recv().unwrap() - said);
            tokio::time::sleep(PERIOD).await;
        }
        took
    })
}

/// From a publication in one space to the reader in the other.
fn whole() -> Vec<Duration> {
    let home = tempfile::tempdir().unwrap();
    let addresses = [free_address(), free_address()];
    let members = (1..).zip(addresses);
    let members = members.map(|(id, address)| member(id, Role::Robot, Some(address)));
    let text = roster(1, members.collect());
    let mut sites = [1, 2].map(|id| Site::new(home.path(), id, addresses[usize::from(id) - 1]));
    for site in &mut sites {
        site.start(&text);
    }
    let port = sites[0].space.publisher::<Neighbour>(&name(2)).unwrap();
    let ear = sites[1].space.subscriber::<Neighbour>(&name(2)).unwrap();
    let mut sender = Sender::start(1, Clock::Realtime).unwrap();
    let mut say = || {
        let header = sender.header(wall_ns());
        port.send(Neighbour {
            header,
            ..Neighbour::default()
        })
        .unwrap();
        header.sequence
    };
    until(
        "they are connected",
        || {
            say();
        },
        || all(&ear).pop(),
    );
    std::thread::sleep(PERIOD * 10);
    let mut took = Vec::new();
    while took.len() < MESSAGES {
        all(&ear);
        let said = Instant::now();
        let sequence = say();
        while ear.wait(PERIOD * 50).unwrap().unwrap().header().sequence != sequence {}
        took.push(said.elapsed());
        std::thread::sleep(PERIOD);
    }
    took
}

#[test]
#[ignore = "measures, and by hand"]
fn the_way_from_robot_to_robot_beside_the_bare_engine() {
    for (what, mut took) in [
        ("bare", bare()),
        ("robot to robot", whole()),
        ("bare", bare()),
    ] {
        took.sort_unstable();
        let at = |part: usize| took[MESSAGES * part / 100];
        println!("{what}: p50 {:?}, p99 {:?}", at(50), at(99));
    }
}
