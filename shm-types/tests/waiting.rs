//! Waiting for a message: nothing is lost, whoever publishes, comes, goes, stops or dies.
//!
//! The other process is this test binary again, in the part that `PART` names.
use std::io::{BufRead, BufReader};
use std::os::fd::AsFd;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use coloc_counting::{Calls, calls_during};
use coloc_shm_types::{Estimate, Odometry, Publisher, RobotName, Space, Subscriber};
use rustix::event::{PollFd, PollFlags, Timespec, epoll, poll};

const PART: &str = "COLOC_TEST_PART";
const ROOT: &str = "COLOC_TEST_ROOT";
const READY: &str = "ready";

/// For what should take microseconds: an endless wait is found, a machine under load is not taken for one.
const PATIENCE: Duration = Duration::from_secs(30);

fn open(root: &Path) -> Space {
    Space::open(root, "t", "test").expect("a space of its own")
}

fn robot() -> RobotName {
    RobotName::new("r1").expect("a name")
}

fn publisher(space: &Space) -> Publisher<Estimate> {
    space.publisher(&robot()).expect("a port")
}

fn subscriber(space: &Space) -> Subscriber<Estimate> {
    space.subscriber(&robot()).expect("a port")
}

fn estimate(tick: u64) -> Estimate {
    Estimate {
        tick,
        ..Estimate::default()
    }
}

fn ticks(estimates: &Subscriber<Estimate>) -> Vec<u64> {
    std::iter::from_fn(|| estimates.receive().expect("received"))
        .map(|estimate| estimate.tick)
        .collect()
}

fn is_readable(fd: impl AsFd) -> bool {
    let mut waited = [PollFd::new(&fd, PollFlags::IN)];
    poll(&mut waited, Some(&Timespec::default())).expect("polled") > 0
}

/// What lies in `/dev/shm` and ends so.
fn files(space: &Space, ending: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir("/dev/shm").expect("a directory");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let name = |path: &Path| path.to_string_lossy().into_owned();
    paths
        .filter(|path| name(path).contains(space.full_prefix()) && name(path).ends_with(ending))
        .collect()
}

fn start(part: &str, root: &Path) -> Child {
    let mut child = Command::new(std::env::current_exe().expect("this binary"))
        .args(["--ignored", "--exact", "the_other_process", "--nocapture"])
        .env(PART, part)
        .env(ROOT, root)
        .stdout(Stdio::piped())
        .spawn()
        .expect("this binary starts");
    let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    assert!(lines.any(|line| line.expect("text").ends_with(READY)));
    child
}

/// As kill -9 does.
fn kill(mut child: Child) {
    child.kill().expect("a child");
    child.wait().expect("a child");
}

#[test]
#[ignore = "not a test: the process that the tests start"]
fn the_other_process() {
    let root = std::env::var_os(ROOT).expect("started by a test");
    let space = open(Path::new(&root));
    let estimates = subscriber(&space);
    match std::env::var(PART).expect("started by a test").as_str() {
        // Arms its bell, and is not there any more when it rings.
        "waiter" => assert!(estimates.wait(Duration::ZERO).expect("waited").is_none()),
        // Says one for each that it hears.
        "parrot" => {
            let said = space.publisher::<Odometry>(&robot()).expect("a port");
            println!("{READY}");
            while let Some(heard) = estimates.wait(PATIENCE).expect("waited") {
                let mut message = Odometry::default();
                message.header.sequence = heard.tick;
                said.send(message).expect("sent");
            }
        }
        part => panic!("no such part: {part}"),
    }
    println!("{READY}");
    std::thread::sleep(PATIENCE);
}

#[test]
fn who_sleeps_is_woken_by_every_message() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let estimates = publisher(&space);
    let answers = space.subscriber::<Odometry>(&robot()).unwrap();
    let parrot = start("parrot", root.path());
    // It has one look and one arming between two messages, and they come at every moment of these.
    for tick in 1..=2000 {
        estimates.send(estimate(tick)).unwrap();
        let answer = answers.wait(PATIENCE).unwrap().expect("an answer");
        assert_eq!(answer.header.sequence, tick);
        let spin = Instant::now();
        while spin.elapsed() < Duration::from_micros(tick % 64) {}
    }
    kill(parrot);
}

#[test]
fn what_is_there_is_returned_at_once_and_time_runs_out() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let (publisher, subscriber) = (publisher(&space), subscriber(&space));
    publisher.refresh().unwrap();
    publisher.send(estimate(1)).unwrap();
    publisher.send(estimate(2)).unwrap();
    let heard = [1, 2].map(|_| subscriber.wait(PATIENCE).unwrap().unwrap().tick);
    assert_eq!(heard, [1, 2]);
    let start = Instant::now();
    let time = Duration::from_millis(20);
    assert!(subscriber.wait(time).unwrap().is_none() && start.elapsed() >= time);
}

#[test]
fn who_comes_late_is_woken_for_the_newest() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let publisher = publisher(&space);
    publisher.send(estimate(7)).unwrap();
    let late = subscriber(&space);
    assert!(late.wait(Duration::ZERO).unwrap().is_none());
    // Nothing new is said.
    publisher.refresh().unwrap();
    assert!(is_readable(late.bell().unwrap()));
    assert_eq!(late.wait(PATIENCE).unwrap().unwrap().tick, 7);
}

#[test]
fn who_comes_between_a_message_and_its_ring_is_woken_for_it() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let publisher = publisher(&space);
    publisher.put(estimate(7)).unwrap();
    let late = subscriber(&space);
    assert!(late.wait(Duration::ZERO).unwrap().is_none());
    publisher.ring();
    assert_eq!(late.wait(PATIENCE).unwrap().unwrap().tick, 7);
}

#[test]
fn the_descriptor_is_readable_after_nothing_was_found_and_something_came() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let (publisher, subscriber) = (publisher(&space), subscriber(&space));
    publisher.refresh().unwrap();
    let bell = subscriber.bell().unwrap();
    assert_eq!(ticks(&subscriber), []);
    assert!(!is_readable(bell));
    publisher.put(estimate(1)).unwrap();
    assert!(!is_readable(bell));
    publisher.ring();
    assert!(is_readable(bell));
    publisher.send(estimate(2)).unwrap();
    assert_eq!(ticks(&subscriber), [1, 2]);
    assert!(!is_readable(bell));
    publisher.send(estimate(3)).unwrap();
    assert!(is_readable(bell));
}

#[test]
fn an_edge_comes_for_every_message_that_is_waited_for() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let subscriber = subscriber(&space);
    let publishers = [publisher(&space), publisher(&space)];
    let epoll = epoll::create(epoll::CreateFlags::CLOEXEC).unwrap();
    let flags = epoll::EventFlags::IN | epoll::EventFlags::ET;
    let data = epoll::EventData::new_u64(0);
    epoll::add(&epoll, subscriber.bell().unwrap(), data, flags).unwrap();
    for tick in 0..100 {
        assert_eq!(ticks(&subscriber), []);
        for publisher in &publishers {
            publisher.send(estimate(tick)).unwrap();
        }
        let mut events = Vec::with_capacity(1);
        let patience = Timespec::try_from(PATIENCE).unwrap();
        let spare = rustix::buffer::spare_capacity(&mut events);
        assert_eq!(epoll::wait(&epoll, spare, Some(&patience)), Ok(1));
        assert_eq!(ticks(&subscriber), [tick, tick]);
    }
}

#[test]
fn who_is_not_asleep_is_not_rung_for() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let (publisher, subscriber) = (publisher(&space), subscriber(&space));
    publisher.refresh().unwrap();
    let bell = subscriber.bell().unwrap();
    for _ in 0..3 {
        for tick in 0..100 {
            publisher.send(estimate(tick)).unwrap();
        }
        // One ring for all of them, which is gone with the first look that finds nothing.
        assert!(is_readable(bell));
        assert_eq!(ticks(&subscriber).len(), 16);
        assert!(!is_readable(bell));
    }
}

#[test]
fn waiting_publishing_and_ringing_allocate_nothing() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let (publisher, subscriber) = (publisher(&space), subscriber(&space));
    publisher.refresh().unwrap();
    subscriber.refresh().unwrap();
    let mut turn = |tick| {
        assert!(subscriber.wait(Duration::ZERO).unwrap().is_none());
        publisher.send(estimate(tick)).unwrap();
        assert_eq!(subscriber.wait(PATIENCE).unwrap().unwrap().tick, tick);
    };
    turn(0);
    let ((), calls) = calls_during(|| (1..1000).for_each(&mut turn));
    assert_eq!(calls, Calls::NONE);
}

#[test]
fn the_dead_leave_no_bell_and_take_no_place() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let publisher = publisher(&space);
    let living = subscriber(&space);
    assert!(living.wait(Duration::ZERO).unwrap().is_none());
    // More than there are places.
    for round in 0..9 {
        let children: Vec<_> = (0..4).map(|_| start("waiter", root.path())).collect();
        assert_eq!(files(&space, ".bell").len(), 5, "round {round}");
        for child in children {
            kill(child);
        }
        // Whoever comes removes what they have left.
        drop(open(root.path()));
        assert_eq!(files(&space, ".bell").len(), 1, "round {round}");
    }
    publisher.send(estimate(1)).unwrap();
    assert_eq!(living.wait(PATIENCE).unwrap().unwrap().tick, 1);
}

#[test]
fn bells_are_private_and_go_with_those_who_have_them() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let subscriber = subscriber(&space);
    assert!(files(&space, ".bell").is_empty() && files(&space, ".bells").is_empty());
    subscriber.bell().unwrap();
    let (bells, pages) = (files(&space, ".bell"), files(&space, ".bells"));
    assert_eq!((bells.len(), pages.len()), (1, 1));
    for path in bells.iter().chain(&pages) {
        let mode = path.metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o7777, 0o600, "{}", path.display());
    }
    assert!(bells[0].metadata().unwrap().file_type().is_socket());
    let publisher = publisher(&space);
    drop(subscriber);
    assert_eq!(files(&space, ".bell").len(), 0);
    assert_eq!(files(&space, ".bells").len(), 1, "the publisher's");
    drop(publisher);
    assert_eq!(files(&space, ".bells").len(), 0);
}

#[test]
fn a_page_that_was_cut_off_or_half_made_is_made_anew() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let page = {
        let _publisher = publisher(&space);
        files(&space, ".bells").remove(0)
    };
    for (length, mode) in [(0, 0o600), (16, 0o600), (0, 0o200)] {
        std::fs::write(&page, vec![0; length]).unwrap();
        std::fs::set_permissions(&page, PermissionsExt::from_mode(mode)).unwrap();
        let (publisher, subscriber) = (publisher(&space), subscriber(&space));
        publisher.refresh().unwrap();
        assert!(subscriber.wait(Duration::ZERO).unwrap().is_none());
        publisher.send(estimate(1)).unwrap();
        assert!(subscriber.wait(PATIENCE).unwrap().is_some());
    }
}

#[test]
fn it_is_woken_from_another_thread_however_the_timing() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let (go, went) = mpsc::channel::<u64>();
    let mine = space.clone();
    let thread = std::thread::spawn(move || {
        let publishers = [publisher(&mine), publisher(&mine)];
        for (tick, publisher) in went.iter().zip(publishers.iter().cycle()) {
            publisher.send(estimate(tick)).unwrap();
        }
    });
    let subscriber = subscriber(&space);
    for tick in 0..2000 {
        go.send(tick).unwrap();
        assert_eq!(subscriber.wait(PATIENCE).unwrap().unwrap().tick, tick);
    }
    drop(go);
    thread.join().unwrap();
}
