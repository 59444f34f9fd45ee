//! Files and folders.

use std::process::Command;

use crate::program::Program;
use crate::program::Sink::Read;

/// Nobody can make a file there, not even root.
const NOWHERE: &str = "/proc/self";

#[test]
fn what_cannot_be_written_is_refused_before_anything_is_computed() {
    // Each would take minutes.
    let eval = "eval --runs 100 --methods coloc";
    for (arguments, named) in [
        (
            format!("{eval} --json {NOWHERE}/a.json"),
            "/proc/self/a.json",
        ),
        (format!("{eval} --json OUT"), ""),
        (
            format!("{eval} --json OUT/missing/a.json"),
            "missing/a.json",
        ),
        (
            format!("{eval} --markdown {NOWHERE}/a.md"),
            "/proc/self/a.md",
        ),
        (
            format!("{eval} --plots {NOWHERE}/plots"),
            "/proc/self/plots",
        ),
        (
            format!("{eval} --scenario all --plots {NOWHERE}"),
            "/proc/self/paper",
        ),
        (
            format!("latency --can local --json {NOWHERE}/a.json"),
            "/proc/self/a.json",
        ),
        (
            format!("latency --can local --plot {NOWHERE}/a.svg"),
            "/proc/self/a.svg",
        ),
        (
            format!("{eval} --json OUT/a --markdown OUT/tmp/../a"),
            "/a: that is ",
        ),
        (
            "latency --can local --seconds 600 --json OUT/a --plot OUT/a".into(),
            "/a: that is ",
        ),
        (
            format!("demo --seconds 600 --out {NOWHERE}/demo"),
            "/proc/self/demo",
        ),
    ] {
        let ended = Program::coloc(&arguments).run(Read, Read);
        assert_eq!(
            (ended.status, ended.stdout.as_str()),
            (Some(1), ""),
            "{arguments}: {ended:?}"
        );
        let begin = "coloc: cannot write ";
        assert!(
            ended.stderr.starts_with(begin)
                && ended.stderr.contains(named)
                && ended.stderr.lines().count() == 1,
            "{arguments}: {ended:?}"
        );
    }
}

#[test]
fn a_document_without_a_place_for_the_tables_is_refused_and_left_alone() {
    let mut program = Program::coloc("eval --runs 100 --methods coloc --markdown OUT/words.md");
    let words = program.folder.path().join("words.md");
    std::fs::write(&words, "somebody's words").unwrap();
    let ended = program.run(Read, Read);
    assert_eq!(
        (ended.status, ended.stdout.as_str()),
        (Some(1), ""),
        "{ended:?}"
    );
    assert_eq!(std::fs::read_to_string(words).unwrap(), "somebody's words");
}

#[test]
fn a_disk_that_fills_up_loses_nothing_else() {
    let eval = "eval --runs 2 --seconds 1 --methods coloc --json /dev/full --markdown OUT/a.md";
    let mut program = Program::coloc(eval);
    let ended = program.run(Read, Read);
    assert_eq!(ended.status, Some(1));
    assert!(ended.stdout.contains("Errors: RMSE"), "{ended:?}");
    let why = "coloc: cannot write /dev/full: No space left on device";
    assert!(ended.stderr.contains(why), "{ended:?}");
    program.assert_wrote("a.md");
}

#[test]
fn a_demo_whose_pictures_fail_says_its_verdict() {
    let mut program = Program::coloc("demo --robots 1 --seconds 1 --out OUT/demo");
    let picture = program.folder.path().join("demo/paths.svg");
    std::fs::create_dir_all(picture).unwrap();
    let ended = program.run(Read, Read);
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(
        ended.stdout.contains("robot1 ") && ended.stdout.contains("1 robot, 1.0 s"),
        "{ended:?}"
    );
    assert!(
        ended.stderr.contains("paths.svg: Is a directory"),
        "{ended:?}"
    );
    program.assert_wrote("demo/errors-robot1.svg");
    program.assert_wrote("demo/summary.json");
}

#[test]
fn a_demo_on_a_full_disk_says_its_verdict() {
    let mut program = on_a_full_disk("demo --robots 1 --seconds 1 --out OUT/full/demo");
    let ended = program.run(Read, Read);
    if cannot_mount(&ended.stderr) {
        return;
    }
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(
        ended.stdout.contains("robot1 ") && ended.stdout.contains("1 robot, 1.0 s"),
        "{ended:?}"
    );
    for file in ["paths.svg", "summary.json"] {
        let why = format!("{file}: No space left on device");
        assert!(ended.stderr.contains(&why), "{ended:?}");
    }
}

#[test]
fn an_evaluation_on_a_full_disk_says_what_it_found() {
    let arguments =
        "eval --runs 2 --seconds 1 --methods coloc --plots OUT/full/plots --json OUT/a.json";
    let mut program = on_a_full_disk(arguments);
    let ended = program.run(Read, Read);
    if cannot_mount(&ended.stderr) {
        return;
    }
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(ended.stdout.contains("Errors: RMSE"), "{ended:?}");
    assert!(ended.stderr.contains(".svg: No space left"), "{ended:?}");
    program.assert_wrote("a.json");
}

/// It would be a signal that ends the program.
#[test]
fn a_limit_on_the_size_of_files_is_like_a_full_disk() {
    let coloc = env!("CARGO_BIN_EXE_coloc");
    let script = format!("ulimit -f 1; exec {coloc} \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &script, "sh"]);
    let arguments = "eval --runs 2 --seconds 1 --methods coloc --json OUT/a.json";
    let ended = Program::new(command, arguments).run(Read, Read);
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(ended.stdout.contains("Errors: RMSE"), "{ended:?}");
    let why = "a.json: File too large (os error 27)\n";
    assert!(ended.stderr.ends_with(why), "{ended:?}");
}

const NO_MOUNT: &str = "no mount namespace";

/// `coloc` in a mount namespace of its own, where the folder's `full` is a disk on which files can be made and not filled.
fn on_a_full_disk(arguments: &str) -> Program {
    let coloc = env!("CARGO_BIN_EXE_coloc");
    let script = format!(
        "mkdir full && mount -t tmpfs -o size=4k none full && echo > full/file || {{ echo {NO_MOUNT} >&2; exit 1; }}
         exec {coloc} \"$@\""
    );
    let mut command = Command::new("unshare");
    let flags = if rustix::process::geteuid().is_root() {
        "-m"
    } else {
        "-Urm"
    };
    command.args([flags, "sh", "-c", &script, "sh"]);
    Program::new(command, arguments)
}

/// Where only an administrator may mount.
fn cannot_mount(said: &str) -> bool {
    let refused = said.contains(NO_MOUNT) || said.starts_with("unshare: ");
    if refused {
        eprintln!("SKIPPED: a full disk: {}", said.trim());
    }
    refused
}
