//! What is left by processes that died at the wrong moment, while others live.
//!
//! The other process is this test binary again, in the part that `PART` names. Everything that could wait without end is
//! done in such a process, which is given [`PATIENCE`].
use std::io::{BufRead, BufReader};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, Remark, RobotName, Space};

const PART: &str = "COLOC_TEST_PART";
const ROOT: &str = "COLOC_TEST_ROOT";
const READY: &str = "ready";

/// For what should take milliseconds: an endless wait is found, a machine under load is not taken for one.
const PATIENCE: Duration = Duration::from_secs(30);

fn open(root: &Path) -> Space {
    Space::open(root, "t", "test").expect("a space of its own")
}

fn robot(name: &str) -> RobotName {
    RobotName::new(name).expect("a name")
}

/// Starts this binary again in `part`.
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
    let lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    let (said, ready) = mpsc::channel();
    std::thread::spawn(move || {
        let ready = lines
            .map_while(Result::ok)
            .any(|line| line.ends_with(READY));
        let _ = said.send(ready);
    });
    let ready = ready.recv_timeout(PATIENCE);
    if ready != Ok(true) {
        kill(child);
        panic!("`{part}` did not get ready: {ready:?}");
    }
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
    match std::env::var(PART).expect("started by a test").as_str() {
        "daemon" => daemon(&space),
        "reader" => reader(&space),
        part => panic!("no such part: {part}"),
    }
}

/// Publishes for r1, and listens to itself, until killed.
fn daemon(space: &Space) {
    let publisher = space.publisher::<Estimate>(&robot("r1")).expect("a port");
    let subscriber = space.subscriber::<Estimate>(&robot("r1")).expect("a port");
    println!("{READY}");
    loop {
        publisher.send(Estimate::default()).expect("sent");
        subscriber.receive().expect("received");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Listens to r2 until it hears something.
fn reader(space: &Space) {
    let subscriber = space.subscriber::<Estimate>(&robot("r2")).expect("a port");
    println!("{READY}");
    while subscriber.receive().expect("received").is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    // Nobody reads what the test harness has to say.
    std::process::exit(0);
}

fn files(directory: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(directory).expect("a directory");
    entries
        .map(|entry| entry.expect("an entry").path())
        .collect()
}

fn segments(full_prefix: &str) -> Vec<PathBuf> {
    let mut segments = files(Path::new("/dev/shm"));
    segments.retain(|path| path.to_string_lossy().contains(full_prefix));
    segments.sort();
    segments
}

/// All files of a space, but for claims, which are locks.
fn all_files(root: &Path, full_prefix: &str) -> Vec<PathBuf> {
    let mut all = segments(full_prefix);
    let mut directories = vec![root.to_owned()];
    while let Some(directory) = directories.pop() {
        for path in files(&directory) {
            if path.is_dir() {
                directories.push(path);
            } else if !path.to_string_lossy().contains("claims") {
                all.push(path);
            }
        }
    }
    all.sort();
    all
}

/// As a process leaves it that dies between making a segment and giving it its length.
fn make_half_made(path: &Path) {
    let _ = std::fs::remove_file(path);
    std::fs::write(path, []).expect("a file");
    std::fs::set_permissions(path, PermissionsExt::from_mode(0o200)).expect("our file");
}

fn arrives(mut happened: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if happened() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    false
}

/// Whoever listens to r2 in this process, and whether all of it is still there.
struct Listener {
    space: Space,
    _subscriber: coloc_shm_types::Subscriber<Estimate>,
    files: Vec<(PathBuf, u64)>,
}

impl Listener {
    fn new(root: &Path) -> Self {
        let space = open(root);
        let subscriber = space.subscriber::<Estimate>(&robot("r2")).expect("a port");
        let files = all_files(root, space.full_prefix());
        let inode = |path: PathBuf| (path.clone(), path.metadata().expect("there").ino());
        Self {
            space,
            _subscriber: subscriber,
            files: files.into_iter().map(inode).collect(),
        }
    }

    fn assert_untouched(&self) {
        for (path, inode) in &self.files {
            let now = path.metadata().map(|metadata| metadata.ino());
            assert_eq!(now.ok(), Some(*inode), "{}", path.display());
        }
    }

    fn is_alone(&self, root: &Path) -> bool {
        let now = all_files(root, self.space.full_prefix());
        now.iter().eq(self.files.iter().map(|(path, _)| path))
    }
}

#[test]
fn half_made_segments_of_the_dead_lock_nobody_out() {
    let root = tempfile::tempdir().unwrap();
    let listener = Listener::new(root.path());
    let prefix = listener.space.full_prefix();
    let before = segments(prefix);
    let daemon = start_ready("daemon", root.path());
    let mut theirs = segments(prefix);
    theirs.retain(|path| !before.contains(path));
    assert!(theirs.len() >= 3, "participants, data, connection");
    kill(daemon);
    for path in &theirs {
        make_half_made(path);
    }
    kill(start_ready("daemon", root.path()));
    listener.assert_untouched();
    assert!(arrives(|| {
        listener.space.tidy();
        listener.is_alone(root.path())
    }));
}

#[test]
fn it_is_said_what_was_removed() {
    let root = tempfile::tempdir().unwrap();
    let listener = Listener::new(root.path());
    let orphan = format!("/dev/shm/{}orphan.data", listener.space.middleware_prefix());
    make_half_made(Path::new(&orphan));
    let remarks = open(root.path()).remarks().to_vec();
    assert!(
        matches!(remarks.as_slice(), [Remark::Tidied { files: 1, .. }]),
        "{remarks:?}"
    );
}

#[test]
fn a_half_made_counter_of_all_nodes_locks_nobody_out() {
    let root = tempfile::tempdir().unwrap();
    let listener = Listener::new(root.path());
    let counter = segments(listener.space.full_prefix())
        .into_iter()
        .find(|path| path.to_string_lossy().ends_with("global_mgmt"))
        .unwrap();
    make_half_made(&counter);
    kill(start_ready("daemon", root.path()));
}

/// Cuts off three files of four, anywhere, and leaves them as if they were complete, or not.
fn cut_off(files: &[PathBuf], seed: u64) {
    let mut random = seed;
    for path in files {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        if random >> 62 == 0 {
            continue;
        }
        std::fs::set_permissions(path, PermissionsExt::from_mode(0o600)).expect("our file");
        let file = std::fs::OpenOptions::new().write(true).open(path);
        let file = file.expect("our file");
        let length = file.metadata().expect("our file").len();
        file.set_len((random >> 32) % (length + 1))
            .expect("our file");
        let mode = [0o400, 0o600, 0o700][usize::from(random.to_le_bytes()[3] % 3)];
        std::fs::set_permissions(path, PermissionsExt::from_mode(mode)).expect("our file");
    }
}

#[test]
fn whatever_was_cut_off_the_next_start_works_while_others_live() {
    for seed in 1..=40 {
        let root = tempfile::tempdir().unwrap();
        let listener = Listener::new(root.path());
        let prefix = listener.space.full_prefix();
        let before = all_files(root.path(), prefix);
        kill(start_ready("daemon", root.path()));
        let mut theirs = all_files(root.path(), prefix);
        theirs.retain(|path| !before.contains(path));
        cut_off(&theirs, seed);
        kill(start_ready("daemon", root.path()));
        listener.assert_untouched();
        let gone = arrives(|| {
            listener.space.tidy();
            all_files(root.path(), prefix) == before
        });
        let now = all_files(root.path(), prefix);
        assert!(gone, "seed {seed}: {now:#?}, once {before:#?}");
    }
}

#[test]
fn whatever_was_cut_off_the_next_start_works_and_the_last_one_leaves_nothing() {
    for seed in 1..=40 {
        let root = tempfile::tempdir().unwrap();
        let prefix = open(root.path()).full_prefix().to_owned();
        kill(start_ready("daemon", root.path()));
        let mut theirs = all_files(root.path(), &prefix);
        // The lock says whose the others are. No power cut gets at it: it is in memory.
        theirs.retain(|path| path.extension() != Some("lock".as_ref()));
        cut_off(&theirs, seed);
        kill(start_ready("daemon", root.path()));
        // A process that another test is just starting shares the lock for a moment.
        let gone = arrives(|| {
            drop(open(root.path()));
            all_files(root.path(), &prefix).is_empty()
        });
        let now = all_files(root.path(), &prefix);
        assert!(gone, "seed {seed}: {now:#?}");
    }
}

/// What has places in a service, and what each of them says of itself below `nodes`.
const ENDINGS: [&str; 6] = [
    ".node_monitor_context",
    ".node_monitor",
    ".node_monitor_owner_lock",
    "node.details",
    ".service_tag",
    ".port_tag",
];

#[test]
fn whatever_of_a_dead_node_was_emptied_its_places_are_free_again() {
    for ending in ENDINGS {
        let root = tempfile::tempdir().unwrap();
        let space = open(root.path());
        let _subscriber = space
            .subscriber::<Estimate>(&robot("r1"))
            .expect("it keeps the service");
        let before = all_files(root.path(), space.full_prefix());
        // Four publishers have a place at once.
        for round in 0..6 {
            kill(start_ready("daemon", root.path()));
            let mut theirs = all_files(root.path(), space.full_prefix());
            theirs.retain(|path| path.to_string_lossy().ends_with(ending));
            theirs.retain(|path| !before.contains(path));
            assert!(!theirs.is_empty(), "{ending}, round {round}");
            for path in theirs {
                let mode = path.metadata().expect("there").permissions();
                std::fs::set_permissions(&path, PermissionsExt::from_mode(0o600)).expect("ours");
                std::fs::write(&path, []).expect("ours");
                std::fs::set_permissions(&path, mode).expect("ours");
            }
        }
        // iceoryx2 keeps one configuration a process, and takes it where that of the node cannot be read: here it is that of
        // the first space.
        kill(start_ready("daemon", root.path()));
        let gone = arrives(|| {
            space.tidy();
            all_files(root.path(), space.full_prefix()) == before
        });
        let now = all_files(root.path(), space.full_prefix());
        assert!(gone, "{ending}: {now:#?}, once {before:#?}");
    }
}

/// A second name outside the space, so that the file stays when its own is removed.
fn second_name(path: &Path) -> PathBuf {
    let name = path.file_name().expect("a file").to_string_lossy();
    let second = path.with_file_name(format!("kept_{name}"));
    std::fs::hard_link(path, &second).expect("the same file system");
    second
}

#[test]
fn a_service_whose_last_user_died_while_leaving_can_be_used_again() {
    let root = tempfile::tempdir().unwrap();
    let listener = Listener::new(root.path());
    let prefix = listener.space.full_prefix();
    let before = all_files(root.path(), prefix);
    let leaving = open(root.path());
    let publisher = leaving.publisher::<Estimate>(&robot("r1")).unwrap();
    let mut halves = all_files(root.path(), prefix);
    halves.retain(|path| {
        let name = path.to_string_lossy();
        !before.contains(path) && (name.ends_with(".service") || name.ends_with(".dynamic"))
    });
    assert_eq!(halves.len(), 2);
    // The last user closes the service for good and then removes its files. As if it had died in between:
    let kept: Vec<_> = halves.iter().map(|path| second_name(path)).collect();
    drop((publisher, leaving));
    for (path, kept) in halves.iter().zip(&kept) {
        std::fs::rename(kept, path).unwrap();
    }
    let back = open(root.path());
    let publisher = back.publisher::<Estimate>(&robot("r1")).unwrap();
    publisher.send(Estimate::default()).unwrap();
    listener.assert_untouched();
}

/// A reader of r2 whose connection to the publisher here is not used yet: the file, and the reader.
fn unused_connection(root: &Path, full_prefix: &str) -> (PathBuf, Child) {
    let before = segments(full_prefix);
    let reader = start_ready("reader", root);
    let mut connections = segments(full_prefix);
    connections
        .retain(|path| path.to_string_lossy().ends_with(".connection") && !before.contains(path));
    assert_eq!(connections.len(), 1);
    (connections.remove(0), reader)
}

/// `with` a publisher of r2, in a thread of its own that is given [`PATIENCE`].
fn as_publisher(
    root: &Path,
    with: impl FnOnce(&coloc_shm_types::Publisher<Estimate>, &Space) + Send + 'static,
) {
    let (done, finished) = mpsc::channel();
    let root = root.to_owned();
    let thread = std::thread::spawn(move || {
        let space = open(&root);
        let publisher = space.publisher::<Estimate>(&robot("r2")).expect("a port");
        with(&publisher, &space);
        let _ = done.send(());
    });
    // If it panicked, joining says so; if it waits without end, this does.
    let end = finished.recv_timeout(PATIENCE);
    assert_ne!(end, Err(mpsc::RecvTimeoutError::Timeout), "it does not end");
    thread.join().expect("what is asserted there holds");
}

#[test]
fn a_reader_that_dies_while_it_connects_does_not_hold_up_who_sends() {
    let directory = tempfile::tempdir().unwrap();
    let root = directory.path().to_owned();
    as_publisher(directory.path(), move |publisher, space| {
        let (connection, reader) = unused_connection(&root, space.full_prefix());
        make_half_made(&connection);
        assert!(publisher.send(Estimate::default()).is_err(), "it is said");
        kill(reader);
        assert!(arrives(|| {
            space.tidy();
            publisher.send(Estimate::default()).is_ok()
        }));
        assert!(!connection.exists());
    });
}

#[test]
fn a_connection_that_could_not_be_made_is_made_later() {
    let directory = tempfile::tempdir().unwrap();
    let root = directory.path().to_owned();
    as_publisher(directory.path(), move |publisher, space| {
        let (connection, mut reader) = unused_connection(&root, space.full_prefix());
        let complete = connection.with_file_name("kept_complete");
        std::fs::rename(&connection, &complete).unwrap();
        make_half_made(&connection);
        assert!(publisher.send(Estimate::default()).is_err());
        std::fs::rename(&complete, &connection).unwrap();
        let heard = arrives(|| {
            let _ = publisher.send(Estimate::default());
            reader.try_wait().expect("a child").is_some()
        });
        assert!(publisher.send(Estimate::default()).is_ok());
        kill(reader);
        assert!(heard);
    });
}
