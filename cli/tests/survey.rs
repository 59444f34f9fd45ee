//! A drive past landmarks, as its daemon would have recorded it, and what `coloc survey` makes of it.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;
use std::process::{Command, Output};

use coloc_daemon::config::Config;
use coloc_daemon::record::{Record, Step, of_inputs};
use coloc_estimator::partial::{BodySighting, Reading, ReadingNoise};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimate, LandmarkSighting, Measurement, Motion,
    OdometrySample, Origin, Pose, PositionFix, SlowError, Stamp, Start, TickInputs,
};
use coloc_sim::random::{Draws, Noise, Purpose};

const CONFIG: &str = "[robot]\nname = \"robot1\"\nid = 1\n";

/// Where they stand; the last one is seen for two seconds only.
const LANDMARKS: [(u16, [f64; 2]); 4] = [
    (6, [3.0, 1.0]),
    (7, [-2.0, 3.0]),
    (8, [0.5, -3.0]),
    (9, [-3.0, -2.0]),
];

const TICKS: u64 = 600;
const TICK_S: f64 = 0.2;

fn stamp(tick: u64) -> Stamp {
    Stamp::from_nanos(i64::try_from(tick * 200_000_000).unwrap())
}

/// Round a circle of 2 m in half a minute.
#[allow(clippy::cast_precision_loss)] // Some hundred.
fn truth(tick: u64) -> Pose {
    let angle = 0.2 * TICK_S * tick as f64;
    let (sin, cos) = angle.sin_cos();
    Pose::new(2.0 * cos, 2.0 * sin, angle + std::f64::consts::FRAC_PI_2)
}

fn odometry(tick: u64) -> Measurement {
    Measurement::Odometry(OdometrySample {
        source: 0,
        start: stamp(tick - 1),
        stamp: stamp(tick),
        motion: Motion::Nonholonomic {
            velocity: [0.4, 0.2],
            noise: Covariance2::diagonal([0.05, 0.1]).unwrap(),
        },
    })
}

fn fix(tick: u64, pose: &Pose, draws: &mut Draws) -> Measurement {
    let [x, y, _] = draws.normals();
    Measurement::Fix(PositionFix {
        stamp: stamp(tick),
        origin: Origin::counted(tick),
        position: [pose.x + 0.05 * x, pose.y + 0.05 * y],
        covariance: Covariance2::diagonal([0.0025; 2]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    })
}

fn seen(
    tick: u64,
    pose: &Pose,
    (landmark, [x, y]): (u16, [f64; 2]),
    draws: &mut Draws,
) -> Measurement {
    let noise = ReadingNoise {
        white: [4e-4, 1e-4],
        slow: [0.0, 0.0],
    };
    let [along, across, _] = draws.normals();
    let (dx, dy) = (x - pose.x, y - pose.y);
    let (range, bearing) = (
        dx.hypot(dy) + 0.02 * along,
        dy.atan2(dx) - pose.phi + 0.01 * across,
    );
    Measurement::Landmark(LandmarkSighting {
        stamp: stamp(tick),
        origin: Origin::counted(tick),
        landmark,
        reading: Reading::Place(BodySighting::of(range, bearing, &Pose::default(), &noise)),
        position: [0.0; 2],
        covariance: Covariance2::diagonal([1e12; 2]).unwrap(),
    })
}

/// Writes the drive, with what is seen of landmarks if there are any.
fn record(folder: &Path, landmarks: &[(u16, [f64; 2])]) {
    let noise = Noise::new(1, 0);
    let mut records = vec![Record::begin(1, 0, &Start::Unknown, None)];
    for tick in 1..TICKS {
        let pose = truth(tick);
        let step = usize::try_from(tick).unwrap();
        let mut measurements = vec![odometry(tick)];
        if tick % 5 == 0 {
            measurements.push(fix(tick, &pose, &mut noise.draws(Purpose::Fix, step, 0, 0)));
            let brief = |number: u16| number == 9 && tick > 10;
            for (index, it) in landmarks.iter().enumerate().filter(|(_, it)| !brief(it.0)) {
                let mut draws = noise.draws(Purpose::RelativePose, step, 0, index);
                measurements.push(seen(tick, &pose, *it, &mut draws));
            }
        }
        let inputs = TickInputs {
            stamp: stamp(tick),
            measurements: &measurements,
        };
        records.extend(of_inputs(tick - 1, Step::Own, &inputs));
        let covariance = Covariance3::diagonal([0.01, 0.01, 0.01]).unwrap();
        records.push(Record::from(&Estimate {
            stamp: inputs.stamp,
            belief: Belief::independent(
                Pose::new(pose.x + 0.05, pose.y - 0.05, pose.phi + 0.05),
                covariance,
            ),
            ..Estimate::default()
        }));
    }
    let lines = records
        .iter()
        .map(|it| serde_json::to_string(it).unwrap() + "\n");
    std::fs::write(folder.join("drive.jsonl"), lines.collect::<String>()).unwrap();
    std::fs::write(folder.join("robot.toml"), CONFIG).unwrap();
}

fn survey(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_coloc"));
    command.args(["survey", "drive.jsonl"]).args(words);
    command.current_dir(folder).output().unwrap()
}

#[test]
fn what_is_written_is_where_they_stand_and_the_daemon_takes_it() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), &LANDMARKS);
    let output = survey(folder.path(), &["--write", "found.toml"]);
    assert!(output.status.success(), "{output:?}");
    assert!(output.stderr.is_empty(), "no bar in a file: {output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("9 is left out: 2 sightings agree, 10 are needed"),
        "{said}"
    );
    let found = std::fs::read_to_string(folder.path().join("found.toml")).unwrap();
    let whole = format!("{CONFIG}[sighting]\nheard = true\n{found}");
    let config = Config::parse(&whole, Path::new("found.toml")).unwrap();
    assert_eq!(config.landmark.len(), 3, "{found}");
    for (landmark, (number, [x, y])) in config.landmark.iter().zip(LANDMARKS) {
        let off = (landmark.position[0] - x).hypot(landmark.position[1] - y);
        assert_eq!(landmark.number, number);
        assert!(
            off < 4.0 * landmark.sigma_m && landmark.sigma_m < 0.05,
            "{landmark:?}"
        );
    }
    let again = survey(folder.path(), &["--write", "found.toml"]);
    assert_eq!(again.status.code(), Some(1), "nothing is overwritten");
    assert!(again.stdout.is_empty(), "nothing is computed in vain");
    let said = String::from_utf8(again.stderr).unwrap();
    assert!(said.contains("found.toml: it is there already"), "{said}");
    let said = refusal(folder.path(), &["--receiver", "9"]);
    assert!(
        said.contains("receiver 9 has no fixes") && said.contains("there is 0"),
        "{said}"
    );
    let said = refusal(folder.path(), &["--sensor", "9"]);
    assert!(said.contains("sensor 9 has no sightings"), "{said}");
}

fn refusal(folder: &Path, words: &[&str]) -> String {
    let output = survey(folder, words);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn a_recording_with_gaps_says_so() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), &LANDMARKS);
    let path = folder.path().join("drive.jsonl");
    let text = std::fs::read_to_string(&path).unwrap();
    let halved = |(at, line): (usize, &str)| {
        let end = if at % 40 == 39 {
            line.len() / 2
        } else {
            line.len()
        };
        format!("{}\n", &line[..end])
    };
    std::fs::write(
        &path,
        text.lines().enumerate().map(halved).collect::<String>(),
    )
    .unwrap();
    let output = survey(folder.path(), &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("the recording has gaps"), "{said}");
}

#[test]
fn a_drive_that_shows_nothing_says_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), &[]);
    let output = survey(folder.path(), &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said.contains("no landmark was seen") && said.contains("[[landmark]]"),
        "{said}"
    );
    record(folder.path(), &LANDMARKS[3..]);
    let output = survey(folder.path(), &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(said.contains("no landmark was seen well enough"), "{said}");
}
