//! Spaces through real shared memory: each test in a root and under a prefix of its own.
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use coloc_shm_types::{
    Estimate, Header, Neighbour, OpenError, PortError, Position, Remark, RobotName, Space, Status,
};

fn open(root: &Path) -> Space {
    Space::open(root, "t", "test").expect("a space of its own")
}

fn robot() -> RobotName {
    RobotName::new("r1").expect("a name")
}

fn estimate(tick: u64) -> Estimate {
    Estimate {
        tick,
        header: Header {
            sequence: tick,
            ..Header::default()
        },
        ..Estimate::default()
    }
}

/// What is left of a space, on disk and in shared memory.
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

#[test]
fn what_is_sent_arrives_in_order() {
    let root = tempfile::tempdir().unwrap();
    let (here, there) = (open(root.path()), open(root.path()));
    let publisher = here.publisher::<Estimate>(&robot()).unwrap();
    let subscriber = there.subscriber::<Estimate>(&robot()).unwrap();
    for tick in 0..10 {
        publisher.send(estimate(tick)).unwrap();
    }
    for tick in 0..10 {
        assert_eq!(subscriber.receive().unwrap(), Some(estimate(tick)));
    }
    assert_eq!(subscriber.receive().unwrap(), None);
}

#[test]
fn a_slow_subscriber_loses_the_oldest_and_holds_nobody_up() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let publisher = space.publisher::<Estimate>(&robot()).unwrap();
    let subscriber = space.subscriber::<Estimate>(&robot()).unwrap();
    for tick in 0..100 {
        publisher.send(estimate(tick)).unwrap();
    }
    assert_eq!(subscriber.receive().unwrap(), Some(estimate(84)));
}

#[test]
fn a_late_joiner_gets_the_last_estimate() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let publisher = space.publisher::<Estimate>(&robot()).unwrap();
    publisher.send(estimate(1)).unwrap();
    publisher.send(estimate(2)).unwrap();
    let late = space.subscriber::<Estimate>(&robot()).unwrap();
    publisher.refresh().unwrap();
    assert_eq!(late.receive().unwrap(), Some(estimate(2)));
    assert_eq!(late.receive().unwrap(), None);
}

#[test]
fn sixty_five_neighbours_fit() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let subscriber = space.subscriber::<Neighbour>(&robot()).unwrap();
    let senders = 0..65_u16;
    let publishers: Vec<_> = senders
        .clone()
        .map(|_| space.publisher::<Neighbour>(&robot()).unwrap())
        .collect();
    for (sender, publisher) in senders.clone().zip(&publishers) {
        publisher
            .send(Neighbour {
                header: Header {
                    source: sender,
                    ..Header::default()
                },
                ..Neighbour::default()
            })
            .unwrap();
    }
    let mut received = Vec::new();
    while let Some(neighbour) = subscriber.receive().unwrap() {
        received.push(neighbour.header.source);
    }
    received.sort_unstable();
    assert_eq!(received, senders.collect::<Vec<_>>());
}

#[test]
fn robots_and_spaces_do_not_hear_one_another() {
    let (root, other_root) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (space, other) = (open(root.path()), open(other_root.path()));
    let publisher = space.publisher::<Position>(&robot()).unwrap();
    let elsewhere = other.subscriber::<Position>(&robot()).unwrap();
    let r2 = space
        .subscriber::<Position>(&RobotName::new("r2").unwrap())
        .unwrap();
    publisher.send(Position::default()).unwrap();
    assert_eq!(elsewhere.receive().unwrap(), None);
    assert_eq!(r2.receive().unwrap(), None);
}

#[test]
fn nothing_is_left_when_the_last_one_goes() {
    let root = tempfile::tempdir().unwrap();
    let (first, last) = (open(root.path()), open(root.path()));
    let prefix = first.full_prefix().to_owned();
    let claim = first.claim_robot(&robot(), 1).unwrap();
    let publisher = first.publisher::<Status>(&robot()).unwrap();
    let subscriber = last.subscriber::<Status>(&robot()).unwrap();
    drop((publisher, claim, first));
    assert!(
        !remains(root.path(), &prefix).is_empty(),
        "the other one is still there"
    );
    drop((last, subscriber));
    assert_eq!(remains(root.path(), &prefix), Vec::<String>::new());
}

#[test]
fn a_port_keeps_its_space_open() {
    let root = tempfile::tempdir().unwrap();
    let publisher = open(root.path()).publisher::<Estimate>(&robot()).unwrap();
    let subscriber = open(root.path()).subscriber::<Estimate>(&robot()).unwrap();
    publisher.send(estimate(7)).unwrap();
    assert_eq!(subscriber.receive().unwrap(), Some(estimate(7)));
}

#[test]
fn a_robot_is_claimed_once() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let claim = space.claim_robot(&robot(), 1).unwrap();
    let refusal = open(root.path()).claim_robot(&robot(), 1).unwrap_err();
    assert!(
        matches!(&refusal, OpenError::AlreadyClaimed { pid: Some(pid), .. } if *pid == std::process::id())
    );
    assert!(
        refusal
            .to_string()
            .contains(&format!("process {}", std::process::id()))
    );
    space
        .claim_robot(&RobotName::new("r2").unwrap(), 2)
        .unwrap();
    drop(claim);
    space.claim_robot(&robot(), 1).unwrap();
}

#[test]
fn a_driver_runs_once_for_each_sensor_and_is_no_robot() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let claim = space.claim_driver(&robot(), "laser", 0).unwrap();
    let refusal = open(root.path()).claim_driver(&robot(), "laser", 0);
    let said = refusal.unwrap_err().to_string();
    let process = format!("already runs as process {}", std::process::id());
    assert!(said.contains(&process), "{said}");
    let other = RobotName::new("r2").unwrap();
    let others = [
        space.claim_driver(&robot(), "laser", 1),
        space.claim_driver(&robot(), "gnss", 0),
        space.claim_driver(&other, "laser", 0),
    ];
    assert!(others.iter().all(Result::is_ok));
    assert_eq!(Space::running(root.path()).unwrap(), []);
    space.claim_robot(&robot(), 0).unwrap();
    drop(claim);
    space.claim_driver(&robot(), "laser", 0).unwrap();
}

#[test]
fn a_directory_with_other_things_in_it_is_refused_and_left_alone() {
    let root = tempfile::tempdir().unwrap();
    let precious = root.path().join("thesis.tex");
    std::fs::write(&precious, "years").unwrap();
    for mode in [0o755, 0o700] {
        std::fs::set_permissions(root.path(), Permissions::from_mode(mode)).unwrap();
        let refusal = Space::open(root.path(), "t", "test").unwrap_err();
        assert!(refusal.to_string().contains("`thesis.tex`"), "{refusal}");
        let now = root.path().metadata().unwrap().permissions().mode() & 0o777;
        assert_eq!(now, mode);
    }
    assert!(precious.exists());
}

#[test]
fn a_robot_is_claimed_once_whatever_becomes_of_the_claims() {
    for put_file in [false, true] {
        let root = tempfile::tempdir().unwrap();
        let space = open(root.path());
        let claim = space.claim_robot(&robot(), 1).unwrap();
        let claims = root.path().join("claims");
        std::fs::remove_dir_all(&claims).unwrap();
        if put_file {
            std::fs::write(&claims, "no directory").unwrap();
        }
        let newcomer = open(root.path());
        let r2 = RobotName::new("r2").unwrap();
        for (robot, id) in [(&robot(), 1), (&robot(), 2), (&r2, 1)] {
            let refusal = newcomer.claim_robot(robot, id).unwrap_err().to_string();
            let process = format!("process {}", std::process::id());
            assert!(refusal.contains(&process), "{refusal}");
        }
        newcomer.claim_robot(&r2, 2).unwrap();
        drop(claim);
        newcomer.claim_robot(&robot(), 1).unwrap();
    }
}

#[test]
fn what_was_put_into_the_place_of_a_directory_locks_nobody_out() {
    for name in ["nodes", "services", "claims"] {
        let root = tempfile::tempdir().unwrap();
        let inside = open(root.path());
        let _publisher = inside.publisher::<Estimate>(&robot()).unwrap();
        let _claim = inside.claim_robot(&robot(), 1).unwrap();
        let (path, elsewhere) = (root.path().join(name), root.path().join("elsewhere"));
        std::fs::rename(&path, &elsewhere).unwrap();
        std::os::unix::fs::symlink(&elsewhere, &path).unwrap();
        for put_file in [false, true] {
            if put_file {
                std::fs::remove_dir_all(&path).unwrap();
                std::fs::write(&path, "no directory").unwrap();
            }
            let newcomer = open(root.path());
            let said = newcomer.remarks();
            assert!(
                matches!(said, [Remark::Restored { path: found }, ..] if *found == path),
                "{said:?}"
            );
            let r2 = RobotName::new("r2").unwrap();
            let publisher = newcomer.publisher::<Estimate>(&r2).unwrap();
            let subscriber = newcomer.subscriber::<Estimate>(&r2).unwrap();
            publisher.send(estimate(1)).unwrap();
            assert_eq!(subscriber.receive().unwrap(), Some(estimate(1)));
            newcomer.claim_robot(&r2, 2).unwrap();
        }
        assert_eq!(inside.check().is_err(), name != "claims");
    }
}

#[test]
fn a_number_is_given_once() {
    let root = tempfile::tempdir().unwrap();
    let space = open(root.path());
    let r2 = RobotName::new("r2").unwrap();
    let claim = space.claim_robot(&robot(), 7).unwrap();
    let refusal = open(root.path()).claim_robot(&r2, 7).unwrap_err();
    assert!(
        matches!(
            &refusal,
            OpenError::SameNumber {
                id: 7,
                pid: Some(_),
                ..
            }
        ),
        "{refusal}"
    );
    let said = refusal.to_string();
    assert!(said.contains("`r1`") && said.contains("`r2`"), "{said}");
    // Who was refused holds nothing back.
    drop(claim);
    space.claim_robot(&r2, 7).unwrap();
    space.claim_robot(&robot(), 8).unwrap();
}

#[test]
fn two_prefixes_in_one_root_are_one_space_to_the_broom() {
    let root = tempfile::tempdir().unwrap();
    let first = Space::open(root.path(), "first", "test").unwrap();
    let publisher = first.publisher::<Estimate>(&robot()).unwrap();
    let subscriber = first.subscriber::<Estimate>(&robot()).unwrap();
    let second = Space::open(root.path(), "second", "test").unwrap();
    let prefix = second.full_prefix().to_owned();
    drop(second.publisher::<Estimate>(&robot()).unwrap());
    drop(second);
    // Whoever leaves deletes nothing of those who stay.
    publisher.send(estimate(1)).unwrap();
    assert_eq!(subscriber.receive().unwrap(), Some(estimate(1)));
    let late = Space::open(root.path(), "first", "test")
        .unwrap()
        .subscriber::<Estimate>(&robot())
        .unwrap();
    publisher.refresh().unwrap();
    assert_eq!(late.receive().unwrap(), Some(estimate(1)));
    let prefixes = [first.full_prefix().to_owned(), prefix];
    drop((late, publisher, subscriber, first));
    for prefix in prefixes {
        assert_eq!(remains(root.path(), &prefix), Vec::<String>::new());
    }
}

#[test]
fn it_is_noticed_when_the_place_is_deleted_or_exchanged() {
    for victim in ["", "nodes", "services", "key"] {
        let temporary = tempfile::tempdir().unwrap();
        let root = temporary.path().join("shm");
        let space = open(&root);
        let _publisher = space.publisher::<Estimate>(&robot()).unwrap();
        let moved = temporary.path().join("moved");
        let path = if victim.is_empty() {
            root
        } else {
            root.join(victim)
        };
        std::fs::rename(&path, &moved).unwrap();
        let lost = space.check().unwrap_err();
        assert_eq!(lost.0, path);
        // Also if there is another one, as a newcomer would make it.
        if victim != "key" {
            std::fs::create_dir(&path).unwrap();
            assert!(space.check().is_err());
        }
    }
}

#[test]
fn who_enters_an_exchanged_root_harms_nobody_in_the_old_one() {
    let temporary = tempfile::tempdir().unwrap();
    let root = temporary.path().join("shm");
    let old = open(&root);
    let claim = old.claim_robot(&robot(), 1).unwrap();
    let publisher = old.publisher::<Estimate>(&robot()).unwrap();
    let subscriber = old.subscriber::<Estimate>(&robot()).unwrap();
    std::fs::rename(&root, temporary.path().join("moved")).unwrap();
    let new = open(&root);
    let count = || remains(&root, new.full_prefix()).len();
    let before = count();
    // Cleaning up, sending, receiving and joining all still work for those inside.
    publisher.send(estimate(1)).unwrap();
    assert_eq!(subscriber.receive().unwrap(), Some(estimate(1)));
    for (robot, id) in [("r1", 2), ("r2", 1)] {
        let refusal = new
            .claim_robot(&RobotName::new(robot).unwrap(), id)
            .unwrap_err();
        assert!(
            refusal
                .to_string()
                .contains(&std::process::id().to_string()),
            "{refusal}"
        );
    }
    new.claim_robot(&RobotName::new("r3").unwrap(), 3).unwrap();
    assert!(count() >= before);
    let prefix = new.full_prefix().to_owned();
    drop((claim, publisher, subscriber, old));
    new.claim_robot(&robot(), 1).unwrap();
    drop(new);
    drop(open(&root));
    assert_eq!(remains(&root, &prefix), Vec::<String>::new());
}

#[test]
fn who_acts_for_a_robot_is_seen_from_outside_and_who_has_ended_is_not() {
    let directory = tempfile::tempdir().expect("a directory");
    let root = directory.path().join("shm");
    let running = || Space::running(&root).expect("our own place");
    assert_eq!(running(), []);
    Space::join(&root, "t", "test").expect_err("nobody is there to hear");
    assert!(!root.exists());
    let space = open(&root);
    Space::join(&root, "t", "test").expect("what is there");
    assert_eq!(running(), []);
    let claim = space.claim_robot(&robot(), 4).expect("its claim");
    let [only] = &running()[..] else {
        panic!("{:?}", running());
    };
    assert_eq!(only.robot, robot());
    assert_eq!(only.who, Some((4, std::process::id())));
    assert!(only.since.is_some());
    assert!(Space::places().contains(&(root.clone(), "t".into())));
    drop(claim);
    assert_eq!(running(), []);
    // Whoever looks leaves the name free.
    space.claim_robot(&robot(), 4).expect("its claim");
}

#[test]
fn an_existing_channel_is_heard_and_none_is_made() {
    let directory = tempfile::tempdir().expect("a directory");
    let space = open(&directory.path().join("shm"));
    let refusal = space
        .existing::<Estimate>(&robot())
        .expect_err("no channel");
    assert!(matches!(refusal, PortError::NoChannel { .. }), "{refusal}");
    let again = space.existing::<Estimate>(&robot()).expect_err("none yet");
    assert!(matches!(again, PortError::NoChannel { .. }), "{again}");
    let publisher = space.publisher(&robot()).expect("a publisher");
    let subscriber = space.existing(&robot()).expect("a subscriber");
    publisher.send(estimate(3)).expect("a listener");
    let heard: Option<Estimate> = subscriber.receive().expect("no trouble");
    assert_eq!(heard.map(|estimate| estimate.tick), Some(3));
}
