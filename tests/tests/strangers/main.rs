//! Another user of the machine tries to read, change, take the place of, lock and stop what is ours.
//!
//! The other user is a real one, number 65534: this binary again, in the part of [`stranger`]. That takes the superuser's
//! rights; elsewhere a line says that the tests were left out.
#![allow(clippy::unwrap_used, reason = "a test")]

mod group;
mod outputs;
mod shut;
mod stage;
mod stranger;

use std::fs;
use std::os::unix::fs::{MetadataExt, symlink};
use std::path::Path;

use coloc_drivers::can::{Bus, BusSpec, BusState, Filter, Sender};
use coloc_shm_types::private::NotPrivate;
use coloc_shm_types::{OpenError, Space};

use stage::{Daemon, Stage, chmod};

/// Modes of a directory that is there already; 0 for none.
const MODES: [u32; 4] = [0, 0o700, 0o755, 0o777];
const UMASKS: [&str; 3] = ["000", "022", "077"];

#[test]
#[ignore = "not a test: the other user, whom the tests start"]
fn the_stranger() {
    stranger::act();
}

#[test]
fn whatever_the_umask_and_the_modes_nobody_else_gets_in() {
    let Some(stage) = Stage::new() else { return };
    for (umask, mode) in UMASKS
        .iter()
        .flat_map(|umask| MODES.map(|mode| (umask, mode)))
    {
        let site = stage.site(mode);
        let daemon = Daemon::start(&site, umask);
        daemon.listen();
        let listeners = fs::read_dir(site.join("bus")).unwrap();
        let socket = listeners.map(|entry| entry.unwrap().path()).next().unwrap();
        let done = stage.stranger("everything", &[&site, &socket]);
        assert_eq!(done, "", "umask {umask}, mode {mode:o}");
        daemon.listen();
        daemon.terminate();
        for directory in ["shm", "bus"] {
            assert_eq!(fs::read_dir(site.join(directory)).unwrap().count(), 0);
        }
    }
}

#[test]
fn a_root_that_a_stranger_made_is_refused_and_left_alone() {
    let Some(stage) = Stage::new() else { return };
    let root = stage.path("shm");
    stage.stranger("precreate", &[&root]);
    let refusal = Space::open(&root, "t", "test").unwrap_err();
    assert!(
        matches!(
            refusal,
            OpenError::NotPrivate(NotPrivate::WrongUser { owner: 65534, .. })
        ),
        "{refusal}"
    );
    assert!(root.join("services").exists());
    // Had it been used, he could have done what he likes.
    let done = stage.stranger("everything", &[stage.path("").as_path(), &root]);
    assert!(
        done.contains("plant a file in") && done.contains("lock"),
        "{done}"
    );
}

#[test]
fn a_link_that_a_stranger_put_in_the_place_of_the_root_leads_nowhere() {
    let Some(stage) = Stage::new() else { return };
    let (root, precious) = (stage.path("shm"), precious(&stage));
    stage.stranger("link", &[&precious, &root]);
    let refusal = Space::open(&root, "t", "test").unwrap_err();
    assert!(
        matches!(
            refusal,
            OpenError::NotPrivate(NotPrivate::StrangersLink { owner: 65534, .. })
        ),
        "{refusal}"
    );
    assert!(precious.join("services/thesis.tex").exists());
}

#[test]
fn what_a_stranger_planted_in_an_open_root_of_ours_is_not_used() {
    let Some(stage) = Stage::new() else { return };
    for name in ["services", "nodes", "claims", "key"] {
        for act in ["link", "precreate"] {
            let site = stage.site(0o777);
            let (precious, place) = (precious(&stage), site.join("shm").join(name));
            match act {
                "link" => stage.stranger(act, &[&precious, &place]),
                _ => stage.stranger(act, &[&place]),
            };
            let refusal = Space::open(&site.join("shm"), "t", "test").unwrap_err();
            assert!(
                matches!(&refusal, OpenError::NotPrivate(NotPrivate::Foreign { entry, .. }) if entry == name),
                "{act} {name}: {refusal}"
            );
            assert!(precious.join("services/thesis.tex").exists());
        }
    }
}

/// Something of ours that would be swept if it was taken for a space.
fn precious(stage: &Stage) -> std::path::PathBuf {
    let precious = stage.path("precious");
    fs::create_dir_all(precious.join("services")).unwrap();
    fs::write(precious.join("services/thesis.tex"), "years").unwrap();
    precious
}

#[test]
fn a_strangers_lock_is_not_waited_for_without_end() {
    let Some(stage) = Stage::new() else { return };
    let root = stage.site(0o755).join("shm");
    let stranger = stage.stranger_stays("lock", &[&root]);
    let refusal = Space::open(&root, "t", "test").unwrap_err();
    assert!(
        matches!(&refusal, OpenError::Locked { processes, .. } if *processes == [stranger.id()]),
        "{refusal}"
    );
    drop(stranger);
    Space::open(&root, "t", "test").unwrap();
    // Now it is closed, and cannot be locked again.
    assert!(
        stage
            .stranger("try-lock", &[&root])
            .contains("Permission denied")
    );
}

#[test]
fn names_in_shared_memory_cannot_be_taken_first() {
    let Some(stage) = Stage::new() else { return };
    let root = stage.path("shm");
    let family = Space::open(&root, "t", "test")
        .unwrap()
        .full_prefix()
        .to_owned();
    let names: Vec<_> = ["node.0_9_3.global_mgmt", "lock", ".lock", "_.lock"]
        .iter()
        .map(|name| Path::new("/dev/shm").join(format!("{family}{name}")))
        .collect();
    let paths: Vec<_> = names.iter().map(|path| &**path).collect();
    stage.stranger("write", &paths);
    let space = Space::open(&root, "t", "test").unwrap();
    space.check().unwrap();
    drop(space);
    for path in &names {
        assert_eq!(path.metadata().unwrap().uid(), 65534);
        fs::remove_file(path).unwrap();
    }
}

#[test]
fn a_bus_that_a_stranger_made_is_neither_heard_nor_spoken_to() {
    let Some(stage) = Stage::new() else { return };
    let directory = stage.path("bus");
    stage.stranger("precreate", &[&directory]);
    let spec = BusSpec::Local {
        directory: directory.clone(),
    };
    for refusal in [
        Bus::open(&spec, 0, Filter::All)
            .err()
            .map(|it| it.to_string()),
        Sender::open(&spec).err().map(|it| it.to_string()),
    ] {
        let refusal = refusal.unwrap();
        assert!(refusal.contains("belongs to user 65534"), "{refusal}");
    }
}

#[test]
fn a_lost_bus_does_not_come_back_as_a_strangers() {
    let Some(stage) = Stage::new() else { return };
    let directory = stage.path("bus");
    let spec = BusSpec::Local {
        directory: directory.clone(),
    };
    let mut bus = Bus::open(&spec, 0, Filter::All).unwrap();
    fs::remove_dir_all(&directory).unwrap();
    stage.stranger("precreate", &[&directory]);
    let seconds = |bus: &mut Bus, from: i64| {
        (from * 1000..(from + 2) * 1000).for_each(|ms| bus.supervise(ms * 1_000_000));
        bus.health().state
    };
    assert_eq!(seconds(&mut bus, 1), BusState::Gone);
    fs::remove_dir_all(&directory).unwrap();
    fs::create_dir(&directory).unwrap();
    assert_eq!(seconds(&mut bus, 3), BusState::Up);
    assert_eq!(directory.metadata().unwrap().mode() & 0o777, 0o700);
}

/// An administrator may lay the root elsewhere.
#[test]
fn an_own_link_to_the_root_works() {
    let Some(stage) = Stage::new() else { return };
    let (root, link) = (stage.path("shm"), stage.path("link"));
    fs::create_dir(&root).unwrap();
    chmod(&root, 0o700);
    symlink(&root, &link).unwrap();
    let (here, there) = (
        Space::open(&root, "t", "test").unwrap(),
        Space::open(&link, "t", "test").unwrap(),
    );
    assert_eq!(here.full_prefix(), there.full_prefix());
}
