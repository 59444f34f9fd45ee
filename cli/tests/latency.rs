//! `coloc latency`, as a person runs it. What it finds is a machine's affair; that it accounts for everything is its own.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use serde_json::Value;

const RATE_HZ: u64 = 100;
const SECONDS: u64 = 2;

fn latency(arguments: &str, files: &[(&str, &Path)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_coloc"));
    command.arg("latency").args(arguments.split_whitespace());
    for (option, path) in files {
        command.arg(option).arg(path);
    }
    command.output().unwrap()
}

/// Runs it and reads what it wrote.
fn found(arguments: &str) -> (String, Value) {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("latency.json");
    let arguments = format!("--can local --rate {RATE_HZ} --seconds {SECONDS} {arguments}");
    let output = latency(&arguments, &[("--json", &json)]);
    assert!(output.status.success(), "{output:?}");
    let report = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    (String::from_utf8(output.stdout).unwrap(), report)
}

fn count_of(durations: &Value) -> u64 {
    durations["count"].as_u64().unwrap()
}

#[test]
fn every_frame_is_accounted_for_whatever_the_trigger_and_the_wait() {
    for trigger in ["auto", "encoder", "timer"] {
        let (table, report) = found(&format!("--trigger {trigger} --wait poll,sleep"));
        let passes = report["passes"].as_array().unwrap();
        let waits: Vec<&str> = passes
            .iter()
            .map(|pass| pass["wait"].as_str().unwrap())
            .collect();
        assert_eq!(waits, ["poll", "sleep"]);
        for pass in passes {
            assert_accounted(pass);
            let floor = count_of(&pass["floor_frame_read"]);
            assert!(floor > 0, "{pass}");
            let ratio = &pass["ratio_to_floors"]["p50"];
            assert_eq!(ratio.is_null(), trigger == "timer", "{pass}");
        }
        for row in [
            "frame due → estimate read",
            "frame in kernel → estimate ready",
            "slowest frame, kernel → read",
            "others had ",
            "  wake-up",
            "  collect",
            "  estimate",
            "  publish",
            "  transfer",
            "floor: transport",
        ] {
            let rows = table.lines().filter(|line| line.starts_with(row));
            assert_eq!(rows.count(), 2, "{row} in {table}");
        }
    }
}

/// Every frame that was sent is read, alone or with a newer one, or never estimated, or was before the measured time.
fn assert_accounted(pass: &Value) {
    let frames = |what: &str| pass["frames"][what].as_u64().unwrap();
    let read = frames("newest") + frames("with_newer");
    assert_eq!(read, count_of(&pass["frame_due_to_estimate"]), "{pass}");
    assert_eq!(
        frames("newest"),
        count_of(&pass["frame_in_kernel_to_estimate"]),
        "{pass}"
    );
    assert_eq!(
        read + frames("never_estimated"),
        RATE_HZ * SECONDS,
        "{pass}"
    );
    assert_eq!(
        RATE_HZ * SECONDS + frames("warm_up"),
        frames("sent"),
        "{pass}"
    );
    let floors = pass["floors_sent"].as_u64().unwrap();
    assert_eq!(floors, RATE_HZ * SECONDS / 2, "{pass}");
    assert!(count_of(&pass["floor_frame_read"]) <= floors, "{pass}");
}

/// As buses are, and beside the plain program where there is a compiler.
#[test]
fn frames_come_as_on_the_buses_that_were_asked_for() {
    let has_compiler = Command::new("cc").arg("--version").output().is_ok();
    if !has_compiler {
        eprintln!("SKIPPED: the plain program beside coloc latency: there is no cc");
    }
    for (buses, count, gap_us) in [
        ("--gap-us 0", 1, 0),
        ("--clock-ppm 1000", 1, 250),
        ("--two-buses --gap-us 1000", 2, 1000),
    ] {
        let plain = if has_compiler { "--plain" } else { "" };
        let (table, report) = found(&format!("{buses} {plain} --neighbours 0"));
        let settings = &report["settings"];
        assert_eq!(
            (&settings["buses"], &settings["gap_us"]),
            (&count.into(), &gap_us.into())
        );
        let pass = &report["passes"][0];
        assert_eq!(pass["wait"], "sleep", "by default");
        assert_accounted(pass);
        assert!(count_of(&pass["frame_in_kernel_to_ready"]) > 0, "{pass}");
        assert!(pass["busy"]["time_ms"].as_u64() > Some(0), "{pass}");
        let is_worth_it = pass["objections"].as_array().unwrap().is_empty();
        assert_eq!(table.contains("worth comparing"), is_worth_it, "{table}");
        if has_compiler {
            let frames = count_of(&pass["plain_program"]);
            let sent = pass["floors_sent"].as_u64().unwrap();
            assert!((sent / 2..=sent).contains(&frames), "{pass}");
            assert!(table.contains("plain program in C"), "{table}");
        } else {
            assert!(pass["plain_program"].is_null(), "{pass}");
        }
    }
}

#[test]
fn too_few_frames_have_no_percentiles() {
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("latency.json");
    let output = latency(
        "--can local --rate 2 --seconds 1 --wait sleep",
        &[("--json", &json)],
    );
    assert!(output.status.success(), "{output:?}");
    let report: Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    let pass = &report["passes"][0];
    for durations in [
        "frame_due_to_estimate",
        "frame_in_kernel_to_estimate",
        "floor_frame_read",
    ] {
        assert!(pass[durations]["p99_ns"].is_null(), "{pass}");
    }
    assert!(pass["ratio_to_floors"]["p99"].is_null(), "{pass}");
    let table = String::from_utf8(output.stdout).unwrap();
    let row = table
        .lines()
        .find(|line| line.starts_with("floor: frame read"))
        .unwrap();
    assert!(row.contains('–') && !row.contains("0.00"), "{row}");
}

#[test]
fn the_figures_agree_with_one_another() {
    let (_, report) = found("--wait sleep --neighbours 0");
    let pass = &report["passes"][0];
    let ns = |durations: &Value, name: &str| durations[name].as_u64();
    let whole = &pass["frame_due_to_estimate"];
    let order = ["p50_ns", "p90_ns", "p99_ns", "max_ns"].map(|name| ns(whole, name).unwrap());
    assert!(order.is_sorted(), "{whole}");
    assert_eq!(ns(whole, "p99_9_ns"), None, "of 200 frames");
    for (name, stage) in pass["stages"].as_object().unwrap() {
        assert!(ns(stage, "p50_ns") <= ns(whole, "max_ns"), "{name}: {pass}");
    }
    assert_eq!(report["settings"]["neighbours"], 0);
    assert_eq!(report["settings"]["can"], "local");
}

#[test]
fn the_picture_shows_the_daemon_and_its_floors() {
    let folder = tempfile::tempdir().unwrap();
    let svg = folder.path().join("latency.svg");
    let output = latency("--can local --seconds 1 --wait sleep", &[("--plot", &svg)]);
    assert!(output.status.success(), "{output:?}");
    let picture = std::fs::read_to_string(svg).unwrap();
    for curve in [
        "frame to estimate, sleeping",
        "floor: frame read",
        "floor: transport",
    ] {
        assert!(picture.contains(curve), "{curve}");
    }
}

/// At three moments of its life: floors of the bus, floors of the transport, the daemon.
#[test]
fn an_interruption_ends_it_in_order() {
    for (signal, number, moment) in [
        ("INT", 2, ""),
        ("QUIT", 3, "shm/services"),
        ("TERM", 15, "robot1.toml"),
        ("HUP", 1, "robot1.log"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_coloc"));
        command.args(["latency", "--can", "local", "--seconds", "6"]);
        command.env("TMPDIR", folder.path());
        let piped = || std::process::Stdio::piped();
        let child = command.stdout(piped()).stderr(piped()).spawn().unwrap();
        let home = wait_for(|| only_entry(folder.path()).filter(|home| home.join(moment).exists()));
        let kill = Command::new("kill")
            .args([format!("-{signal}"), child.id().to_string()])
            .status();
        assert!(kill.unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(128 + number), "{output:?}");
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            said.contains("coloc: interrupted: ") && output.stdout.is_empty(),
            "{said}"
        );
        assert_eq!(only_entry(folder.path()), None, "{signal}");
        assert_eq!(
            shared_memory_of(&home.join("shm")),
            Vec::<PathBuf>::new(),
            "{signal}"
        );
    }
}

fn only_entry(folder: &Path) -> Option<PathBuf> {
    std::fs::read_dir(folder)
        .unwrap()
        .next()
        .map(|entry| entry.unwrap().path())
}

fn wait_for<T>(mut ask: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(Instant::now() < deadline);
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Files in `/dev/shm` of the shared-memory space at `root`: they carry the hash (FNV-1a) of its path.
fn shared_memory_of(root: &Path) -> Vec<PathBuf> {
    let bytes = root.to_str().unwrap().bytes();
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    let files = std::fs::read_dir("/dev/shm")
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let ours = |path: &PathBuf| path.to_str().unwrap().contains(&format!("{hash:016x}"));
    files.filter(ours).collect()
}

/// A person names TMPDIR, not what is below it.
#[test]
fn a_temporary_directory_that_will_not_do_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in ["größe", &"long".repeat(20)] {
        std::fs::create_dir(at(name)).unwrap();
    }
    for command in ["demo --seconds 600", "latency --can local --seconds 600"] {
        for name in ["missing", "größe", &"long".repeat(20)] {
            let output = Command::new(env!("CARGO_BIN_EXE_coloc"))
                .args(command.split_whitespace())
                .env("TMPDIR", at(name))
                .current_dir(folder.path())
                .output()
                .unwrap();
            let said = String::from_utf8(output.stderr).unwrap();
            let begin = format!("coloc: cannot work in {}: ", at(name).display());
            let is_sentence =
                said.starts_with(&begin) && said.contains("TMPDIR") && said.lines().count() == 1;
            assert!(is_sentence && output.stdout.is_empty(), "{command}: {said}");
            assert_eq!(output.status.code(), Some(1));
        }
    }
}

#[test]
fn what_cannot_be_is_said() {
    for (arguments, complaint) in [
        ("--rate 0", "1 to 1000"),
        ("--neighbours 65", "0..=64"),
        ("--seconds 0", "seconds"),
        (
            "--can local --seconds 1 --wait sleep --plot /nonexistent/a.svg",
            "/nonexistent",
        ),
    ] {
        let output = latency(arguments, &[]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            !output.status.success() && said.contains(complaint),
            "{arguments}: {said}"
        );
    }
}
