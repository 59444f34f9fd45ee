//! The page that a group may read: always whole, always the newest, and nobody who waits for it is forgotten. What other users
//! can do with it is tried in `tests/tests/strangers`.
//!
//! The other process is this test binary again.
use std::io::{BufRead, BufReader};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use coloc_counting::{Calls, calls_during};
use coloc_shm_types::{
    Estimate, Group, GroupPage, Publisher, ReadError, Reader, RobotName, Space, Subscriber,
};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

const ROOT: &str = "COLOC_TEST_ROOT";
const READY: &str = "ready";

/// For what should take microseconds: an endless wait is found, a machine under load is not taken for one.
const PATIENCE: Duration = Duration::from_secs(30);

/// Of the connections of a user.
const PLACES: usize = 8;

fn open(root: &Path) -> Space {
    Space::open(root, "t", "test").expect("a space of its own")
}

fn name() -> RobotName {
    RobotName::new("r1").expect("a name")
}

/// A group of ours.
fn group() -> Group {
    let own = rustix::process::getegid().as_raw();
    Group::find(&own.to_string()).expect("a number will do")
}

/// What a daemon has of it.
struct Robot {
    page: GroupPage,
    estimates: Publisher<Estimate>,
    space: Space,
}

impl Robot {
    fn new(root: &Path) -> Self {
        let space = open(root);
        let estimates = space.publisher(&name()).expect("a port");
        let page = estimates.open_to(&group(), &name(), 3).expect("a page");
        Self {
            page,
            estimates,
            space,
        }
    }

    fn say(&self, tick: u64) {
        let estimate = estimate(tick);
        self.page.write(&estimate);
        self.estimates.send(estimate).expect("sent");
        self.page.settle();
    }
}

/// Every part of which says which one it is.
#[allow(clippy::cast_precision_loss)] // Far below 2^53.
fn estimate(tick: u64) -> Estimate {
    let number = tick as f64;
    Estimate {
        tick,
        pose: [number; 3],
        odometry: [number; 3],
        independent: [number; 9],
        dependent: [number; 9],
        velocity_covariance: [number; 9],
        ..Estimate::default()
    }
}

fn reader(root: &Path) -> Reader {
    Reader::open(root, &name()).expect("a reader")
}

fn wait(reader: &Reader) -> Option<u64> {
    let estimate = reader.wait(PATIENCE).expect("waited");
    estimate.map(|estimate| estimate.tick)
}

fn is_readable(reader: &Reader) -> bool {
    is_readable_within(Duration::ZERO, reader)
}

fn is_readable_within(time: Duration, reader: &Reader) -> bool {
    let bell = reader.bell().expect("there is a robot");
    let mut waited = [PollFd::from_borrowed_fd(bell, PollFlags::IN)];
    let time = Timespec::try_from(time).expect("a short time");
    poll(&mut waited, Some(&time)).expect("polled") > 0
}

/// It has heard so.
fn is_let_in(reader: &Reader) {
    let is_let_in = || {
        reader.bell().expect("there is a robot");
        assert_eq!(reader.receive().expect("the robot lives"), None);
        reader.has_place()
    };
    assert!(comes(is_let_in));
}

/// Within a time that is long enough for everybody.
fn comes(what: impl Fn() -> bool) -> bool {
    let start = Instant::now();
    while !what() && start.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    what()
}

/// What lies in `/dev/shm` of that space, and ends so.
fn files(full_prefix: &str, ending: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir("/dev/shm").expect("a directory");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let is_ours = |path: &PathBuf| {
        let path = path.to_string_lossy();
        path.contains(full_prefix) && path.ends_with(ending)
    };
    paths.filter(is_ours).collect()
}

#[test]
fn the_newest_is_there_for_who_looks_and_once_for_who_receives() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    let reader = reader(root.path());
    assert_eq!((reader.newest(), reader.receive().unwrap()), (None, None));
    for tick in 1..=5 {
        robot.say(tick);
        assert_eq!(reader.newest(), Some(estimate(tick)));
    }
    assert_eq!(reader.receive().unwrap(), Some(estimate(5)));
    assert_eq!(reader.receive().unwrap(), None);
    assert_eq!(reader.newest(), Some(estimate(5)));
    assert_eq!(wait(&self::reader(root.path())), Some(5), "who comes late");
}

#[test]
fn who_may_read_stands_in_the_modes() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    for (ending, mode) in [(".page", 0o640), (".door", 0o660)] {
        let found = files(robot.space.full_prefix(), ending);
        let [file] = found.as_slice() else {
            panic!("{found:?}");
        };
        let found = file.symlink_metadata().unwrap();
        assert_eq!(found.permissions().mode() & 0o7777, mode, "{ending}");
        assert_eq!(found.gid(), rustix::process::getegid().as_raw());
    }
    assert_eq!(root.path().metadata().unwrap().mode() & 0o777, 0o700);
}

#[test]
fn what_is_read_is_whole_however_fast_it_is_written() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    let reader = reader(root.path());
    let has_read = &AtomicBool::new(false);
    std::thread::scope(|threads| {
        threads.spawn(move || {
            let (mut last, mut count) = (0, 0);
            while count < 20_000 {
                if let Some(found) = reader.newest() {
                    assert_eq!(found, estimate(found.tick));
                    assert!(found.tick >= last, "{} after {last}", found.tick);
                    count += u32::from(found.tick > last);
                    last = found.tick;
                }
            }
            has_read.store(true, Ordering::Relaxed);
        });
        let (page, start) = (&robot.page, Instant::now());
        let is_over = || has_read.load(Ordering::Relaxed) || start.elapsed() > PATIENCE;
        let mut tick = 0;
        while !is_over() {
            tick += 1;
            page.write(&estimate(tick));
        }
        assert!(has_read.load(Ordering::Relaxed));
    });
}

#[test]
fn who_sleeps_is_woken_by_every_estimate() {
    let root = tempfile::tempdir().unwrap();
    let (go, went) = mpsc::channel::<u64>();
    let (ready, is_ready) = mpsc::channel();
    let at = root.path().to_owned();
    let thread = std::thread::spawn(move || {
        let robot = Robot::new(&at);
        ready.send(()).unwrap();
        for tick in went {
            robot.say(tick);
        }
    });
    is_ready.recv().unwrap();
    let readers = [reader(root.path()), reader(root.path())];
    for tick in 1..=2000 {
        go.send(tick).unwrap();
        assert_eq!(readers.each_ref().map(wait), [Some(tick); 2]);
    }
    drop(go);
    thread.join().unwrap();
}

/// Whether the porter is awake by then, has been called too early, or comes too late.
#[test]
fn who_sleeps_is_woken_by_every_estimate_that_was_expected() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    if let Err(refused) = robot.page.hasten(1) {
        return eprintln!("SKIPPED: a thread in real time: {refused}");
    }
    let reader = reader(root.path());
    is_let_in(&reader);
    for tick in 1..=2000 {
        robot.page.expect();
        std::thread::sleep(Duration::from_micros(tick % 8 * 100));
        robot.say(tick);
        assert_eq!(wait(&reader), Some(tick));
    }
    assert!(reader.has_place());
}

#[test]
fn a_descriptor_says_that_there_is_something() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    let reader = reader(root.path());
    is_let_in(&reader);
    assert!(!is_readable(&reader));
    robot.say(1);
    assert!(comes(|| is_readable(&reader)));
    assert_eq!(reader.receive().unwrap(), Some(estimate(1)));
    assert_eq!(reader.receive().unwrap(), None);
    assert!(!is_readable(&reader));
}

#[test]
fn who_waits_in_vain_comes_back() {
    let root = tempfile::tempdir().unwrap();
    let _robot = Robot::new(root.path());
    let reader = reader(root.path());
    assert_eq!(reader.wait(Duration::ZERO).unwrap(), None);
    assert_eq!(reader.wait(Duration::from_millis(20)).unwrap(), None);
}

/// What its connection holds is not more than a few rings; whoever else waits is woken by each.
#[test]
fn who_does_not_come_back_keeps_nobody_from_being_woken_and_is_heard_again() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    let (sleeper, awake) = (reader(root.path()), reader(root.path()));
    sleeper.bell().unwrap();
    for tick in 1..=200 {
        robot.say(tick);
        assert_eq!(wait(&awake), Some(tick));
    }
    assert_eq!(wait(&sleeper), Some(200));
    assert_eq!(sleeper.receive().unwrap(), None);
    for tick in 201..=400 {
        robot.say(tick);
        assert_eq!([wait(&awake), wait(&sleeper)], [Some(tick); 2]);
    }
}

#[test]
fn who_finds_no_place_looks_until_there_is_one() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    let mut readers: Vec<_> = (0..PLACES).map(|_| reader(root.path())).collect();
    readers.iter().for_each(is_let_in);
    let late = reader(root.path());
    for tick in 1..=20 {
        robot.say(tick);
        assert_eq!(wait(&late), Some(tick));
        assert!(readers.iter().all(|reader| wait(reader) == Some(tick)));
    }
    assert_eq!(late.wait(Duration::from_millis(20)).unwrap(), None);
    assert!(is_readable_within(PATIENCE, &late), "by the clock");
    assert!(!late.has_place());
    assert!(readers.iter().all(Reader::has_place));
    readers.pop();
    is_let_in(&late);
    let is_quiet = || {
        assert_eq!(late.receive().unwrap(), None);
        !is_readable_within(Duration::from_millis(50), &late)
    };
    assert!(comes(is_quiet), "the clock has stopped");
    robot.say(21);
    assert_eq!(wait(&late), Some(21));
    drop(robot);
    let refusal = late.wait(PATIENCE).unwrap_err();
    assert!(matches!(refusal, ReadError::Gone { .. }), "{refusal}");
}

#[test]
fn the_owners_waiters_and_the_groups_take_no_place_from_each_other() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let subscribers: Vec<Subscriber<Estimate>> = (0..32)
        .map(|_| {
            let subscriber = space.subscriber(&name()).unwrap();
            subscriber.bell().unwrap();
            subscriber
        })
        .collect();
    let robot = Robot::new(root.path());
    let readers: Vec<_> = (0..PLACES).map(|_| reader(root.path())).collect();
    for reader in &readers {
        reader.bell().unwrap();
    }
    robot.say(1);
    assert!(readers.iter().all(|reader| wait(reader) == Some(1)));
    for subscriber in &subscribers {
        assert_eq!(subscriber.wait(PATIENCE).unwrap().unwrap().tick, 1);
    }
}

#[test]
fn a_robot_that_ends_wakes_who_waits_for_it_and_leaves_nothing() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    let full_prefix = robot.space.full_prefix().to_owned();
    robot.say(1);
    let reader = reader(root.path());
    assert_eq!(wait(&reader), Some(1));
    assert!(reader.check().is_ok());
    let sleeper = self::reader(root.path());
    sleeper.bell().unwrap();
    let refusal = std::thread::scope(|threads| {
        let waits = threads.spawn(|| {
            let sleeper = sleeper;
            assert_eq!(wait(&sleeper), Some(1));
            sleeper.wait(PATIENCE).unwrap_err()
        });
        drop(robot);
        waits.join().unwrap()
    });
    assert!(matches!(refusal, ReadError::Gone { .. }), "{refusal}");
    let refusal = reader.wait(PATIENCE).unwrap_err();
    assert!(matches!(refusal, ReadError::Gone { .. }), "{refusal}");
    assert!(reader.check().is_err());
    assert_eq!(reader.newest(), Some(estimate(1)), "as old as it is");
    let refusal = Reader::open(root.path(), &name()).unwrap_err();
    assert!(matches!(refusal, ReadError::NotThere { .. }), "{refusal}");
    for ending in [".page", ".door", ".bell"] {
        assert_eq!(files(&full_prefix, ending), [] as [PathBuf; 0]);
    }
}

#[test]
#[ignore = "not a test: the process that a test starts"]
fn the_other_process() {
    let root = std::env::var_os(ROOT).expect("started by a test");
    let robot = Robot::new(Path::new(&root));
    robot.say(7);
    println!("{READY}");
    std::thread::sleep(PATIENCE);
}

fn start(root: &Path) -> Child {
    let mut child = Command::new(std::env::current_exe().expect("this binary"))
        .args(["--ignored", "--exact", "the_other_process", "--nocapture"])
        .env(ROOT, root)
        .stdout(Stdio::piped())
        .spawn()
        .expect("this binary starts");
    let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    assert!(lines.any(|line| line.expect("text").ends_with(READY)));
    child
}

#[test]
fn what_a_robot_leaves_that_was_killed_is_removed_though_somebody_reads_it() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let mut child = start(root.path());
    let reader = reader(root.path());
    assert_eq!(wait(&reader), Some(7));
    child.kill().unwrap();
    child.wait().unwrap();
    let refusal = reader.wait(PATIENCE).unwrap_err();
    assert!(matches!(refusal, ReadError::Gone { .. }), "{refusal}");
    assert_eq!(files(space.full_prefix(), ".page").len(), 1);
    assert!(Reader::open(root.path(), &name()).is_err());
    // It is read at once when it is there again, whatever is left of it.
    let robot = Robot::new(root.path());
    robot.say(1);
    assert_eq!(wait(&self::reader(root.path())), Some(1));
    let is_swept = || {
        drop(open(root.path()));
        [".page", ".door"].map(|ending| files(space.full_prefix(), ending).len()) == [1; 2]
    };
    assert!(comes(is_swept));
    assert_eq!(reader.newest(), Some(estimate(7)));
}

#[test]
fn neither_writing_nor_waking_allocates() {
    let root = tempfile::tempdir().unwrap();
    let robot = Robot::new(root.path());
    let reader = reader(root.path());
    // The first ring connects.
    is_let_in(&reader);
    robot.say(0);
    let mut during = Calls::NONE;
    for tick in 1..=1000 {
        let ((), calls) = calls_during(|| robot.say(tick));
        during += calls;
        assert_eq!(wait(&reader), Some(tick));
    }
    assert_eq!(during, Calls::NONE);
}

#[test]
fn where_nothing_was_opened_nothing_is_read() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let _estimates = space.publisher::<Estimate>(&name()).unwrap();
    for root in [root.path(), Path::new("/nowhere/at/all")] {
        let refusal = Reader::open(root, &name()).unwrap_err();
        assert!(matches!(refusal, ReadError::NotThere { .. }), "{refusal}");
    }
}
