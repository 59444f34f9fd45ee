//! Processes that are killed, come and go at once, or do not know of each other.
//!
//! The other process is this test binary again, in the part that `PART` names.
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use coloc_shm_types::private::NotPrivate;
use coloc_shm_types::{Estimate, OpenError, Position, RobotName, Space};
use iceoryx2::prelude::{NodeBuilder, SemanticString, ipc};

const PART: &str = "COLOC_TEST_PART";
const ROOT: &str = "COLOC_TEST_ROOT";
const READY: &str = "ready";

fn open(root: &Path) -> Space {
    Space::open(root, "t", "test").expect("a space of its own")
}

fn robot() -> RobotName {
    RobotName::new("r1").expect("a name")
}

fn remains(root: &Path, full_prefix: &str) -> Vec<String> {
    let names = |directory: &Path| -> Vec<String> {
        let entries = std::fs::read_dir(directory).expect("a directory");
        entries
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .to_string_lossy()
                    .into()
            })
            .collect()
    };
    let segments = names(Path::new("/dev/shm"));
    let ours = segments
        .into_iter()
        .filter(|name| name.starts_with(full_prefix));
    names(root).into_iter().chain(ours).collect()
}

/// Whoever comes next leaves nothing. A process that another test is just starting shares the locks for a moment.
fn assert_swept(root: &Path, full_prefix: &str) {
    let swept = arrives(|| {
        drop(open(root));
        remains(root, full_prefix).is_empty()
    });
    assert!(swept, "{:?}", remains(root, full_prefix));
}

/// The prefix of an empty space, found by a visit that leaves nothing.
fn full_prefix(root: &Path) -> String {
    open(root).full_prefix().to_owned()
}

/// Starts this binary again in `part`; the caller ends it.
fn start(part: &str, root: &Path) -> Child {
    Command::new(std::env::current_exe().expect("this binary"))
        .args(["--ignored", "--exact", "the_other_process", "--nocapture"])
        .env(PART, part)
        .env(ROOT, root)
        .stdout(Stdio::piped())
        .spawn()
        .expect("this binary starts")
}

/// Starts it, and waits until it says that it is ready.
fn start_ready(part: &str, root: &Path) -> Child {
    let mut child = start(part, root);
    let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    assert!(
        lines.any(|line| line.expect("text").ends_with(READY)),
        "`{part}` ended early"
    );
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
    let root = Path::new(&root);
    match std::env::var(PART).expect("started by a test").as_str() {
        "daemon" => daemon(root),
        "visitor" => (0..10).for_each(|_| visit(root)),
        "foreigner" => foreigner(root),
        part => panic!("no such part: {part}"),
    }
}

/// Publishes until killed.
fn daemon(root: &Path) {
    let space = open(root);
    let _claim = space.claim_robot(&robot(), 1).expect("nobody else");
    let _subscriber = space
        .subscriber::<Estimate>(&robot())
        .expect("a subscriber");
    let publisher = space.publisher::<Estimate>(&robot()).expect("a publisher");
    println!("{READY}");
    for tick in 1.. {
        publisher
            .send(Estimate {
                tick,
                ..Estimate::default()
            })
            .expect("sent");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn visit(root: &Path) {
    let space = open(root);
    let publisher = space.publisher::<Position>(&robot()).expect("a publisher");
    let subscriber = space
        .subscriber::<Position>(&robot())
        .expect("a subscriber");
    // A connection to somebody who is killed just then may have to be made again first.
    assert!(arrives(|| publisher.send(Position::default()).is_ok()));
    assert!(subscriber.receive().expect("received").is_some());
}

/// A program that uses iceoryx2 in the same place and knows nothing of the lock, as from another language.
fn foreigner(root: &Path) {
    let mut config = iceoryx2::config::Config::default();
    let path = root.to_str().expect("a temporary directory");
    config
        .global
        .set_root_path(&iceoryx2::prelude::Path::new(path.as_bytes()).expect("short"));
    // It is started into a space that lives, and goes on alone.
    let space = open(root);
    let prefix = space.middleware_prefix();
    config.global.prefix = iceoryx2::prelude::FileName::new(prefix.as_bytes()).expect("plain");
    let node = NodeBuilder::new()
        .config(&config)
        .create::<ipc::Service>()
        .expect("a node");
    let service = node
        .service_builder(&"other".try_into().expect("a name"))
        .publish_subscribe::<u64>()
        .create()
        .expect("a service");
    let _publisher = service.publisher_builder().create().expect("a publisher");
    drop(space);
    println!("{READY}");
    std::thread::sleep(Duration::from_secs(600));
}

#[test]
fn what_the_killed_leave_is_removed_at_the_next_start() {
    let root = tempfile::tempdir().unwrap();
    let prefix = full_prefix(root.path());
    kill(start_ready("daemon", root.path()));
    assert!(
        remains(root.path(), &prefix).len() > 3,
        "the killed one left its files"
    );
    assert_swept(root.path(), &prefix);
}

/// As a power cut does.
#[test]
fn what_is_left_is_removed_and_said_though_its_key_and_lock_are_spoiled() {
    let root = tempfile::tempdir().unwrap();
    let prefix = full_prefix(root.path());
    for spoil_key in [true, false] {
        kill(start_ready("daemon", root.path()));
        if spoil_key {
            std::fs::remove_file(root.path().join("key")).unwrap();
        }
        for name in remains(root.path(), &prefix) {
            if name.ends_with("lock") {
                std::fs::write(Path::new("/dev/shm").join(name), "noise").unwrap();
            }
        }
        let space = open(root.path());
        let said: Vec<_> = space.remarks().iter().map(ToString::to_string).collect();
        assert!(said.iter().any(|line| line.contains("removed")), "{said:?}");
        drop(space);
        assert_swept(root.path(), &prefix);
    }
}

#[test]
fn kills_at_any_moment_do_not_accumulate() {
    let root = tempfile::tempdir().unwrap();
    let prefix = full_prefix(root.path());
    for after_ms in 0..20 {
        let child = start("daemon", root.path());
        std::thread::sleep(Duration::from_millis(after_ms));
        kill(child);
    }
    visit(root.path());
    assert_swept(root.path(), &prefix);
}

#[test]
fn a_killed_publisher_comes_back_while_its_reader_lives() {
    let root = tempfile::tempdir().unwrap();
    let reader = open(root.path());
    let subscriber = reader.subscriber::<Estimate>(&robot()).unwrap();
    for _ in 0..12 {
        let daemon = start_ready("daemon", root.path());
        // Nothing is left of the one before: what arrives is of this one.
        assert!(arrives(|| subscriber.receive().unwrap().is_some()));
        kill(daemon);
        while subscriber.receive().unwrap().is_some() {}
    }
}

/// Whether it happens; a generous limit, so that a machine under load is not taken for a fault.
fn arrives(mut happened: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(30) {
        if happened() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    false
}

#[test]
fn a_claim_ends_with_its_process() {
    let root = tempfile::tempdir().unwrap();
    let daemon = start_ready("daemon", root.path());
    let space = open(root.path());
    let refusal = space.claim_robot(&robot(), 1).unwrap_err();
    assert!(matches!(refusal, OpenError::AlreadyClaimed { pid, .. } if pid == Some(daemon.id())));
    kill(daemon);
    space.claim_robot(&robot(), 1).unwrap();
}

#[test]
fn many_may_come_and_go_at_once() {
    let root = tempfile::tempdir().unwrap();
    let prefix = full_prefix(root.path());
    let visitors: Vec<_> = (0..6).map(|_| start("visitor", root.path())).collect();
    for visitor in visitors {
        let output = visitor.wait_with_output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(
            output.status.success() && text.contains("1 passed"),
            "{text}"
        );
    }
    assert_swept(root.path(), &prefix);
}

#[test]
fn who_is_killed_among_others_stops_none_of_them() {
    let root = tempfile::tempdir().unwrap();
    let prefix = full_prefix(root.path());
    let mut random: u64 = 1;
    for round in 0..40 {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let mut visitors: Vec<_> = (0..4).map(|_| start("visitor", root.path())).collect();
        std::thread::sleep(Duration::from_micros((random >> 32) % 60_000));
        kill(visitors.remove(0));
        for visitor in visitors {
            let output = visitor.wait_with_output().unwrap();
            let text = String::from_utf8_lossy(&output.stdout);
            assert!(text.contains("1 passed"), "round {round}: {text}");
        }
    }
    assert_swept(root.path(), &prefix);
}

#[test]
fn a_living_program_that_knows_no_lock_is_not_swept_away() {
    let root = tempfile::tempdir().unwrap();
    let prefix = full_prefix(root.path());
    let foreigner = start_ready("foreigner", root.path());
    drop(open(root.path()));
    assert!(
        !remains(root.path(), &prefix).is_empty(),
        "the foreigner's node is still there"
    );
    kill(foreigner);
    assert_swept(root.path(), &prefix);
}

#[test]
fn nor_is_one_whose_root_was_deleted() {
    let temporary = tempfile::tempdir().unwrap();
    let root = temporary.path().join("shm");
    let foreigner = start_ready("foreigner", &root);
    let segments = |prefix: &str| {
        let mut names = remains(&root, prefix);
        names.retain(|name| Path::new(name).extension() == Some("data".as_ref()));
        names
    };
    std::fs::remove_dir_all(&root).unwrap();
    let newcomer = open(&root);
    let prefix = newcomer.full_prefix().to_owned();
    assert_eq!(segments(&prefix).len(), 1, "the foreigner's");
    drop(newcomer);
    kill(foreigner);
    assert_swept(&root, &prefix);
}

#[test]
fn another_users_space_is_refused() {
    let temporary = tempfile::tempdir().unwrap();
    // The superuser gives a directory away; anybody else finds one of the superuser's.
    let root = if rustix::process::geteuid().is_root() {
        std::os::unix::fs::chown(temporary.path(), Some(65534), None).unwrap();
        temporary.path()
    } else {
        Path::new("/usr")
    };
    let refusal = Space::open(root, "t", "test").unwrap_err();
    assert!(
        matches!(refusal, OpenError::NotPrivate(NotPrivate::WrongUser { owner, own, .. }) if owner != own)
    );
    assert!(refusal.to_string().contains("same user"));
}
