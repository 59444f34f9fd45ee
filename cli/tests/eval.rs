//! `coloc eval`, as a person runs it.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn eval(arguments: &str, files: &[(&str, &Path)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_coloc"));
    command.arg("eval").args(arguments.split(' '));
    for (option, path) in files {
        command.arg(option).arg(path);
    }
    command.output().unwrap()
}

const SHORT: &str = "--runs 2 --seconds 4 --methods split-ci,coloc";

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads_and_another_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, seed: &str, threads: &str| {
        let json = folder.path().join(name);
        let mut command = Command::new(env!("CARGO_BIN_EXE_coloc"));
        command.arg("eval").args(SHORT.split(' '));
        command.args(["--seed", seed, "--json"]).arg(&json);
        let status = command.env("RAYON_NUM_THREADS", threads).output().unwrap();
        assert!(status.status.success(), "{status:?}");
        std::fs::read(json).unwrap()
    };
    let one = run("one", "3", "1");
    assert_eq!(one, run("again", "3", "3"));
    assert_ne!(one, run("other", "4", "1"));
}

#[test]
fn the_table_the_numbers_and_the_pictures_speak_of_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (json, plots) = (folder.path().join("eval.json"), folder.path().join("plots"));
    let arguments = format!("{SHORT} --scenario one-dgps");
    let output = eval(&arguments, &[("--json", &json), ("--plots", &plots)]);
    let table = String::from_utf8(output.stdout).unwrap();
    let found: Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    let report = &found["reports"][0];
    assert_eq!((&report["runs"], &report["robots"]), (&2.into(), &5.into()));
    let rms_m = report["methods"][1]["robots"][4]["rms_position"]
        .as_f64()
        .unwrap();
    let rms_cm = format!("{:.2}", 100.0 * rms_m);
    let rows = table
        .lines()
        .skip_while(|line| !line.trim_start().starts_with("R5"));
    let row = rows
        .skip(1)
        .find(|line| line.contains("coloc"))
        .expect("a row for each robot");
    assert!(row.ends_with(&rms_cm), "{rms_cm} is not in {row}");
    assert!(table.contains("coloc less each other"));
    for picture in [
        "errors-R1",
        "errors-R5",
        "methods",
        "conversion",
        "paths",
        "nees",
    ] {
        assert!(plots.join(format!("{picture}.svg")).is_file(), "{picture}");
    }
}

#[test]
fn all_scenarios_are_one_command_and_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let (json, markdown) = (folder.path().join("all.json"), folder.path().join("all.md"));
    let arguments = "--runs 1 --seconds 1 --methods coloc --scenario all";
    let output = eval(arguments, &[("--json", &json), ("--markdown", &markdown)]);
    assert!(output.status.success(), "{output:?}");
    let found: Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    let summary = std::fs::read_to_string(markdown).unwrap();
    let reports = found["reports"].as_array().unwrap();
    assert!(reports.len() > 12);
    for report in reports {
        let name = report["scenario"]["name"].as_str().unwrap();
        assert!(summary.contains(&format!("| {name} | coloc |")), "{name}");
    }
}

#[test]
fn what_cannot_be_read_is_said_in_one_line() {
    let empty = tempfile::tempdir().unwrap();
    for folder in ["/nonexistent", empty.path().to_str().unwrap()] {
        let output = eval(SHORT, &[("--data", Path::new(folder))]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(
            said.starts_with("coloc: ") && said.contains(folder) && said.lines().count() == 1,
            "{said}"
        );
    }
}

#[test]
fn an_unknown_name_is_answered_with_the_known_ones() {
    for (wrong, known) in [
        ("--scenario rain", "one-way"),
        ("--methods ekf", "split-ci"),
    ] {
        let output = eval(wrong, &[]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(said.contains(known), "{said}");
    }
}

#[test]
fn many_robots_have_one_digest_on_any_number_of_threads_and_a_price_each() {
    let folder = tempfile::tempdir().unwrap();
    let run = |threads: &str| {
        let (json, plots) = (folder.path().join(threads), folder.path().join("plots"));
        let arguments = format!("--synthetic --robots 40,10 --duration 2 --threads {threads}");
        let output = eval(&arguments, &[("--json", &json), ("--plots", &plots)]);
        assert!(output.status.success(), "{output:?}");
        assert!(plots.join("scale.svg").is_file());
        let table = String::from_utf8(output.stdout).unwrap();
        (std::fs::read(json).unwrap(), table)
    };
    let (json, table) = run("1");
    assert_eq!(json, run("2").0);
    assert_eq!(json, run("3").0);
    let found: Value = serde_json::from_slice(&json).unwrap();
    let robots = [0, 1].map(|at| found["scale"][at]["robots"].as_u64().unwrap());
    assert_eq!(robots, [10, 40], "the fewest first");
    let digest = found["scale"][1]["digest"].as_str().unwrap();
    let row = table.lines().find(|line| line.contains(digest)).unwrap();
    assert!(row.trim_start().starts_with("40"), "{row}");
    let refused = eval("--robots 10 --runs 2", &[]);
    assert_eq!(refused.status.code(), Some(2), "{refused:?}");
}

/// `mrclam1` in `COLOC_DATA`, or in `shared/data` beside the repository or above it.
fn recording(name: &str) -> Option<PathBuf> {
    let given = std::env::var_os("COLOC_DATA").map(PathBuf::from);
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let above = here.ancestors().map(|folder| folder.join("shared/data"));
    let folders = given.into_iter().chain(above).map(|it| it.join(name));
    let found = folders.into_iter().find(|it| it.is_dir());
    if found.is_none() {
        println!("SKIPPED: no recording {name}: set COLOC_DATA to the folder that has it");
    }
    found
}

/// Root of the sum over the robots without a receiver, x and y.
fn error_m(row: &Value) -> f64 {
    let robots = row["robots"].as_array().unwrap().iter();
    let without = robots.filter(|it| it["receiver"] == false);
    let square = |it: &Value| it.as_f64().unwrap().powi(2);
    let sum: f64 = without
        .map(|it| square(&it["rms"][0]) + square(&it["rms"][1]))
        .sum();
    sum.sqrt()
}

#[test]
fn recorded_sightings_give_the_same_bytes_and_teach_more_than_the_same_as_poses() {
    let Some(data) = recording("mrclam6") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let run = |threads: &str| {
        let (json, page) = (folder.path().join(threads), folder.path().join("page.md"));
        let arguments = format!("--sightings recorded --runs 2 --seconds 150 --threads {threads}");
        let files = [
            ("--data", data.as_path()),
            ("--json", &json),
            ("--markdown", &page),
        ];
        let output = eval(&arguments, &files);
        assert!(output.status.success(), "{output:?}");
        let page = std::fs::read_to_string(page).unwrap();
        assert!(page.starts_with("<!-- coloc eval: mrclam6 sightings -->"));
        std::fs::read(json).unwrap()
    };
    let json = run("1");
    assert_eq!(json, run("3"));
    let found: Value = serde_json::from_slice(&json).unwrap();
    let reports = found["reports"].as_array().unwrap();
    assert_eq!(reports.len(), 5);
    let mut compared = 0;
    for report in reports {
        let methods = report["methods"].as_array().unwrap();
        let (poses, honest): (Vec<_>, Vec<_>) =
            methods.iter().partition(|it| it["method"] == "poses");
        for robot in honest
            .iter()
            .flat_map(|it| it["robots"].as_array().unwrap())
        {
            let outside = robot["nees_outside"].as_f64().unwrap();
            assert!(outside <= 0.05 && robot["lost_runs"] == 0.0, "{robot}");
        }
        for poses in poses {
            let [coloc, poses] = [&methods[0], poses].map(error_m);
            assert!(coloc < 0.5 * poses, "{coloc} m, as poses {poses} m");
            compared += 1;
        }
    }
    assert!(compared > 0, "no report has the row of poses");
}

#[test]
fn recorded_sightings_need_a_recording_and_names_for_its_barcodes() {
    let output = eval("--sightings recorded", &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("--data"), "{said}");
    let folder = tempfile::tempdir().unwrap();
    for robot in [1, 2] {
        for (file, row) in [
            ("Odometry", "0 0 0\n9 0 0\n"),
            ("Groundtruth", "0 0 0 0\n9 0 0 0\n"),
        ] {
            let path = folder.path().join(format!("Robot{robot}_{file}.dat"));
            std::fs::write(path, row).unwrap();
        }
    }
    let output = eval("--sightings recorded", &[("--data", folder.path())]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(said.contains("Barcodes.dat"), "{said}");
}
