//! Directories of ours that a mistake or a umask has shut to ourselves: the superuser would not notice, so another user
//! is us.
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use coloc_drivers::can::{Bus, BusSpec, Filter};
use coloc_shm_types::Space;
use coloc_shm_types::private::PrivateDirectory;
use rustix::fs::Mode;

use super::stage::{Stage, chmod};

/// Its owner cannot list, enter or write to it.
const SHUT: [u32; 5] = [0, 0o100, 0o200, 0o400, 0o077];

/// With a directory in it as a killed process may have left it.
fn shut(home: &Path, name: &str, mode: u32) -> PathBuf {
    let directory = home.join(format!("{name}{mode:o}"));
    fs::create_dir_all(directory.join("nodes/1")).unwrap();
    for inner in ["nodes/1", "nodes", ""] {
        chmod(&directory.join(inner), mode);
    }
    directory
}

pub(crate) fn open_all(home: &Path) {
    for mode in SHUT {
        let root = shut(home, "root", mode);
        match Space::open(&root, "strangers", "test") {
            Ok(_) => println!("did: {:o}", root.metadata().unwrap().mode() & 0o7777),
            Err(refusal) => println!("did: {mode:o}: {refusal}"),
        }
        let directory = home.join(format!("bus{mode:o}"));
        fs::create_dir(&directory).unwrap();
        chmod(&directory, mode);
        if let Err(refusal) = Bus::open(&BusSpec::Local { directory }, 0, Filter::All) {
            println!("did: {mode:o}: {refusal}");
        }
    }
}

pub(crate) fn make_under_a_umask(home: &Path) {
    for mask in [0o777, 0o277, 0o477] {
        rustix::process::umask(Mode::from_raw_mode(mask));
        match PrivateDirectory::make(&home.join(format!("{mask:o}/below")), |_| true) {
            Ok(made) => println!("did: {:o}", made.path().metadata().unwrap().mode() & 0o7777),
            Err(refusal) => println!("did: {mask:o}: {refusal}"),
        }
    }
}

#[test]
fn a_directory_that_is_shut_to_its_owner_is_opened_to_him_and_nobody_else() {
    let Some(stage) = Stage::new() else { return };
    let done = stage.stranger("open what is shut", &[&stage.home()]);
    assert_eq!(done, ["700"; SHUT.len()].join("\n"));
}

#[test]
fn what_is_made_under_a_umask_that_shuts_everybody_out_is_open_to_its_owner() {
    let Some(stage) = Stage::new() else { return };
    let done = stage.stranger("make under a umask", &[&stage.home()]);
    assert_eq!(done, ["700"; 3].join("\n"));
}

#[test]
fn a_daemon_under_such_a_umask_runs_and_is_not_in_the_way_of_the_next() {
    let Some(stage) = Stage::new() else { return };
    let home = stage.home();
    for umask in ["0777", "0277"] {
        let daemon = stage.strangers_daemon(&home, umask);
        daemon.wait_until_it_says("running");
        daemon.terminate();
    }
}
