//! The examples, as a person runs them: what goes wrong is a sentence and a status, never a panic and nobody's `Debug`.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, Message, Odometry, OdometryKind, Position, RobotName, Space};

const ALL: [&str; 3] = ["watch_estimates", "feed_fixes", "drive_base"];
const ROBOT: &str = "robot1";
const PREFIX: &str = "examples";
const PATIENCE: Duration = Duration::from_secs(20);

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
    assert_ends(1, name, &run(name, arguments), words);
}

/// Likewise, with status 2.
fn assert_misunderstood(name: &str, arguments: &[&str], words: &str) {
    assert_ends(2, name, &run(name, arguments), words);
}

fn assert_ends(status: i32, name: &str, output: &Output, words: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{name}: {said}");
    assert!(
        said.starts_with(&format!("{name}: ")) && said.contains(words) && said.lines().count() == 1,
        "{name}: {said}"
    );
}

#[test]
fn what_goes_wrong_is_a_sentence() {
    let home = tempfile::tempdir().unwrap();
    let root = home.path().join("shm");
    let root = root.to_str().unwrap();
    assert_misunderstood("watch_estimates", &[], "usage: watch_estimates <robot>");
    assert_refused("watch_estimates", &["a robot", root, PREFIX], "a robot");
    assert_refused("watch_estimates", &[ROBOT, root, "a prefix"], "use 1 to 16");
    assert_refused(
        "watch_estimates",
        &[ROBOT, "/proc/self/shm", PREFIX],
        "cannot make",
    );
    assert_misunderstood("feed_fixes", &[ROBOT], "usage: feed_fixes <robot>");
    for metres in ["one", "NaN", "inf"] {
        let words = format!("`{metres}` is no number of metres");
        assert_misunderstood("feed_fixes", &[ROBOT, metres, "2", root, PREFIX], &words);
    }
    let words = "`fast` is no number";
    assert_misunderstood("drive_base", &[ROBOT, "fast", "0", root, PREFIX], words);
    for name in ["feed_fixes", "drive_base"] {
        assert_refused(
            name,
            &[ROBOT, "1", "2", "relative", PREFIX],
            "absolute path",
        );
    }
}

#[test]
fn help_is_an_answer() {
    for name in ALL {
        for option in ["-h", "--help"] {
            let output = run(name, &[option]);
            let said = String::from_utf8(output.stdout).unwrap();
            assert_eq!(output.status.code(), Some(0), "{name} {option}: {said}");
            assert!(
                said.starts_with(&format!("usage: {name} <robot>")),
                "{said}"
            );
        }
        let help = || {
            let mut command = Command::new(example(name));
            command.arg("--help");
            command
        };
        let ended = help()
            .stdout(full())
            .stderr(Stdio::piped())
            .output()
            .unwrap();
        assert_ends(1, name, &ended, NO_SPACE);
    }
}

#[test]
fn what_is_not_utf_8_is_not_understood() {
    for name in ALL {
        let mut command = Command::new(example(name));
        let output = command
            .arg(OsStr::from_bytes(b"robot\xff"))
            .output()
            .unwrap();
        assert_ends(2, name, &output, "` is not UTF-8");
    }
}

#[test]
fn who_listens_where_nobody_will_speak_any_more_ends() {
    let home = tempfile::tempdir().unwrap();
    let space = Space::open(home.path(), PREFIX, "robot").unwrap();
    let robot = RobotName::new(ROBOT).unwrap();
    let estimates = space.publisher::<Estimate>(&robot).unwrap();
    let lines = tempfile::tempfile().unwrap();
    let watching = Command::new(example("watch_estimates"))
        .args([ROBOT, home.path().to_str().unwrap(), PREFIX])
        .stdout(lines.try_clone().unwrap())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for(|| {
        estimates.send(Estimate::default()).unwrap();
        lines.metadata().unwrap().len() > 0
    });
    take_away(home.path());
    assert_ends(1, "watch_estimates", &end(watching), TAKEN_AWAY);
}

#[test]
fn who_speaks_where_nobody_will_listen_any_more_ends() {
    let is_fix = |fix: Position| matches!(fix.position, [1.0, 2.0]);
    assert_speaks_until_taken_away("feed_fixes", is_fix);
    let is_way = |way: Odometry| {
        way.kind() == Ok(OdometryKind::Twist) && matches!(way.values, [1.0, 0.0, 2.0, 0.0])
    };
    assert_speaks_until_taken_away("drive_base", is_way);
}

fn assert_speaks_until_taken_away<M: Message>(name: &str, is_said: impl Fn(M) -> bool) {
    let home = tempfile::tempdir().unwrap();
    let space = Space::open(home.path(), PREFIX, "robot").unwrap();
    let robot = RobotName::new(ROBOT).unwrap();
    let heard = space.subscriber::<M>(&robot).unwrap();
    let speaking = Command::new(example(name))
        .args([ROBOT, "1", "2", home.path().to_str().unwrap(), PREFIX])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for(|| heard.receive().unwrap().is_some_and(&is_said));
    take_away(home.path());
    assert_ends(1, name, &end(speaking), TAKEN_AWAY);
}

#[test]
fn who_listens_to_nobody_says_so() {
    let home = tempfile::tempdir().unwrap();
    let mut watching = Command::new(example("watch_estimates"))
        .args([ROBOT, home.path().to_str().unwrap(), PREFIX])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    let mut stderr = BufReader::new(watching.stderr.take().unwrap());
    stderr.read_line(&mut said).unwrap();
    watching.kill().unwrap();
    watching.wait().unwrap();
    assert!(said.contains("robot1 is silent so far"), "{said}");
}

const TAKEN_AWAY: &str = "was deleted or exchanged";

fn take_away(root: &Path) {
    for entry in std::fs::read_dir(root).unwrap().map(Result::unwrap) {
        if entry.file_type().unwrap().is_dir() {
            std::fs::remove_dir_all(entry.path()).unwrap();
        }
    }
}

fn wait_for(mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !done() {
        assert!(Instant::now() < deadline);
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// What became of a process that ends by itself.
fn end(mut child: Child) -> Output {
    let deadline = Instant::now() + PATIENCE;
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > deadline {
            child.kill().unwrap();
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
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

    assert_ends(1, "watch_estimates", &watch(full().into()), NO_SPACE);
}

/// It would be a signal that ends the program.
#[test]
fn a_limit_on_the_size_of_files_is_like_a_full_disk() {
    let script = "ulimit -f 0 && exec \"$0\" --help";
    for name in ALL {
        let mut command = Command::new("sh");
        command.args(["-c", script]).arg(example(name));
        let file = tempfile::tempfile().unwrap();
        let ended = command
            .stdout(file)
            .stderr(Stdio::piped())
            .output()
            .unwrap();
        assert_ends(
            1,
            name,
            &ended,
            "cannot write to standard output: File too large",
        );
    }
}

const NO_SPACE: &str = "cannot write to standard output: No space left on device";

fn full() -> std::fs::File {
    std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap()
}
