//! The workspace's own programs: whatever becomes of their outputs and their directory, they end with a status and a sentence.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::fs::{File, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::process::{Command, Output, Stdio};

/// Each with arguments for something short.
const PROGRAMS: [(&str, &str, &[&str]); 4] = [
    (
        "endurance",
        env!("CARGO_BIN_EXE_endurance"),
        &["--ticks", "100000"],
    ),
    (
        "edge",
        env!("CARGO_BIN_EXE_edge"),
        &["--episodes", "2", "--ticks", "20"],
    ),
    (
        "chaos",
        env!("CARGO_BIN_EXE_chaos"),
        &["--only", "outputs", "--round", "11"],
    ),
    (
        "chaos",
        env!("CARGO_BIN_EXE_chaos"),
        &["--only", "disk", "--round", "0"],
    ),
];

#[derive(Copy, Clone, Debug, PartialEq)]
enum Sink {
    Read,
    Closed,
    Full,
}

impl Sink {
    fn open(self) -> Stdio {
        match self {
            Self::Read => Stdio::piped(),
            Self::Closed => {
                let (reader, writer) = std::io::pipe().unwrap();
                drop(reader);
                writer.into()
            }
            Self::Full => File::options()
                .write(true)
                .open("/dev/full")
                .unwrap()
                .into(),
        }
    }
}

fn run(command: &mut Command, stdout: Sink, stderr: Sink) -> Output {
    command
        .stdout(stdout.open())
        .stderr(stderr.open())
        .output()
        .unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn an_output_that_nobody_takes_is_a_status() {
    for (name, path, arguments) in PROGRAMS {
        for (stdout, stderr, status) in [
            (Sink::Read, Sink::Closed, 0),
            (Sink::Closed, Sink::Read, 141),
            (Sink::Full, Sink::Read, 1),
            (Sink::Full, Sink::Full, 1),
        ] {
            let output = run(Command::new(path).args(arguments), stdout, stderr);
            let about = format!("{name}, {stdout:?} {stderr:?}: {output:?}");
            assert_eq!(output.status.code(), Some(status), "{about}");
            if (stdout, stderr) == (Sink::Full, Sink::Read) {
                let why =
                    format!("{name}: cannot write to standard output: No space left on device");
                assert!(said(&output).contains(&why), "{about}");
            }
            assert!(!said(&output).contains("panicked"), "{about}");
        }
    }
}

/// The superuser may write to directories that are read-only for others, but not make any below /proc.
#[test]
fn without_a_place_for_their_directories_they_say_so() {
    for (name, path, arguments) in PROGRAMS.iter().filter(|(name, ..)| *name != "edge") {
        let mut command = Command::new(path);
        let output = run(
            command.args(*arguments).env("TMPDIR", "/proc"),
            Sink::Read,
            Sink::Read,
        );
        let said = said(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {said}");
        let why = format!("{name}: no directory can be made in /proc (");
        assert!(
            said.starts_with(&why) && said.lines().count() == 1,
            "{said}"
        );
    }
}

/// Of a user who has no place for shared memory; with a robot it is tried by `tests/tests/readme.rs`.
#[test]
fn the_listener_of_the_readme_says_a_sentence() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::set_permissions(directory.path(), Permissions::from_mode(0o755)).unwrap();
    let program = directory.path().join("listener");
    std::fs::copy(env!("CARGO_BIN_EXE_listener"), &program).unwrap();
    for stderr in [Sink::Read, Sink::Closed, Sink::Full] {
        let mut command = Command::new(&program);
        command.env_remove("XDG_RUNTIME_DIR").current_dir("/");
        if rustix::process::geteuid().is_root() {
            command.uid(65534).gid(65534);
        }
        let output = run(&mut command, Sink::Read, stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr:?}: {output:?}");
        let said = said(&output);
        let is_sentence = said.starts_with("listener: ") && said.lines().count() == 1;
        assert!(
            stderr != Sink::Read || is_sentence && !said.contains(['{', '"']),
            "{said}"
        );
    }
}
