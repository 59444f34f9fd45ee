//! Few open files: what cannot be opened is refused with that reason, wherever it is missing first.
//!
//! The process with the limit is this test binary again.
use std::path::Path;
use std::process::Command;

use coloc_shm_types::{Estimate, OpenError, RobotName, Space};

const ROOT: &str = "COLOC_TEST_ROOT";

fn robot(name: &str) -> RobotName {
    RobotName::new(name).expect("a name")
}

#[test]
#[ignore = "not a test: the process that the test starts"]
fn the_other_process() {
    let root = std::env::var_os(ROOT).expect("started by a test");
    match enter(Path::new(&root)) {
        Ok(()) => println!("it works"),
        Err(problem) => println!("refused: {problem}"),
    }
}

/// Uses a service that there is, and makes one.
fn enter(root: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let space = Space::open(root, "t", "newcomer")?;
    for name in ["r1", "r2"] {
        let publisher = space.publisher::<Estimate>(&robot(name))?;
        let _subscriber = space.subscriber::<Estimate>(&robot(name))?;
        publisher.send(Estimate::default())?;
    }
    Ok(())
}

/// What it says that may have so many open files.
fn newcomer(root: &Path, files: u32) -> String {
    let output = Command::new("sh")
        .args(["-c", "ulimit -n $0 && exec \"$@\"", &files.to_string()])
        .arg(std::env::current_exe().expect("this binary"))
        .args(["--ignored", "--exact", "the_other_process", "--nocapture"])
        .env(ROOT, root)
        .output()
        .expect("a shell");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn wherever_files_are_missing_first_that_is_the_reason() -> Result<(), OpenError> {
    let root = tempfile::tempdir().expect("a directory");
    let space = Space::open(root.path(), "t", "resident")?;
    let _subscriber = space.subscriber::<Estimate>(&robot("r1")).expect("a port");
    let said: Vec<String> = (6..50).map(|files| newcomer(root.path(), files)).collect();
    for (files, said) in (6..).zip(&said) {
        let advised = said.contains("Too many open files") && said.contains("LimitNOFILE");
        let reason = said.contains("it works") || advised;
        assert!(reason, "{files} files: {said}");
    }
    let works = said.iter().filter(|said| said.contains("it works")).count();
    assert!((1..44).contains(&works), "{said:?}");
    Ok(())
}
