//! The README's commands do what it says, and every command of `coloc` or `colocd` that a document names exists.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;
use std::process::{Command, Output};

const DOCUMENTS: [&str; 9] = [
    "README.md",
    "ARCHITECTURE.md",
    "benches/README.md",
    "docs/accuracy.md",
    "docs/accuracy-experiments.md",
    "docs/configuration.md",
    "docs/operation.md",
    "docs/scale.md",
    "tests/hil/README.md",
];

fn read(document: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    std::fs::read_to_string(root.join(document)).unwrap()
}

fn coloc(words: &[&str], directory: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_coloc"))
        .args(words)
        .current_dir(directory)
        .output()
        .unwrap()
}

/// What makes a command short: it is the same command for less long.
fn shortened(command: &str) -> &'static [&'static str] {
    match command {
        "demo" => &["--seconds", "3"],
        "eval" => &[
            "--runs",
            "1",
            "--seconds",
            "4",
            "--methods",
            "split-ci,coloc",
        ],
        "latency" => &["--seconds", "1", "--can", "local"],
        other => panic!("the README runs `coloc {other}`: say here how it is made short"),
    }
}

#[test]
fn the_commands_of_the_readme_do_something() {
    const RUN: &str = "cargo run --release --bin coloc -- ";
    let readme = read("README.md");
    let lines: Vec<&str> = readme
        .lines()
        .filter_map(|line| line.strip_prefix(RUN))
        .collect();
    assert!(lines.len() >= 3, "{lines:?}");
    for line in lines {
        let directory = tempfile::tempdir().unwrap();
        let mut words: Vec<&str> = line.split('#').next().unwrap().split_whitespace().collect();
        words.extend(shortened(words[0]));
        let output = coloc(&words, directory.path());
        // In so short a time, and on any machine, a bar may be missed: that is 1. A failure says nothing on this side.
        let ran = matches!(output.status.code(), Some(0 | 1));
        assert!(ran && output.stdout.len() > 100, "{words:?}: {output:?}");
    }
}

/// `/run` and `/dev/shm` are the script's own, so that nobody else runs where it looks. The daemon is there before anybody
/// is listed.
const WATCH: &str = r#"
mount -t tmpfs tmpfs /run && mount -t tmpfs tmpfs /dev/shm || exit 9
"$1" colocd run "$2" >&2 &
"$1" listen robot1 --count 1 >&2
"$1" $3 | head -n 4
kill $!
wait $!
"#;

/// What `target/release/coloc` says beside the README's robot, in its usual place; nothing where that is not to be had.
fn watched(arguments: &str) -> Option<Output> {
    let unshare = || {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "--propagation", "private"]);
        command
    };
    let tried = unshare().arg("true").output();
    tried.ok().filter(|tried| tried.status.success())?;
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.toml");
    let readme = read("README.md");
    let (_, rest) = readme.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let bus = format!("local:{}/bus", directory.path().display());
    std::fs::write(&file, text.replace("socketcan:can0", &bus)).unwrap();
    let mut command = unshare();
    command.args(["sh", "-c", WATCH, "sh", env!("CARGO_BIN_EXE_coloc")]);
    command.arg(&file).arg(arguments);
    command.env_remove("XDG_RUNTIME_DIR").output().ok()
}

#[test]
fn who_runs_and_what_it_says_is_shown_by_the_commands_of_the_readme() {
    let readme = read("README.md");
    let commands = readme
        .lines()
        .filter_map(|line| line.strip_prefix("target/release/coloc "));
    let commands: Vec<&str> = commands
        .map(|line| line.split('#').next().unwrap().trim())
        .collect();
    assert_eq!(commands, ["list", "listen robot1"]);
    for command in commands {
        let Some(output) = watched(command) else {
            println!("SKIPPED: `unshare --map-root-user --mount` is not allowed here");
            return;
        };
        let said = String::from_utf8_lossy(&output.stderr);
        let shown = String::from_utf8(output.stdout).unwrap();
        let last = shown.lines().last().unwrap_or_default();
        let is_robot = last.starts_with("robot1 ") || shown.lines().count() == 4;
        assert!(
            is_robot && last.contains(" finding      never_seen"),
            "{shown}{said}"
        );
    }
}

/// Code in a document: the lines between fences, and what stands between backquotes in a line.
fn code(text: &str) -> Vec<&str> {
    let mut fenced = false;
    let mut found = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if fenced {
            found.push(line);
        } else {
            found.extend(line.split('`').skip(1).step_by(2));
        }
    }
    found
}

/// What comes after the program's name, and how to call the program.
fn command(code: &str) -> Option<(&'static [&'static str], &str)> {
    const STARTS: [(&str, &[&str]); 5] = [
        ("coloc ", &[]),
        ("target/release/coloc ", &[]),
        ("cargo run --release --bin coloc -- ", &[]),
        ("colocd ", &["colocd"]),
        ("target/release/colocd ", &["colocd"]),
    ];
    let code = code.trim().split('#').next().unwrap();
    STARTS
        .into_iter()
        .find_map(|(start, program)| Some((program, code.strip_prefix(start)?)))
}

#[test]
fn every_command_that_a_document_names_exists_with_its_options() {
    let mut named = 0;
    for document in DOCUMENTS {
        let text = read(document);
        for (program, line) in code(&text).into_iter().filter_map(command) {
            named += 1;
            let words: Vec<&str> = line.split_whitespace().collect();
            let call = [program, &words[..1], &["--help"]].concat();
            let output = coloc(&call, Path::new("."));
            let help = String::from_utf8(output.stdout).unwrap();
            let unknown: Vec<_> = words
                .iter()
                .filter(|word| word.starts_with("--") && !help.contains(**word))
                .collect();
            assert!(
                output.status.success() && unknown.is_empty(),
                "{document}: `{line}`: {unknown:?}"
            );
        }
    }
    assert!(named > 10, "only {named} commands were found");
}
