//! A team to which things happen: daemons are killed, people lose patience, the demo itself is killed.

use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use crate::stage::{
    Demo, coloc, entries, is_free, process_with, send, shared_memory_of, wait_until,
};

#[test]
fn a_daemon_that_is_killed_can_be_started_again_and_the_others_do_not_notice() {
    let mut demo = Demo::start(&["--robots", "3", "--seconds", "600"]);
    demo.wait_for_line("3 of 3 up");
    let home = demo.home();
    send(process_with(&home.join("robot2.toml")).unwrap(), "KILL");
    let line = demo.wait_for_line("2 of 3 up");
    let mut again = start_as_told(&line);
    demo.wait_for_line("3 of 3 up");
    demo.send("INT");
    let ended = demo.end();
    assert!(
        again.wait().unwrap().success(),
        "it was asked to end with the demo"
    );
    assert_eq!(
        ["1", "2", "3"].map(|n| ended.robot(n.parse().unwrap())["starts"].as_u64().unwrap()),
        [1, 2, 1]
    );
    assert!((1..=3).all(|number| ended.robot(number)["up_at_the_end"] == true));
    assert!(ended.estimates(1) > ended.estimates(2) && ended.estimates(3) > ended.estimates(2));
    ended.assert_left_nothing();
    assert!(shared_memory_of(&home.join("shm")).is_empty());
    let bounds = |number| {
        let picture = ended
            .folder
            .path()
            .join(format!("out/errors-robot{number}.svg"));
        let svg = std::fs::read_to_string(picture).unwrap();
        svg.matches(BOUNDS_COLOUR).count()
    };
    assert!(bounds(1) > 0);
    assert!(
        bounds(2) >= bounds(1) + 6,
        "its dead time is a gap in six lines"
    );
}

/// In the pictures of errors, of the lines at ±3σ.
const BOUNDS_COLOUR: &str = "#BE3C3C";

/// As the README says, in another terminal.
#[test]
fn somebody_who_listens_to_a_robot_does_not_make_the_demo_fail() {
    let mut demo = Demo::start(&["--robots", "1", "--seconds", "600"]);
    demo.wait_for_line("1 of 1 up");
    let root = demo.home().join("shm");
    let mut listener = coloc()
        .args(["listen", "robot1", "--json", "--root"])
        .arg(&root)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut printed = BufReader::new(listener.stdout.take().unwrap()).lines();
    assert!(printed.next().unwrap().unwrap().contains("\"robot1\""));
    let rest = std::thread::spawn(|| printed.map_while(Result::ok).count());
    demo.send("INT");
    demo.end().assert_left_nothing();
    assert!(shared_memory_of(&root).is_empty());
    send(listener.id(), "INT");
    assert_eq!(listener.wait().unwrap().code(), Some(130));
    rest.join().unwrap();
    let mut said = BufReader::new(listener.stderr.take().unwrap()).lines();
    assert!(said.any(|line| line.unwrap().contains("does not run any more")));
}

/// Types the command that the demo shows for a daemon that is down.
fn start_as_told(line: &str) -> Child {
    let (_, command) = line
        .split_once("from another terminal: ")
        .expect("it says how");
    let mut words = command.split_whitespace();
    Command::new(words.next().unwrap())
        .args(words)
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn a_demo_that_is_interrupted_still_says_what_it_saw() {
    for (signal, number) in [("TERM", 15), ("QUIT", 3)] {
        interrupt(signal, number);
    }
}

fn interrupt(signal: &str, number: i32) {
    let mut demo = Demo::start(&["--robots", "2", "--seconds", "600"]);
    demo.wait_for_line("2 of 2 up");
    demo.send(signal);
    let ended = demo.end();
    assert_eq!(
        ended.status.code(),
        Some(128 + number),
        "as a shell says it"
    );
    assert_eq!(ended.summary["verdict"], "interrupted");
    assert!(ended.said.contains("INTERRUPTED  2 robots") && !ended.said.contains("PASS"));
    let seconds = ended.summary["seconds"].as_f64().unwrap();
    assert!(seconds > 0.0 && seconds < 600.0);
    assert!(ended.estimates(1) > 10);
    ended.assert_left_nothing();
}

#[test]
fn the_daemons_end_with_a_demo_that_is_killed() {
    let mut demo = Demo::start(&["--robots", "2", "--seconds", "600"]);
    demo.wait_for_line("2 of 2 up");
    let home = demo.home();
    assert!(
        !shared_memory_of(&home.join("shm")).is_empty(),
        "the way to look for it works"
    );
    demo.send("KILL");
    let ended = demo.end();
    assert!(!ended.status.success());
    wait_until("its daemons have ended", || process_with(&home).is_none());
    assert!(shared_memory_of(&home.join("shm")).is_empty());
}

#[test]
fn what_a_demo_and_its_daemons_leave_that_were_all_killed_goes_with_the_next_demo() {
    let mut demo = Demo::start(&["--robots", "2", "--seconds", "600"]);
    demo.wait_for_line("2 of 2 up");
    let home = demo.home();
    let mode = home.metadata().unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o700, "nobody else can look in");
    for file in ["robot1.toml", "robot2.toml"] {
        send(process_with(&home.join(file)).unwrap(), "KILL");
    }
    demo.send("KILL");
    let ended = demo.end();
    wait_until("nobody lives in it", || is_free(&home));
    assert!(
        !shared_memory_of(&home.join("shm")).is_empty(),
        "else there is nothing to remove"
    );
    let output = coloc()
        .args(["demo", "--robots", "1", "--seconds", "1", "--out"])
        .arg(ended.folder.path().join("next"))
        .env("TMPDIR", home.parent().unwrap())
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("removed what a demo that was killed had left"),
        "{said}"
    );
    assert!(entries(home.parent().unwrap()).is_empty());
    assert!(shared_memory_of(&home.join("shm")).is_empty());
}

#[test]
fn a_demo_that_cannot_run_says_why_in_one_line() {
    let output = coloc()
        .args(["demo", "--data", "/nonexistent"])
        .current_dir(tempfile::tempdir().unwrap().path())
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said.starts_with("coloc: ") && said.contains("/nonexistent") && said.lines().count() == 1,
        "{said}"
    );
}

#[test]
fn a_wrong_configuration_is_refused_by_check_as_by_the_daemon() {
    let missing = Path::new("/nonexistent/robot.toml");
    let run = |args: &[&str]| coloc().args(args).arg(missing).output().unwrap();
    let (check, daemon) = (run(&["check"]), run(&["colocd", "check"]));
    assert_eq!(
        (check.status.code(), &check.stderr),
        (daemon.status.code(), &daemon.stderr)
    );
    assert_eq!(check.status.code(), Some(2));
}
