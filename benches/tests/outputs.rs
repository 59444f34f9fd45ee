//! The programs of the benches: whatever becomes of their outputs, they end with a status and a sentence.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// `ratios` for a readme of our own, of figures that are all the same.
struct Ratios {
    directory: tempfile::TempDir,
}

impl Ratios {
    fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let ratios = Self { directory };
        ratios.write_readme();
        // Whatever it asks for next.
        while let Some(missing) = ratios.missing() {
            fs::create_dir_all(missing.parent().unwrap()).unwrap();
            fs::write(missing, r#"{"median":{"point_estimate":1000.0}}"#).unwrap();
        }
        ratios
    }

    fn readme(&self) -> PathBuf {
        self.directory.path().join("README.md")
    }

    fn write_readme(&self) {
        fs::copy(
            concat!(env!("CARGO_MANIFEST_DIR"), "/README.md"),
            self.readme(),
        )
        .unwrap();
    }

    fn missing(&self) -> Option<PathBuf> {
        let output = self.run(&self.readme(), Stdio::piped());
        let said = String::from_utf8(output.stderr).unwrap();
        let (path, _) = said
            .strip_prefix("ratios: ")?
            .split_once(": No such file")?;
        Some(path.into())
    }

    fn run(&self, readme: &Path, stdout: Stdio) -> Output {
        Command::new(env!("CARGO_BIN_EXE_ratios"))
            .arg(readme)
            .env("CARGO_TARGET_DIR", self.directory.path())
            .stdout(stdout)
            .stderr(Stdio::piped())
            .output()
            .unwrap()
    }
}

fn full() -> Stdio {
    File::options()
        .write(true)
        .open("/dev/full")
        .unwrap()
        .into()
}

fn closed() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

#[track_caller]
fn assert_ends(output: &Output, status: i32, words: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{said}");
    assert!(
        said.starts_with(words) && !said.contains("panicked"),
        "{said}"
    );
}

#[test]
fn ratios_are_written_whoever_reads_them() {
    let ratios = Ratios::new();
    for (output, status, words) in [
        (Stdio::piped(), 0, ""),
        (closed(), 141, ""),
        (
            full(),
            1,
            "ratios: cannot write to standard output: No space left",
        ),
    ] {
        ratios.write_readme();
        assert_ends(&ratios.run(&ratios.readme(), output), status, words);
        let text = fs::read_to_string(ratios.readme()).unwrap();
        assert!(text.contains("| propagate, coloc | 1000 ns |"), "{text}");
    }
}

#[test]
fn what_cannot_be_read_or_written_is_named() {
    let ratios = Ratios::new();
    let no_marks = "README.md has lost its marks";
    for (readme, why) in [
        ("/dev/null", no_marks),
        ("/missing", "/missing: No such file"),
    ] {
        let output = ratios.run(Path::new(readme), Stdio::piped());
        assert_ends(&output, 1, &format!("ratios: {why}"));
    }
}

#[test]
fn instructions_says_what_it_needs() {
    let instructions = || Command::new(env!("CARGO_BIN_EXE_instructions"));
    let output = instructions().env("PATH", "/nowhere").output().unwrap();
    assert_ends(&output, 1, "instructions: valgrind does not start");
    let output = instructions().arg("--nonsense").output().unwrap();
    assert_ends(&output, 1, "instructions: usage: ");
    for nobody in [full(), closed()] {
        let status = instructions().arg("--nonsense").stderr(nobody).status();
        assert_eq!(status.unwrap().code(), Some(1));
    }
}
