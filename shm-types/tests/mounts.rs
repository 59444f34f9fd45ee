//! `/dev/shm` or `/proc` are not as they should be: whoever opens a space says what to do.
//!
//! The test is this binary again in a mount namespace, where it can mount what it likes.
use std::process::Command;

use coloc_shm_types::{Remark, Space};

#[test]
#[ignore = "not a test: the process that the tests start"]
fn the_other_process() {
    let root = tempfile::tempdir().expect("a directory");
    match Space::open(root.path(), "t", "test") {
        Ok(space) => (space.remarks().iter())
            .filter(|remark| matches!(remark, Remark::Loose { .. }))
            .for_each(|remark| println!("warned: {remark}")),
        Err(refusal) => println!("refused: {refusal}"),
    }
}

/// What is said where this was mounted; `None` if that is not allowed here.
fn said_after(mount: &str) -> Option<String> {
    let script = format!("mount -t tmpfs {mount} || exit; exec \"$0\" \"$@\"");
    let output = Command::new("unshare")
        .args(["--user", "--map-root-user", "--mount", "sh", "-c", &script])
        .arg(std::env::current_exe().expect("this binary"))
        .args(["--ignored", "--exact", "the_other_process", "--nocapture"])
        .output()
        .ok()?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if !said.contains("running 1 test") {
        println!("SKIPPED: {mount}: no mount namespace can be made here");
        return None;
    }
    assert!(said.contains("1 passed"), "{output:?}");
    Some(said)
}

#[test]
fn where_others_may_delete_everything_the_remedy_is_said() {
    for mode in ["0777", "0775", "0757"] {
        let mount = format!("-o mode={mode} tmpfs /dev/shm");
        let Some(said) = said_after(&mount) else {
            return;
        };
        let line = format!("(mode {mode}, without the sticky bit)");
        assert!(said.contains(&line), "{said}");
        assert!(said.contains("(chmod 1777 /dev/shm)"), "{said}");
    }
}

#[test]
fn where_it_is_closed_or_sticky_nothing_is_said() {
    for mode in ["1777", "0755", "1773"] {
        let mount = format!("-o mode={mode} tmpfs /dev/shm");
        let Some(said) = said_after(&mount) else {
            return;
        };
        let quiet = !said.contains("warned") && !said.contains("refused");
        assert!(quiet, "{said}");
    }
}

#[test]
fn what_is_not_mounted_is_named_with_the_remedy() {
    let cases = [
        ("tmpfs /dev", "(mount -t tmpfs -o mode=1777 tmpfs /dev/shm)"),
        ("tmpfs /proc", "(mount -t proc proc /proc)"),
    ];
    for (mount, remedy) in cases {
        let Some(said) = said_after(mount) else {
            return;
        };
        let refused = said.contains("refused: ") && said.contains("is not mounted");
        assert!(refused && said.contains(remedy), "{said}");
    }
}
