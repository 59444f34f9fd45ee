//! Standard output and standard error.

use std::path::Path;

use crate::program::Sink::{Closed, Full, Read};
use crate::program::{Ended, Program, Sink};

/// All but the one in which nothing is wrong.
const SINKS: [(Sink, Sink); 6] = [
    (Closed, Read),
    (Full, Read),
    (Read, Closed),
    (Read, Full),
    (Closed, Closed),
    (Full, Full),
];

/// The status of a program that would end with `good` and prints something on standard output.
fn wanted(stdout: Sink, good: i32) -> i32 {
    match stdout {
        Read => good,
        Closed => 141,
        Full => 1,
    }
}

fn assert_says_why(stdout: Sink, stderr: Sink, ended: &Ended) {
    if (stdout, stderr) == (Full, Read) {
        let why = "coloc: cannot write to standard output: No space left on device";
        assert!(ended.stderr.contains(why), "{ended:?}");
    }
}

#[test]
fn help_and_version_are_answers_like_others() {
    for arguments in [
        "--help",
        "--version",
        "demo --help",
        "eval --help",
        "latency --help",
        "list --help",
        "listen --help",
    ] {
        for (stdout, stderr) in SINKS {
            let ended = Program::coloc(arguments).run(stdout, stderr);
            assert_eq!(
                ended.status,
                Some(wanted(stdout, 0)),
                "{arguments} {stdout:?} {ended:?}"
            );
            assert_says_why(stdout, stderr, &ended);
        }
    }
}

#[test]
fn what_is_not_understood_is_said_on_standard_error_alone() {
    for arguments in [
        "",
        "nonsense",
        "demo --robots 0",
        "eval --promises --synthetic",
    ] {
        for (stdout, stderr) in SINKS {
            let ended = Program::coloc(arguments).run(stdout, stderr);
            assert_eq!(ended.status, Some(2), "{arguments} {stdout:?} {ended:?}");
        }
    }
}

/// It is the daemon that answers: 1 whoever does not take it.
#[test]
fn a_configuration_that_nobody_reads_about_is_a_sentence() {
    for (stdout, stderr) in SINKS {
        for command in ["check", "colocd check"] {
            let mut program = Program::coloc(&format!("{command} OUT/robot.toml"));
            let root = program.folder.path().join("shm");
            let text = format!(
                "[robot]\nname = \"robot1\"\nid = 1\n[shm]\nroot = \"{}\"\n",
                root.display()
            );
            std::fs::write(program.folder.path().join("robot.toml"), text).unwrap();
            let ended = program.run(stdout, stderr);
            let good = i32::from(stdout != Read);
            assert_eq!(ended.status, Some(good), "{command} {stdout:?} {ended:?}");
            let said = ended.stderr.starts_with("colocd: ");
            assert_eq!(
                said,
                stdout != Read && stderr == Read,
                "{command} {ended:?}"
            );
        }
    }
}

#[test]
fn an_evaluation_whose_reader_has_gone_still_writes_its_files() {
    let arguments = "eval --runs 2 --seconds 1 --methods coloc,split-ci \
                     --json OUT/eval.json --markdown OUT/eval.md --plots OUT/plots";
    for (stdout, stderr) in SINKS {
        let mut program = Program::coloc(arguments);
        let ended = program.run(stdout, stderr);
        assert_eq!(
            ended.status,
            Some(wanted(stdout, 0)),
            "{stdout:?} {ended:?}"
        );
        assert_says_why(stdout, stderr, &ended);
        for file in [
            "eval.json",
            "eval.md",
            "plots/paths.svg",
            "plots/methods.svg",
        ] {
            program.assert_wrote(file);
        }
    }
}

#[test]
fn an_evaluation_that_nobody_reads_and_nothing_keeps_ends_early() {
    // All scenarios would take minutes.
    let ended = Program::coloc("eval --scenario all --runs 5 --seconds 60").run(Closed, Read);
    assert_eq!((ended.status, ended.stderr.as_str()), (Some(141), ""));
}

#[test]
fn a_demo_that_nobody_reads_leaves_its_summary_and_pictures() {
    for (stdout, stderr) in [(Closed, Read), (Full, Read), (Closed, Closed), (Full, Full)] {
        for json in ["", " --json"] {
            let arguments = format!("demo --robots 1 --seconds 1 --out OUT/demo{json}");
            let mut program = Program::coloc(&arguments);
            let ended = program.run(stdout, stderr);
            // A busy machine may miss a bar.
            let missed = ended.stderr.contains("not met") || stderr != Read;
            let statuses = [
                wanted(stdout, 0),
                if missed { 1 } else { wanted(stdout, 0) },
            ];
            assert!(
                ended
                    .status
                    .is_some_and(|status| statuses.contains(&status)),
                "{ended:?}"
            );
            assert_says_why(stdout, stderr, &ended);
            for file in [
                "demo/summary.json",
                "demo/paths.svg",
                "demo/errors-robot1.svg",
            ] {
                program.assert_wrote(file);
            }
            assert!(program.left_in(Path::new("tmp")).is_empty());
        }
    }
}

#[test]
fn a_latency_whose_reader_has_gone_still_writes_its_files() {
    let arguments =
        "latency --can local --seconds 1 --wait sleep --json OUT/a.json --plot OUT/a.svg";
    for (stdout, stderr) in [(Closed, Read), (Full, Read), (Read, Full), (Full, Full)] {
        let mut program = Program::coloc(arguments);
        let ended = program.run(stdout, stderr);
        assert_eq!(
            ended.status,
            Some(wanted(stdout, 0)),
            "{stdout:?} {ended:?}"
        );
        assert_says_why(stdout, stderr, &ended);
        program.assert_wrote("a.json");
        program.assert_wrote("a.svg");
        assert!(program.left_in(Path::new("tmp")).is_empty());
    }
}
