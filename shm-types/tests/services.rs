//! Services of which files were taken away while somebody uses them, or which somebody is just making or removing.
use std::path::{Path, PathBuf};
use std::time::Duration;

use coloc_shm_types::{Estimate, Header, Lost, PortError, Position, RobotName, Space};
use rustix::fs::{FlockOperation, flock};

fn open(root: &Path) -> Space {
    Space::open(root, "t", "test").expect("a space of its own")
}

fn robot() -> RobotName {
    RobotName::new("r1").expect("a name")
}

/// The only file there whose name is of this space and ends so.
fn only(directory: &Path, space: &Space, ending: &str) -> PathBuf {
    let entries = std::fs::read_dir(directory).expect("a directory");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut found = paths.filter(|path| {
        let name = path.file_name().expect("an entry").to_string_lossy();
        name.starts_with(space.middleware_prefix()) && name.ends_with(ending)
    });
    let first = found.next().expect("a file");
    assert_eq!(found.next(), None);
    first
}

fn description(root: &Path, space: &Space) -> PathBuf {
    only(&root.join("services"), space, ".service")
}

fn participants(space: &Space) -> PathBuf {
    only(Path::new("/dev/shm"), space, ".dynamic")
}

#[test]
fn a_service_whose_participants_cannot_be_found_is_made_anew() {
    let root = tempfile::tempdir().unwrap();
    let lost = open(root.path());
    let _subscriber = lost.subscriber::<Estimate>(&robot()).unwrap();
    std::fs::remove_file(participants(&lost)).unwrap();
    let newcomer = open(root.path());
    let publisher = newcomer.publisher::<Estimate>(&robot()).unwrap();
    let subscriber = newcomer.subscriber::<Estimate>(&robot()).unwrap();
    publisher.send(Estimate::default()).unwrap();
    assert!(subscriber.receive().unwrap().is_some());
    // Whoever is in the old one is told.
    let service = description(root.path(), &newcomer);
    assert_eq!(lost.check(), Err(Lost(service.clone())));
    let refusal = lost.publisher::<Estimate>(&robot()).unwrap_err();
    assert!(matches!(&refusal, PortError::Lost(Lost(path)) if *path == service));
    assert_eq!(newcomer.check(), Ok(()));
}

#[test]
fn a_service_that_was_removed_is_missed() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let publisher = space.publisher::<Estimate>(&robot()).unwrap();
    let subscriber = space.subscriber::<Estimate>(&robot()).unwrap();
    let service = description(root.path(), &space);
    assert_eq!(space.check(), Ok(()));
    let away = root.path().join("services/away");
    std::fs::rename(&service, &away).unwrap();
    assert_eq!(space.check(), Err(Lost(service.clone())));
    std::fs::rename(&away, &service).unwrap();
    assert_eq!(space.check(), Ok(()));
    // Removed by its last port, it is missed by nobody.
    drop(publisher);
    assert!(service.exists());
    drop(subscriber);
    assert_eq!((service.exists(), space.check()), (false, Ok(())));
}

/// A reader that looks once in a tick, and senders that spoke and ended within it.
#[test]
fn what_sixteen_said_before_they_left_is_heard() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let subscriber = space.subscriber::<Position>(&robot()).unwrap();
    let drivers: Vec<_> = (0..16)
        .map(|_| space.publisher::<Position>(&robot()).unwrap())
        .collect();
    assert!(subscriber.receive().unwrap().is_none(), "it knows them now");
    for (source, driver) in (0..).zip(&drivers) {
        let header = Header {
            source,
            ..Header::default()
        };
        let said = Position {
            header,
            ..Position::default()
        };
        driver.send(said).unwrap();
    }
    drop(drivers);
    let mut heard: Vec<_> = std::iter::from_fn(|| subscriber.receive().unwrap())
        .map(|position| position.header.source)
        .collect();
    heard.sort_unstable();
    assert_eq!(heard, (0..16).collect::<Vec<_>>());
}

#[test]
fn who_comes_before_the_space_has_a_key_is_in_nobodys_way() {
    let temporary = tempfile::tempdir().unwrap();
    let root = temporary.path();
    // As somebody does who comes while nobody is alone, and somebody was killed who was to draw the key.
    let waiting = std::fs::File::open(root).unwrap();
    flock(&waiting, FlockOperation::LockShared).unwrap();
    std::thread::scope(|scope| {
        let newcomers: Vec<_> = (0..6).map(|_| scope.spawn(|| open(root))).collect();
        std::thread::sleep(Duration::from_millis(100));
        drop(waiting);
        for newcomer in newcomers {
            newcomer.join().expect("it enters");
        }
    });
}

#[test]
fn whoever_is_stopped_while_he_makes_or_removes_a_service_locks_nobody_out() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let stopped = std::fs::File::open(root.path().join("key")).unwrap();
    flock(&stopped, FlockOperation::LockExclusive).unwrap();
    let publisher = space.publisher::<Estimate>(&robot()).unwrap();
    let newcomer = open(root.path());
    let subscriber = newcomer.subscriber::<Estimate>(&robot()).unwrap();
    publisher.send(Estimate::default()).unwrap();
    assert!(subscriber.receive().unwrap().is_some());
    assert_eq!(space.tidy(), 0, "it waits for nobody");
}

/// How many services the nodes in the space say that they use.
fn tags(root: &Path) -> usize {
    let entries = std::fs::read_dir(root.join("nodes")).expect("a directory");
    let nodes = entries.map(|entry| entry.expect("an entry").path());
    let files = nodes.filter_map(|node| std::fs::read_dir(node).ok());
    let names = files
        .flatten()
        .map(|file| file.expect("an entry").file_name());
    names
        .filter(|name| name.to_string_lossy().ends_with(".service_tag"))
        .count()
}

/// Else the place of who is killed while he leaves would be taken until all have left.
#[test]
fn a_node_says_that_it_uses_a_service_for_as_long_as_it_may_have_a_place_in_it() {
    let root = tempfile::tempdir().unwrap();
    let other = open(root.path());
    let space = open(root.path());
    for _ in 0..2 {
        drop(space.publisher::<Estimate>(&robot()).unwrap());
        assert_eq!(tags(root.path()), 1);
    }
    drop(space);
    assert_eq!(tags(root.path()), 0);
    drop(other);
}
