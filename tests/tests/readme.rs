//! What the README and ARCHITECTURE.md say is so: files they point to exist, and every block of code is run. Lines that
//! start `coloc` are run by `cli/tests/readme.rs`, which can.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const DOCUMENTS: [&str; 2] = ["README.md", "ARCHITECTURE.md"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_owned()
}

fn read(document: &str) -> String {
    std::fs::read_to_string(root().join(document)).unwrap()
}

/// The targets of `[text](target)` that are files of this repository.
fn links(document: &str) -> impl Iterator<Item = &str> {
    document
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(target, _)| target)
        .filter(|target| !target.starts_with("http"))
}

#[test]
fn every_file_that_is_linked_exists() {
    for name in DOCUMENTS {
        let document = read(name);
        let missing: Vec<&str> = links(&document)
            .filter(|target| !root().join(target).exists())
            .collect();
        assert!(
            links(&document).count() > 5 && missing.is_empty(),
            "{name}: {missing:?}"
        );
    }
}

/// The contents of the blocks of code in `language`.
fn blocks(language: &str) -> Vec<String> {
    let readme = read("README.md");
    let begin = format!("```{language}\n");
    let blocks = readme.split(&begin).skip(1);
    blocks
        .map(|rest| rest.split_once("```").unwrap().0.to_owned())
        .collect()
}

#[test]
fn every_block_has_a_language_that_is_run_here() {
    let known: usize = ["rust", "toml", "sh"]
        .map(|language| blocks(language).len())
        .iter()
        .sum();
    assert_eq!(read("README.md").matches("```").count(), 2 * known);
    assert_eq!(blocks("rust").len(), 1);
    assert_eq!(blocks("toml").len(), 1);
}

/// Lines that are not run, each with the reason.
const LEFT_OUT: [(&str, &str); 10] = [
    ("tests/run", "runs this test"),
    ("cargo build --release", "this test is built already"),
    (
        "cargo install --locked --path cli",
        "the same build, and writes to the user's home",
    ),
    (
        "target/release/colocd run robot.toml",
        "run below, with its listener",
    ),
    (
        "cargo run --release -p coloc-tests --bin endurance",
        "minutes; a step of tests/run",
    ),
    (
        "cargo run -p coloc-tests --bin chaos",
        "minutes, and holds itself to its bars",
    ),
    (
        "cargo run --release -p coloc-tests --bin fuzz",
        "minutes; tests/tests/fuzz.rs plays a moment of it",
    ),
    (
        "cargo run --release -p coloc-tests --bin wakeups",
        "minutes; a step of tests/run",
    ),
    (
        "cargo run --release -p coloc-benches --bin wake_up",
        "figures of one machine",
    ),
    ("tests/hil/run", "a step of tests/run"),
];

#[test]
fn every_command_is_run_or_left_out_for_a_reason() {
    for line in blocks("sh").iter().flat_map(|block| block.lines()) {
        let command = line.split('#').next().unwrap().trim();
        if command == "target/release/colocd check robot.toml" {
            check_the_configuration();
        } else {
            let elsewhere = command.starts_with("cargo run --release --bin coloc -- ")
                || command.starts_with("target/release/coloc ");
            let left_out = LEFT_OUT.iter().any(|(known, _)| *known == command);
            assert!(
                elsewhere || left_out || command.is_empty(),
                "nobody runs `{command}`"
            );
        }
    }
}

fn check_the_configuration() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.toml");
    std::fs::write(&file, &blocks("toml")[0]).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_colocd-under-test"))
        .arg("check")
        .arg(&file)
        .env("XDG_RUNTIME_DIR", directory.path())
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(
        said.contains("robot1 (number 1)") && said.contains("socketcan:can0"),
        "{said}"
    );
}

/// `/run` and `/dev/shm` are the script's own, so that the default place is nobody else's, whoever runs this.
const LISTEN: &str = r#"
mount -t tmpfs tmpfs /run && mount -t tmpfs tmpfs /dev/shm || exit 9
"$1" run "$2" >&2 &
timeout 60 "$3" | head -n 3
kill $!
wait $!
"#;

/// Whoever takes the place away in which both are.
const TAKE_AWAY: &str = r#"
mount -t tmpfs tmpfs /run && mount -t tmpfs tmpfs /dev/shm || exit 9
"$1" run "$2" >&2 &
timeout 60 "$3" | { head -n 1; rm -r /run/coloc; cat >/dev/null; }
wait $!
"#;

#[test]
fn the_listener_ends_where_it_would_hear_nobody() {
    let Some(output) = run_privately(TAKE_AWAY) else {
        println!(
            "SKIPPED: the README's listener in a place that is deleted: `unshare --map-root-user --mount` is not allowed here"
        );
        return;
    };
    let said = String::from_utf8_lossy(&output.stderr);
    let end = said.lines().find(|line| line.starts_with("listener: "));
    assert!(
        end.is_some_and(|line| line.contains("was deleted or exchanged")),
        "{said}"
    );
}

#[test]
fn the_listener_hears_the_robot_of_the_readme() {
    let source = include_str!("../src/bin/listener.rs");
    let (_, program) = source.split_once("\n\n").unwrap();
    assert_eq!(
        program,
        blocks("rust")[0],
        "tests/src/bin/listener.rs is not the README's"
    );

    let Some(output) = run_privately(LISTEN) else {
        println!(
            "SKIPPED: the README's listener: `unshare --map-root-user --mount` is not allowed here"
        );
        return;
    };
    let heard = String::from_utf8(output.stdout).unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(heard.lines().count(), 3, "heard {heard:?}; colocd: {said}");
    assert!(heard.lines().all(is_at_the_origin), "{heard}");
    assert!(output.status.success(), "{said}");
    // `head` has seen enough.
    let end = said.lines().find(|line| line.starts_with("listener: "));
    assert!(
        end.is_some_and(|line| line.contains("Broken pipe")),
        "{said}"
    );
}

/// `[x, y, φ] [nine numbers]`
fn is_at_the_origin(line: &str) -> bool {
    let numbers = line.split(['[', ']', ',', ' ']);
    let numbers: Vec<f64> = numbers.filter_map(|number| number.parse().ok()).collect();
    numbers.len() == 12 && numbers[..3].iter().all(|pose| pose.abs() < 1e-3)
}

fn run_privately(script: &str) -> Option<Output> {
    let unshare = || {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "--propagation", "private"]);
        command
    };
    if !unshare()
        .arg("true")
        .output()
        .is_ok_and(|tried| tried.status.success())
    {
        return None;
    }
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.toml");
    let bus = format!("local:{}/bus", directory.path().display());
    std::fs::write(&file, blocks("toml")[0].replace("socketcan:can0", &bus)).unwrap();
    let mut command = unshare();
    command.args([
        "sh",
        "-c",
        script,
        "sh",
        env!("CARGO_BIN_EXE_colocd-under-test"),
    ]);
    command.arg(&file).arg(env!("CARGO_BIN_EXE_listener"));
    command.env_remove("XDG_RUNTIME_DIR").output().ok()
}
