//! Full file systems, in `/dev/shm` and below the root: every refusal is an error with words, never a signal or a panic.
//!
//! Each test is this binary again in a mount namespace, where it fills file systems of its own.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

use std::fmt::Debug;
use std::fs::File;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, RobotName, Space};

const PART: &str = "COLOC_TEST_PART";
const PAGE: u64 = 4096;

fn robot(name: &str) -> RobotName {
    RobotName::new(name).expect("a name")
}

/// How to get a mount namespace here, if at all.
fn namespace() -> Option<Vec<&'static str>> {
    let ways = [
        vec!["--mount"],
        vec!["--user", "--map-root-user", "--mount"],
    ];
    ways.into_iter().find(|way| {
        let probe = ["mount", "-t", "tmpfs", "tmpfs", "/dev/shm"];
        let output = Command::new("unshare").args(way).args(probe).output();
        output.is_ok_and(|output| output.status.success())
    })
}

/// Runs `part` there.
fn run(part: &str) {
    let Some(way) = namespace() else {
        println!("SKIPPED: {part} without room: no mount namespace can be made here");
        return;
    };
    let output = Command::new("unshare")
        .args(way)
        .arg(std::env::current_exe().expect("this binary"))
        .args(["--ignored", "--exact", "the_other_process", "--nocapture"])
        .env(PART, part)
        .output()
        .expect("unshare starts");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {text}", output.status);
    assert!(!text.contains("panicked"), "{text}");
}

#[test]
#[ignore = "not a test: the process that the tests start"]
fn the_other_process() {
    match std::env::var(PART).expect("started by a test").as_str() {
        "connecting" => connecting(),
        "opening" => opening(),
        "root" => full_root(),
        part => panic!("no such part: {part}"),
    }
}

#[test]
fn a_connection_for_which_there_is_no_memory_is_made_when_there_is() {
    run("connecting");
}

#[test]
fn a_port_for_which_there_is_no_memory_is_refused() {
    run("opening");
}

#[test]
fn a_full_disk_under_the_root_is_said() {
    run("root");
}

fn mount(options: &str, at: &Path) {
    let status = Command::new("mount")
        .args(["-t", "tmpfs", "-o", options, "tmpfs"])
        .arg(at)
        .status();
    assert!(status.expect("mount starts").success());
}

fn unmount(at: &Path) {
    let status = Command::new("umount").arg("--lazy").arg(at).status();
    assert!(status.expect("umount starts").success());
}

/// Takes all room of what is mounted there but so many pages.
fn leave_free(pages: u64, at: &Path) -> File {
    let ballast = File::create(at.join("ballast")).expect("a file");
    let found = rustix::fs::statvfs(at).expect("it is mounted");
    let taken = found.f_bavail * found.f_frsize - pages * PAGE;
    if taken > 0 {
        let how = rustix::fs::FallocateFlags::empty();
        rustix::fs::fallocate(&ballast, how, 0, taken).expect("so much is free");
    }
    ballast
}

fn make_free(ballast: &File) {
    ballast.set_len(0).expect("our file");
}

fn arrives(mut happened: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(30) {
        if happened() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    false
}

fn connecting() {
    mount("size=16m", Path::new("/dev/shm"));
    let root = tempfile::tempdir().unwrap();
    let space = Space::open(root.path(), "t", "robot").unwrap();
    let other = Space::open(root.path(), "t", "listener").unwrap();
    let publisher = space.publisher::<Estimate>(&robot("r1")).unwrap();
    let ballast = leave_free(0, Path::new("/dev/shm"));
    let subscriber = other.subscriber::<Estimate>(&robot("r1")).unwrap();
    assert_eq!(Space::waiting_connections(), 1, "the subscriber's end");
    assert!(publisher.send(Estimate::default()).is_err());
    assert_eq!(Space::waiting_connections(), 2, "and the publisher's");
    assert!(subscriber.receive().unwrap().is_none());
    make_free(&ballast);
    assert!(arrives(|| {
        let _ = publisher.send(Estimate::default());
        subscriber.receive().unwrap().is_some()
    }));
    assert_eq!(Space::waiting_connections(), 0);
}

fn opening() {
    mount("size=16m", Path::new("/dev/shm"));
    let root = tempfile::tempdir().unwrap();
    let space = Space::open(root.path(), "t", "robot").unwrap();
    let mut opened = Vec::new();
    for pages in 0..80 {
        let ballast = leave_free(pages, Path::new("/dev/shm"));
        let publisher = space.publisher::<Estimate>(&robot("r1"));
        if let Ok(publisher) = &publisher {
            // Every page of it can be written.
            (0..100).for_each(|_| publisher.send(Estimate::default()).unwrap());
        }
        opened.push(said(&publisher, "/dev/shm"));
        drop(publisher);
        make_free(&ballast);
    }
    assert!(!opened[0] && opened[79], "{opened:?}");
}

/// Whether it went well; if not, that it says what to do.
fn said<T: Debug, E: std::error::Error>(result: &Result<T, E>, where_to_look: &str) -> bool {
    if let Err(problem) = result {
        let words = problem.to_string();
        assert!(words.contains(where_to_look), "{words}");
        assert!(words.contains("No space left"), "{words}");
    }
    result.is_ok()
}

fn full_root() {
    mount("size=16m", Path::new("/dev/shm"));
    let directory = tempfile::tempdir().unwrap();
    let blocks = (1..100)
        .step_by(3)
        .map(|pages| format!("size={}", pages * PAGE));
    let entries = (2..90)
        .step_by(3)
        .map(|entries| format!("nr_inodes={entries}"));
    let outcomes: Vec<_> = blocks
        .chain(entries)
        .map(|options| on_a_disk_of(&options, directory.path()))
        .collect();
    assert!(outcomes.contains(&true) && outcomes.contains(&false));
    on_a_disk_that_fills(directory.path());
}

fn on_a_disk_of(options: &str, root: &Path) -> bool {
    mount(options, root);
    let space = Space::open(root, "t", "robot");
    let opened = said(&space, "root") && {
        let space = space.as_ref().expect("it went well");
        said(&space.publisher::<Estimate>(&robot("r1")), "root")
            && said(&space.subscriber::<Estimate>(&robot("r1")), "root")
    };
    drop(space);
    unmount(root);
    opened
}

fn on_a_disk_that_fills(root: &Path) {
    mount("size=1m", root);
    let space = Space::open(root, "t", "robot").unwrap();
    // Its place in the root is where nothing of coloc is listed.
    let claims = root.join("claims");
    std::fs::create_dir_all(&claims).unwrap();
    let opened: Vec<_> = (0..8)
        .map(|pages| {
            let ballast = leave_free(pages, &claims);
            let publisher = space.publisher::<Estimate>(&robot("r1"));
            make_free(&ballast);
            said(&publisher, "root")
        })
        .collect();
    assert!(!opened[0] && opened[7], "{opened:?}");
    drop(space);
    unmount(root);
}
