//! The example, as a person runs it: whatever becomes of its outputs, it ends with a status and a sentence.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::fs::File;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// Builds it: who asked for this test alone has no examples yet.
fn build() -> PathBuf {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args([
            "build",
            "--locked",
            "--offline",
            "--example",
            "compare_settings",
        ])
        .args(["--message-format", "json"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let messages = String::from_utf8(output.stdout).unwrap();
    let (_, rest) = messages.rsplit_once("\"executable\":\"").unwrap();
    rest.split('"').next().unwrap().into()
}

#[track_caller]
fn assert_says(output: &Output, words: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    let is_sentence = said.starts_with("compare_settings: ") && said.lines().count() == 1;
    assert!(is_sentence && said.contains(words), "{said}");
}

#[test]
fn what_goes_wrong_is_a_sentence() {
    let path = build();
    let run = |arguments: &[&str], stdout: Stdio| {
        let mut command = Command::new(&path);
        command
            .args(arguments)
            .stdout(stdout)
            .stderr(Stdio::piped());
        command.output().unwrap()
    };
    for (arguments, words) in [
        (&[][..], "usage: "),
        (&["synthetic", "many", "all"], "`many` is no number of runs"),
        (&["/missing", "1", "all"], "/missing"),
    ] {
        assert_says(&run(arguments, Stdio::piped()), words);
    }
    let short = ["synthetic", "1", "paper", "default"];
    let full = File::options().write(true).open("/dev/full").unwrap();
    assert_says(&run(&short, full.into()), "No space left on device");
    let (reader, closed) = std::io::pipe().unwrap();
    drop(reader);
    assert_says(&run(&short, closed.into()), "Broken pipe");
}
