//! `coloc eval`, as a person runs it.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn eval(args: &[&str], json: &Path, plots: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_coloc"));
    command
        .args([
            "eval",
            "--runs",
            "2",
            "--seconds",
            "4",
            "--methods",
            "split-ci,coloc",
        ])
        .args(args);
    command
        .arg("--json")
        .arg(json)
        .arg("--plots")
        .arg(plots)
        .output()
        .unwrap()
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, seed: &str| {
        let json = folder.path().join(name);
        let output = eval(&["--seed", seed], &json, &folder.path().join("plots"));
        assert!(output.status.success(), "{output:?}");
        std::fs::read(json).unwrap()
    };
    let (one, again, other) = (run("one", "3"), run("again", "3"), run("other", "4"));
    assert_eq!(one, again);
    assert_ne!(one, other);
}

#[test]
fn the_table_the_numbers_and_the_pictures_speak_of_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (json, plots) = (folder.path().join("eval.json"), folder.path().join("plots"));
    let output = eval(&["--scenario", "one-dgps"], &json, &plots);
    let table = String::from_utf8(output.stdout).unwrap();
    let report: Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    assert_eq!((&report["runs"], &report["robots"]), (&2.into(), &5.into()));
    let x_cm = 100.0
        * report["methods"][1]["robots"][4]["rms"][0]
            .as_f64()
            .unwrap();
    let row = table
        .lines()
        .find(|line| line.starts_with("coloc      R5"))
        .expect("a row for each robot");
    assert!(
        row.contains(&format!(" {x_cm:.2} ")),
        "{x_cm} is not in {row}"
    );
    assert!(table.contains("coloc against split-ci   R5"));
    assert_eq!(std::fs::read_dir(&plots).unwrap().count(), 2 * 5 + 5);
}

#[test]
fn what_cannot_be_read_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let output = eval(
        &["--data", "/nonexistent"],
        &folder.path().join("json"),
        &folder.path().join("plots"),
    );
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said.starts_with("coloc: ") && said.contains("/nonexistent") && said.lines().count() == 1,
        "{said}"
    );
}
