//! Who attacks, in a process of its own, and what the others notice of it.
use std::net::SocketAddr;
use std::process::{Command, ExitCode};
use std::sync::Arc;
use std::time::{Duration, Instant};

use coloc_link::engine::{Engine, Line};
use coloc_link::keys::{Identity, PublicKey};
use coloc_link::roster::Role;
use coloc_link::tls::Members;
use coloc_shm_types::Timing;

use crate::Extent;
use crate::process::Process;
use crate::support::{member, roster};
use crate::talk::Talk;
use crate::team::{Robot, members, team};
use crate::trouble::worst;

const FLOODER: u16 = 3;
const NOBODY: u16 = 77;

#[derive(Debug)]
struct Anybody;

impl Members for Anybody {
    fn admits(&self, _: &PublicKey) -> bool {
        true
    }
}

/// `attack knock|flood ADDRESS SECONDS`.
pub(crate) fn attack(arguments: &[String]) -> ExitCode {
    let [_, how, address, seconds] = arguments else {
        return ExitCode::FAILURE;
    };
    let (address, seconds): (SocketAddr, f64) =
        (address.parse().unwrap(), seconds.parse().unwrap());
    let until = Instant::now() + Duration::from_secs_f64(seconds);
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    let work = async {
        match how.as_str() {
            "knock" => knock(address, until).await,
            _ => flood(address, until).await,
        }
    };
    tokio::task::LocalSet::new().block_on(&runtime.unwrap(), work);
    ExitCode::SUCCESS
}

fn engine(id: u16) -> Engine {
    let own = SocketAddr::from(([127, 0, 0, 1], 0));
    let anybody: Arc<dyn Members> = Arc::new(Anybody);
    Engine::open(own, &Identity::insecure(id), &anybody).unwrap()
}

/// A hundred times a second, and never waits for an answer.
async fn knock(address: SocketAddr, until: Instant) {
    let engine = engine(NOBODY);
    let mut knocks = 0_u32;
    let begin = Instant::now();
    while Instant::now() < until {
        let engine = engine.clone();
        tokio::task::spawn_local(async move {
            // It is sent away.
            let _ = engine.call(address).await;
        });
        knocks += 1;
        tokio::time::sleep_until((begin + Duration::from_millis(10) * knocks).into()).await;
    }
}

/// With a member's key: datagrams and streams of nonsense, as fast as they can be sent.
async fn flood(address: SocketAddr, until: Instant) {
    let line = engine(FLOODER).call(address).await.unwrap();
    let streams = tokio::task::spawn_local(stream_on(line.clone()));
    let nonsense = [0x5a; 1100];
    let mut sent = 0_u64;
    while Instant::now() < until {
        for _ in 0..32 {
            sent += u64::from(line.send_datagram(&nonsense));
        }
        // The engine's own task has to run; it drops what is too much.
        tokio::task::yield_now().await;
    }
    streams.abort();
    let vitals = line.vitals();
    println!(
        "flood: the attacker offered {:.0} MB in datagrams and sent {:.0} MB of packets",
        megabytes(sent * nonsense.len() as u64),
        megabytes(vitals.sent_bytes)
    );
}

#[expect(clippy::cast_precision_loss, reason = "a count, for people")]
fn megabytes(bytes: u64) -> f64 {
    1e-6 * bytes as f64
}

async fn stream_on(line: Line) {
    let large = vec![0x5a; 60_000];
    loop {
        let _ = line.send_stream(&large, Duration::from_secs(1)).await;
    }
}

/// Two robots that talk, the first with a daemon, and a member that is not there.
fn scene(home: &std::path::Path) -> (Vec<Robot>, Talk) {
    let mut robots = team(home, 2);
    let mut listed = members(&robots);
    listed.push(member(FLOODER, Role::Robot, None));
    let text = roster(1, listed);
    for robot in &mut robots {
        robot.goes_by(&text);
        robot.start_link();
    }
    robots[0].start_daemon();
    let mut talk = Talk::new(&robots, |_, _| true, 10.0);
    talk.until_all_are_heard();
    (robots, talk)
}

fn attacker(how: &str, address: SocketAddr, seconds: f64) -> Process {
    let mut command = Command::new(std::env::current_exe().unwrap());
    let seconds = seconds.to_string();
    Process::start(command.args(["attack", how, &address.to_string(), &seconds]))
}

/// Ticks of the first robot's daemon: what each took (ns), and the processor time of the whole daemon by tick (s).
#[derive(Default)]
struct Ticks {
    took_ns: Vec<u64>,
    busy_s: f64,
}

impl Ticks {
    fn add(&mut self, more: &Self) {
        self.took_ns.extend(&more.took_ns);
        self.busy_s += more.busy_s;
    }

    fn at(&mut self, part: usize) -> f64 {
        self.took_ns.sort_unstable();
        let place = self.took_ns.len() * part / 100;
        f64::from(u32::try_from(self.took_ns[place]).unwrap_or(u32::MAX)) * 1e-3
    }

    fn busy_us(&self) -> f64 {
        1e6 * self.busy_s / f64::from(u32::try_from(self.took_ns.len()).unwrap_or(u32::MAX))
    }
}

fn follow(robots: &[Robot], talk: &mut Talk, seconds: f64, ticks: &mut Ticks) {
    let timings = robots[0]
        .space
        .subscriber::<Timing>(&robots[0].name())
        .unwrap();
    let daemon = robots[0].daemon.as_ref().unwrap();
    let (before, begin) = (daemon.usage().busy_s, Instant::now());
    while begin.elapsed().as_secs_f64() < seconds {
        talk.turn();
        while let Ok(Some(it)) = timings.receive() {
            let parts = [it.collect_ns, it.estimate_ns, it.publish_ns, it.account_ns];
            ticks.took_ns.push(parts.into_iter().map(u64::from).sum());
        }
    }
    ticks.busy_s += daemon.usage().busy_s - before;
}

/// In turn without and with the attack: what the daemon's ticks take, what is heard, what the link and the attacker take.
fn pairs(how: &str, extent: Extent, robots: &[Robot], talk: &mut Talk) {
    let seconds = extent.of(2.0, 8.0);
    let [mut calm, mut attacked] = [Ticks::default(), Ticks::default()];
    let mut ratios = Vec::new();
    let link = || robots[0].link.as_ref().unwrap().usage();
    let (mut heard, mut twice, mut said, mut gap_s) = (0, 0, 0, 0.0_f64);
    let (mut busy_s, mut link_busy_s, mut most) = (0.0, 0.0, link());
    let begin = link();
    for _ in 0..extent.of(1, 6) {
        let [mut before_it, mut with_it] = [Ticks::default(), Ticks::default()];
        follow(robots, talk, seconds, &mut before_it);
        let mut attacker = attacker(how, robots[0].listens, seconds + 0.8);
        talk.go_on(0.3);
        talk.forget();
        let (before, link_before) = (attacker.usage().busy_s, link().busy_s);
        follow(robots, talk, seconds - 0.5, &mut with_it);
        (busy_s, link_busy_s) = (
            busy_s + attacker.usage().busy_s - before,
            link_busy_s + link().busy_s - link_before,
        );
        gap_s = gap_s.max(talk.longest_gap_s(None));
        talk.wait(0.5);
        (heard, twice, said) = (heard + talk.count(), twice + talk.twice(), said + talk.said);
        let now = link();
        most.own_mib = most.own_mib.max(now.own_mib);
        most.descriptors = most.descriptors.max(now.descriptors);
        ratios.push(with_it.at(99) / before_it.at(99));
        calm.add(&before_it);
        attacked.add(&with_it);
        attacker.wait();
        talk.go_on(0.5);
    }
    let length_s = f64::from(extent.of(1, 6)) * (seconds - 0.5);
    println!(
        "{how}: {heard} of {said} were heard meanwhile, {twice} of them twice, the longest gap {gap_s:.2} s; the attacker took {:.0} % of a core, the link {:.0} %; \
         the link's own memory {:.1} MiB before, {:.1} at most, {} descriptors before, {} at most",
        100.0 * busy_s / length_s,
        100.0 * link_busy_s / length_s,
        begin.own_mib,
        most.own_mib,
        begin.descriptors,
        most.descriptors
    );
    ratios.sort_by(f64::total_cmp);
    println!(
        "{how}: p99 of the daemon's ticks with it of that without, piece by piece: {ratios:.2?}"
    );
    println!(
        "{how}: the daemon's ticks: p50 {:.1} µs without and {:.1} with it, p99 {:.1} and {:.1} ({:.3} times); processor time a tick {:.1} and {:.1} µs ({:.3} times), {} and {} ticks",
        calm.at(50),
        attacked.at(50),
        calm.at(99),
        attacked.at(99),
        attacked.at(99) / calm.at(99),
        calm.busy_us(),
        attacked.busy_us(),
        attacked.busy_us() / calm.busy_us(),
        calm.took_ns.len(),
        attacked.took_ns.len()
    );
    assert!(heard > 0, "nobody is heard meanwhile");
    assert!(most.own_mib < begin.own_mib + 32.0, "memory grows");
    assert!(
        most.descriptors <= begin.descriptors + 4,
        "descriptors grow"
    );
}

/// A stranger knocks a hundred times a second: members come back meanwhile.
pub(crate) fn knocks(extent: Extent) {
    let home = tempfile::tempdir().unwrap();
    let (mut robots, mut talk) = scene(home.path());
    pairs("knock", extent, &robots, &mut talk);
    let count = extent.of(2, 20);
    let mut attacker = attacker("knock", robots[1].listens, 600.0);
    talk.go_on(1.0);
    let mut took_s = Vec::new();
    for _ in 0..count {
        robots[0].link.as_mut().unwrap().kill();
        robots[0].start_link();
        let there = talk.until_heard(1, 2);
        took_s.push(there + talk.until_heard(2, 1));
    }
    attacker.kill();
    worst(
        "knock: a member that was killed calls who is knocked at, from its start to a message each way",
        took_s,
    );
}

/// A member floods the first robot.
pub(crate) fn a_flood(extent: Extent) {
    let home = tempfile::tempdir().unwrap();
    let (mut robots, mut talk) = scene(home.path());
    pairs("flood", extent, &robots, &mut talk);
    println!("flood: {}", robots[0].last_words());
}
