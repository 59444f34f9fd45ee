//! The examples, as a person runs them: what goes wrong is a sentence and a status, never a panic and nobody's `Debug`.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use coloc_shm_types::{Estimate, RobotName, Space};

const ROBOT: &str = "robot1";
const PREFIX: &str = "examples";

/// Where cargo has put the example of that name.
fn example(name: &str) -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(build);
    Box::leak(folder.join(name).into_boxed_path())
}

/// Builds them: who asked for this test alone has no examples yet.
fn build() -> PathBuf {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["build", "--locked", "--offline", "--examples"])
        .args(["--message-format", "json"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let messages = String::from_utf8(output.stdout).unwrap();
    let (_, rest) = messages.rsplit_once("\"executable\":\"").unwrap();
    let path = Path::new(rest.split('"').next().unwrap());
    path.parent().unwrap().to_owned()
}

fn run(name: &str, arguments: &[&str]) -> Output {
    Command::new(example(name))
        .args(arguments)
        .output()
        .unwrap()
}

/// Status 1, and one sentence with these words that begins with the program's name.
fn assert_refused(name: &str, arguments: &[&str], words: &str) {
    let output = run(name, arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(
        output.status.code(),
        Some(1),
        "{name} {arguments:?}: {said}"
    );
    assert!(
        said.starts_with(&format!("{name}: ")) && said.contains(words) && said.lines().count() == 1,
        "{name} {arguments:?}: {said}"
    );
}

#[test]
fn what_goes_wrong_is_a_sentence() {
    let home = tempfile::tempdir().unwrap();
    let root = home.path().join("shm");
    let root = root.to_str().unwrap();
    assert_refused("watch_estimates", &[], "usage: watch_estimates <robot>");
    assert_refused("watch_estimates", &["a robot", root, PREFIX], "a robot");
    assert_refused("watch_estimates", &[ROBOT, root, "a prefix"], "use 1 to 16");
    assert_refused(
        "watch_estimates",
        &[ROBOT, "/proc/self/shm", PREFIX],
        "cannot make",
    );
    assert_refused("feed_fixes", &[ROBOT], "usage: feed_fixes <robot>");
    for metres in ["one", "NaN", "inf"] {
        let words = format!("`{metres}` is no number of metres");
        assert_refused("feed_fixes", &[ROBOT, metres, "2", root, PREFIX], &words);
    }
    assert_refused(
        "feed_fixes",
        &[ROBOT, "1", "2", "relative", PREFIX],
        "absolute path",
    );
}

/// Watches a robot that speaks, with that standard output.
fn watch(stdout: Stdio) -> Output {
    let home = tempfile::tempdir().unwrap();
    let space = Space::open(home.path(), PREFIX, "robot").unwrap();
    let robot = RobotName::new(ROBOT).unwrap();
    let estimates = space.publisher::<Estimate>(&robot).unwrap();
    let mut watching = Command::new(example("watch_estimates"))
        .args([ROBOT, home.path().to_str().unwrap(), PREFIX])
        .stdout(stdout)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while watching.try_wait().unwrap().is_none() {
        estimates.send(Estimate::default()).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    watching.wait_with_output().unwrap()
}

#[test]
fn who_watches_ends_when_nobody_reads_and_says_so_when_nothing_fits() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let ended = watch(writer.into());
    assert_eq!(
        (ended.status.code(), ended.stderr.len()),
        (Some(0), 0),
        "{ended:?}"
    );

    let full = std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let ended = watch(full.into());
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(
        said.starts_with("watch_estimates: No space left on device"),
        "{said}"
    );
}
