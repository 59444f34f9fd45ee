//! A drive whose truth is known, as its daemon would have recorded it, and what `coloc calibrate` says of it.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;
use std::process::{Command, Output};

use coloc_calibrate::{Robot, State, Way};
use coloc_daemon::config::Config;
use coloc_daemon::record::{Record, Step, of_inputs};
use coloc_estimator::{
    Covariance2, Estimate, GyroSample, Measurement, Motion, OdometrySample, Origin, PositionFix,
    SlowError, Span, Stamp, Start, TickInputs,
};
use coloc_sim::calibrate::{Course, drive};

const CONFIG: &str = r#"
[robot]
name = "robot1"
id = 1
[odometry]
buses = ["socketcan:can0"]
max_speed_mps = 4.0
[odometry.wheels]
track_m = 0.5
left = { message = "WheelLeft", signal = "Ticks", metres_per_tick = 1e-4 }
right = { message = "WheelRight", signal = "Ticks", metres_per_tick = 1e-4 }
[motion]
creep_per_hour = [3.0, 3.0, 0.06]
[position]
delay_s = 0.1
"#;

/// As good as that of the robots that drive.
const GYRO: &str =
    "[gyro]\nsource = \"channel\"\nrate_hz = 10\nnoise_density = 1.7e-3\nscale = 1.25\n";

fn stamp(seconds: f64) -> Stamp {
    #[allow(clippy::cast_possible_truncation)] // Minutes.
    Stamp::from_nanos((seconds * 1e9).round() as i64)
}

/// As the daemon makes it of what the wheels read.
fn sample(way: &Way, config: &Config) -> OdometrySample {
    let dt_s = way.end_s - way.start_s;
    let [left, right] = way.read;
    let velocity = [0.5 * (left + right) / dt_s, (right - left) / 0.5 / dt_s];
    OdometrySample {
        source: 0,
        start: stamp(way.start_s),
        stamp: stamp(way.end_s),
        motion: match way.state {
            State::Standing => Motion::standstill(config.motion.creep_variance()),
            _ => config.motion.noise().nonholonomic(velocity),
        },
    }
}

/// Writes a drive, and says who drove.
fn record(course: &Course, folder: &Path) -> Robot {
    let text = if course.gyro {
        format!("{CONFIG}{GYRO}")
    } else {
        CONFIG.to_owned()
    };
    let config = Config::parse(&text, Path::new("robot.toml")).unwrap();
    let (robot, drive) = drive(course, 1, 0);
    let mut fixes = drive.fixes().iter().zip(1..).peekable();
    let mut records = vec![Record::begin(1, 0, &Start::Unknown, None)];
    for (tick, way) in drive.ways().iter().enumerate() {
        let mut measurements = vec![Measurement::Odometry(sample(way, &config))];
        while let Some((fix, sequence)) = fixes.next_if(|(fix, _)| fix.stamp_s <= way.end_s) {
            measurements.push(Measurement::Fix(PositionFix {
                stamp: stamp(fix.stamp_s),
                origin: Origin {
                    source: 3,
                    session: 1,
                    sequence,
                },
                position: fix.position,
                covariance: Covariance2::diagonal([4e-4; 2]).unwrap(),
                lever: [0.0; 2],
                slow: SlowError {
                    variance: 0.0,
                    memory: Span::ZERO,
                },
            }));
        }
        measurements.extend(way.gyro.map(|turned| {
            Measurement::Gyro(GyroSample {
                stamp: stamp(way.end_s),
                rate_radps: turned / (way.end_s - way.start_s),
                ..GyroSample::default()
            })
        }));
        let inputs = TickInputs {
            stamp: stamp(way.end_s),
            measurements: &measurements,
        };
        records.extend(of_inputs(tick as u64, Step::Own, &inputs));
        records.push(Record::from(&Estimate {
            stamp: inputs.stamp,
            ..Estimate::default()
        }));
    }
    let lines = records
        .iter()
        .map(|it| serde_json::to_string(it).unwrap() + "\n");
    std::fs::write(folder.join("drive.jsonl"), lines.collect::<String>()).unwrap();
    std::fs::write(folder.join("robot.toml"), text).unwrap();
    robot
}

fn calibrate(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_coloc"))
        .args(["calibrate", "drive.jsonl"])
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// The configuration is looked for beside the recording: where there is none, neither is it.
#[test]
fn a_recording_that_is_not_there_is_what_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let output = calibrate(folder.path(), &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("drive.jsonl"), "{said}");
    assert!(!said.contains("robot.toml"), "{said}");
}

fn without_gyro() -> Course {
    Course {
        gyro: false,
        ..Course::whole()
    }
}

#[test]
fn what_is_written_is_the_robot_that_drove() {
    let folder = tempfile::tempdir().unwrap();
    let truth = record(&without_gyro(), folder.path());
    let output = calibrate(folder.path(), &["--write", "found.toml"]);
    assert!(output.status.success(), "{output:?}");
    assert!(output.stderr.is_empty(), "no bar in a file: {output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    for words in [
        "What the drive shows",
        "The last third",
        "independent ones",
        "antenna ahead by",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let found = std::fs::read_to_string(folder.path().join("found.toml")).unwrap();
    let rest = "[robot]\nname = \"robot1\"\nid = 1\n[odometry]\nbuses = [\"socketcan:can0\"]\nmax_speed_mps = 4.0\n";
    let whole = format!("{rest}{found}");
    let config = Config::parse(&whole, Path::new("found.toml")).unwrap();
    let wheels = config.odometry.unwrap().wheels.unwrap();
    let track = truth.wheels.span_m;
    assert!(
        (wheels.track_m - track).abs() < 0.02 * track,
        "{} {track}",
        wheels.track_m
    );
    let metres = [&wheels.left, &wheels.right].map(|it| it.metres_per_tick.unwrap() / 1e-4);
    for (found, factor) in metres.into_iter().zip(truth.wheels.factors()) {
        assert!((found - factor).abs() < 0.01, "{found} {factor}");
    }
    let again = calibrate(folder.path(), &["--write", "found.toml"]);
    assert_eq!(again.status.code(), Some(1), "nothing is overwritten");
    let refusal = String::from_utf8(again.stderr).unwrap();
    assert!(
        refusal.starts_with("coloc: cannot write found.toml: "),
        "{refusal}"
    );
}

/// The daemon has multiplied what the sensor reads by the scale that was configured, and taken the stamps for late already.
#[test]
fn gyro_and_receiver_are_written_on_top_of_what_was_configured() {
    let folder = tempfile::tempdir().unwrap();
    let truth = record(&Course::whole(), folder.path());
    let output = calibrate(folder.path(), &["--write", "found.toml"]);
    assert!(output.status.success(), "{output:?}");
    let found = std::fs::read_to_string(folder.path().join("found.toml")).unwrap();
    let rest = "[robot]\nname = \"robot1\"\nid = 1\n[odometry]\nbuses = [\"socketcan:can0\"]\nmax_speed_mps = 4.0\n";
    let config = Config::parse(&format!("{rest}{found}"), Path::new("found.toml")).unwrap();
    let (gyro, own) = (&config.gyro, truth.gyro.unwrap());
    let near = |found: f64, truth: f64, within: f64| {
        assert!((found - truth).abs() < within, "{found} is not {truth}");
    };
    near(gyro.scale, 1.25 * own.scale, 0.005);
    near(gyro.bias_radps, own.bias_radps / 1.25, 1e-3);
    near(gyro.noise_density, own.per_s.sqrt(), 0.2 * own.per_s.sqrt());
    let (position, own) = (&config.position, truth.receivers[0]);
    near(position.delay_s, 0.1 + own.delay_s, 0.03);
    near(position.lever_m[0], own.lever_m[0], 0.05);
    near(position.lever_m[1], own.lever_m[1], 0.05);
    near(
        position.slow_sigma_m,
        own.slow_sigma_m,
        0.5 * own.slow_sigma_m,
    );
    near(position.slow_time_s, own.slow_time_s, own.slow_time_s);
}

#[test]
fn a_drive_without_fixes_shows_nothing_and_names_the_one_that_does() {
    let folder = tempfile::tempdir().unwrap();
    record(&Course::alone(), folder.path());
    let output = calibrate(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("with fixes, drive 100 m"), "{said}");
    let refusal = String::from_utf8(output.stderr).unwrap();
    assert!(refusal.contains("shows nothing"), "{refusal}");
}

#[test]
fn what_cannot_be_read_is_said() {
    let folder = tempfile::tempdir().unwrap();
    record(&Course::alone(), folder.path());
    std::fs::remove_file(folder.path().join("robot.toml")).unwrap();
    let output = calibrate(folder.path(), &[]);
    let refusal = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.code() == Some(1) && refusal.contains("robot.toml"),
        "{refusal}"
    );
}
