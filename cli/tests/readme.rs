//! The README's commands do what it says, and every command of `coloc` or `colocd` that a document names exists.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;
use std::process::{Command, Output};

const DOCUMENTS: [&str; 8] = [
    "README.md",
    "ARCHITECTURE.md",
    "benches/README.md",
    "docs/accuracy.md",
    "docs/accuracy-experiments.md",
    "docs/configuration.md",
    "docs/operation.md",
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
