//! `coloc list` and `coloc listen` of another user, who is in the group or not.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;

use tempfile::TempDir;

use crate::program::{Coloc, Ended};
use crate::robot::{Ground, Robot};

const GROUP: u32 = 60010;
/// User and group.
const MEMBER: (u32, u32) = (60001, GROUP);
const OUTSIDER: (u32, u32) = (60003, 60011);

/// The program where everybody may run it.
struct Stage {
    directory: TempDir,
    ground: Ground,
}

impl Stage {
    fn new() -> Option<Self> {
        if !rustix::process::geteuid().is_root() {
            eprintln!(
                "SKIPPED: what another user of a group hears, which only the superuser can try"
            );
            return None;
        }
        let directory = tempfile::tempdir().unwrap();
        open_up(&directory.path().to_owned());
        let stage = Self {
            directory,
            ground: Ground::new(),
        };
        fs::copy(env!("CARGO_BIN_EXE_coloc"), stage.program()).unwrap();
        open_up(&stage.program());
        Some(stage)
    }

    fn program(&self) -> PathBuf {
        self.directory.path().join("coloc")
    }

    fn coloc(&self, user: (u32, u32), words: &str) -> Coloc {
        Coloc::start_as(&self.program(), user, words, &self.ground.root())
    }
}

fn open_up(path: &PathBuf) {
    fs::set_permissions(path, PermissionsExt::from_mode(0o755)).unwrap();
}

fn robot(ground: &Ground) -> Robot {
    Robot::start_for(ground, "r1", 7, GROUP)
}

/// The only thing that was said.
fn sentence(ended: &Ended) -> &str {
    let [said] = ended.said.as_slice() else {
        panic!("{ended:?}");
    };
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(1), 0),
        "{ended:?}"
    );
    said
}

#[test]
fn a_member_sees_and_hears_it_and_leaves_no_trace() {
    let Some(stage) = Stage::new() else { return };
    let mut robot = robot(&stage.ground);
    let before = stage.ground.trace();
    let ended = stage.coloc(MEMBER, "list").end(|| robot.say());
    let [_, line] = ended.printed.as_slice() else {
        panic!("{ended:?}");
    };
    let words: Vec<&str> = line.split_whitespace().collect();
    let process = std::process::id().to_string();
    assert_eq!(words[..3], ["r1", "7", &process], "{line}");
    assert_eq!(words[8..], ["-1.250", "90.0"], "{line}");
    assert_eq!((ended.status, ended.said.len()), (Some(0), 0), "{ended:?}");

    let listen = stage.coloc(MEMBER, "listen r1 --tum --count 20");
    let ended = listen.end(|| robot.say());
    assert_eq!(
        (ended.status, ended.printed.len()),
        (Some(0), 20),
        "{ended:?}"
    );
    assert_eq!(stage.ground.trace(), before);
}

#[test]
fn a_member_hears_it_when_it_comes_back() {
    let Some(stage) = Stage::new() else { return };
    let mut first = robot(&stage.ground);
    let mut listen = stage.coloc(MEMBER, "listen r1 --tum");
    listen.wait(|| first.say(), |printed, _| !printed.is_empty());
    drop(first);
    listen.wait_until_it_says("does not run any more, waiting for it", || {});
    let mut second = robot(&stage.ground);
    listen.wait_until_it_says("again", || second.say());
    listen.signal("INT");
    assert_eq!(listen.end(|| second.say()).status, Some(130));
}

#[test]
fn an_outsider_is_told_what_to_do() {
    let Some(stage) = Stage::new() else { return };
    let mut robot = robot(&stage.ground);
    for words in ["list", "listen r1"] {
        let ended = stage.coloc(OUTSIDER, words).end(|| robot.say());
        let expected = "coloc: user 60003 may not read r1, the group 60010 may: as the superuser add that user to it \
                        (usermod -aG 60010 USER), then log in again";
        assert_eq!(sentence(&ended), expected);
    }
}

#[test]
fn where_nothing_is_open_it_is_said_what_would_open_it() {
    let Some(stage) = Stage::new() else { return };
    let mut robot = Robot::start(&stage.ground, "r1", 7);
    for words in ["list", "listen r1", "pose r1 1 2 0"] {
        let ended = stage.coloc(MEMBER, words).end(|| robot.say());
        let said = sentence(&ended);
        assert!(
            said.contains("belongs to user 0, who lets no other user read there"),
            "{said}"
        );
        assert!(said.contains("`group` in [shm]"), "{said}");
    }
}

/// Reading is all that it may.
#[test]
fn a_member_cannot_tell_it_where_it_is() {
    let Some(stage) = Stage::new() else { return };
    let mut robot = robot(&stage.ground);
    let ended = stage.coloc(MEMBER, "pose r1 1 2 0").end(|| robot.say());
    let said = sentence(&ended);
    assert!(
        said.contains("run everything on the robot as the same user")
            || said.contains("Permission denied"),
        "{said}"
    );
}
