//! The log, the recording and the saved belief, where another user can put something as well.
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::precious;
use super::stage::{Daemon, PATIENCE, Stage, configuration};

const STRANGER: u32 = 65534;
const NAMES: [&str; 3] = ["log", "record", "belief"];

/// A daemon with all outputs in `directory`, until it has ticked: where it began \[m\], and what it said.
fn run(stage: &Stage, directory: &Path) -> (f64, String) {
    let daemon = start(stage, directory);
    let [x_m, ..] = daemon.listen().pose;
    (x_m, end(daemon, directory))
}

fn start(stage: &Stage, directory: &Path) -> Daemon {
    let site = stage.site(0);
    let mut config = configuration(&site);
    config.initial.resume = true;
    config.telemetry.log_file = directory.join("log");
    config.telemetry.record = directory.join("record");
    config.telemetry.state_file = directory.join("belief");
    Daemon::start_with(&site, "022", &config)
}

/// What it said, on standard error and in a log of ours.
fn end(daemon: Daemon, directory: &Path) -> String {
    let said = daemon.terminate();
    let log = directory.join("log");
    let ours = log
        .symlink_metadata()
        .is_ok_and(|it| it.is_file() && it.uid() == 0);
    if ours {
        return said + &fs::read_to_string(&log).unwrap();
    }
    said
}

fn entries(directory: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(directory).unwrap();
    entries.map(|entry| entry.unwrap().path()).collect()
}

/// Of each output its refusal, which names the place.
fn assert_refused(said: &str, directory: &Path, names: &[&str], why: &str) {
    for name in names {
        let place = directory.join(name).display().to_string();
        let mut lines = said.lines();
        let refused = lines.any(|line| line.contains(&place) && line.contains(why));
        assert!(refused, "{place}: `{why}` in {said}");
    }
}

/// Whatever else is there is ours alone.
fn assert_ours_is_closed(directory: &Path) {
    for path in entries(directory) {
        let found = path.symlink_metadata().unwrap();
        let mode = found.mode() & 0o777;
        assert!(
            found.uid() == STRANGER || mode == 0o600,
            "{}: {mode:o}",
            path.display()
        );
    }
}

#[test]
fn a_file_that_a_stranger_made_is_neither_written_nor_believed() {
    let Some(stage) = Stage::new() else { return };
    let directory = stage.open_directory(0o1777);
    let places = NAMES.map(|name| directory.join(name));
    stage.stranger("write", &places.each_ref().map(PathBuf::as_path));
    let (_, said) = run(&stage, &directory);
    assert_untouched(&directory);
    assert_refused(
        &said,
        &directory,
        &["log", "belief"],
        "belongs to user 65534",
    );
    // No recording is written over.
    let other = format!("recording to {}/record.1", directory.display());
    assert!(said.contains(&other), "{said}");
    assert_ours_is_closed(&directory);
}

#[test]
fn a_link_that_a_stranger_made_is_not_followed() {
    let Some(stage) = Stage::new() else { return };
    let directory = stage.open_directory(0o1777);
    let thesis = precious(&stage).join("services/thesis.tex");
    for name in NAMES {
        stage.stranger("link", &[&thesis, &directory.join(name)]);
    }
    let (_, said) = run(&stage, &directory);
    assert_eq!(fs::read_to_string(&thesis).unwrap(), "years");
    assert_refused(
        &said,
        &directory,
        &NAMES,
        "symbolic link that user 65534 made",
    );
    assert_ours_is_closed(&directory);
}

#[test]
fn a_directory_that_a_stranger_made_is_no_file_of_ours() {
    let Some(stage) = Stage::new() else { return };
    let directory = stage.open_directory(0o1777);
    for name in NAMES {
        stage.stranger("precreate", &[&directory.join(name)]);
    }
    run(&stage, &directory);
    for name in NAMES {
        let place = directory.join(name);
        assert_eq!(entries(&place), [place.join("services")]);
    }
    assert_ours_is_closed(&directory);
}

/// There he can move and remove what he likes; no more.
#[test]
fn what_a_stranger_puts_there_later_is_not_used_either() {
    let Some(stage) = Stage::new() else { return };
    let directory = stage.open_directory(0o777);
    let daemon = start(&stage, &directory);
    daemon.listen();
    let places = NAMES.map(|name| directory.join(name));
    wait_for_files(&places);
    let places = places.each_ref().map(PathBuf::as_path);
    assert_eq!(stage.stranger("take the place of", &places), "");
    daemon.hang_up();
    daemon.listen();
    let said = end(daemon, &directory);
    assert_untouched(&directory);
    let log = format!("{}/log belongs to user 65534", directory.display());
    assert!(said.contains(&log), "{said}");
    assert_ours_is_closed(&directory);
}

fn wait_for_files(places: &[PathBuf]) {
    let deadline = Instant::now() + PATIENCE;
    while !places.iter().all(|place| place.exists()) {
        assert!(Instant::now() < deadline, "{places:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// What he wrote; the belief takes its name from whoever has it, and its own file it is.
fn assert_untouched(directory: &Path) {
    for name in ["log", "record"] {
        let place = directory.join(name);
        assert_eq!(fs::read(&place).unwrap(), [0xA5; 4096], "{name}");
        assert_eq!(place.metadata().unwrap().uid(), STRANGER, "{name}");
    }
    assert_eq!(directory.join("belief").metadata().unwrap().uid(), 0);
}

#[test]
fn a_belief_that_a_stranger_made_up_is_not_believed() {
    let Some(stage) = Stage::new() else { return };
    let own = stage.open_directory(0o700);
    run(&stage, &own);
    let forged = stage.site(0).join("forged");
    fs::write(&forged, far_away(&own.join("belief"))).unwrap();
    // Of ours it would be believed.
    fs::write(own.join("belief"), far_away(&own.join("belief"))).unwrap();
    assert!((run(&stage, &own).0 - 100.0).abs() < 1.0);
    let open = stage.open_directory(0o1777);
    stage.stranger("copy", &[&forged, &open.join("belief")]);
    let (x_m, said) = run(&stage, &open);
    assert!(x_m.abs() < 1.0, "{x_m} m");
    assert!(
        said.contains("starting from [initial], not from the saved belief"),
        "{said}"
    );
}

/// What is saved there, of a robot a hundred metres away.
fn far_away(belief: &Path) -> String {
    let text = fs::read_to_string(belief).unwrap();
    let line = text
        .lines()
        .find(|line| line.starts_with("pose = "))
        .unwrap();
    text.replace(line, "pose = [100.0, 0.0, 0.0]")
}
