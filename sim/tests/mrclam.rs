//! The recordings are read rightly: dead reckoning gives the figures of their descriptions.

use std::path::PathBuf;

use coloc_sim::dead_reckoning::{RmsError, euler, held_arcs};
use coloc_sim::mrclam::Recording;
use coloc_sim::world::World;

/// `COLOC_DATA`, or `../shared/data` of this folder or of one above it.
fn recording(name: &str) -> Option<Recording> {
    let found = std::env::var_os("COLOC_DATA")
        .map(PathBuf::from)
        .or_else(|| {
            let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
            here.ancestors()
                .map(|folder| folder.join("../shared/data"))
                .find(|folder| folder.is_dir())
        });
    let Some(folder) = found
        .map(|data| data.join(name))
        .filter(|folder| folder.is_dir())
    else {
        eprintln!("SKIPPED: no recording {name}; set COLOC_DATA to the folder that holds it");
        return None;
    };
    Some(Recording::load(&folder).expect("a well-formed recording"))
}

/// As the descriptions were made: straight lines over every gap of the truth.
fn held(recording: &Recording) -> Vec<RmsError> {
    let world = recording.resample_bridging(f64::INFINITY);
    let robots = recording.robots.iter().enumerate();
    robots
        .map(|(robot, record)| held_arcs(record, &world, robot))
        .collect()
}

fn assert_table(found: &[RmsError], table: &[[f64; 3]]) {
    assert_eq!(found.len(), table.len());
    for (robot, (found, expected)) in found.iter().zip(table).enumerate() {
        let found = [found.x_m, found.y_m, found.phi_rad];
        let close = found
            .iter()
            .zip(expected)
            .all(|(found, expected)| (found - expected).abs() <= 0.001);
        assert!(close, "R{}: {found:.4?}, stated {expected:?}", robot + 1);
    }
}

const MRCLAM1_HELD: [[f64; 3]; 5] = [
    [3.664, 3.513, 2.213],
    [3.404, 2.945, 1.098],
    [5.108, 3.727, 1.966],
    [1.574, 0.527, 0.504],
    [3.616, 5.024, 1.090],
];
const MRCLAM1_EULER: [[f64; 3]; 5] = [
    [3.566, 3.382, 2.200],
    [2.669, 3.630, 1.278],
    [5.331, 3.815, 2.096],
    [1.348, 0.583, 0.456],
    [3.182, 5.008, 1.178],
];
const MRCLAM6_HELD: [[f64; 3]; 5] = [
    [1.713, 2.003, 1.229],
    [1.232, 2.732, 1.665],
    [3.783, 1.955, 1.744],
    [1.294, 1.331, 0.801],
    [1.319, 1.127, 0.713],
];

#[test]
fn held_odometry_of_recording_1() {
    let Some(recording) = recording("mrclam1") else {
        return;
    };
    assert_table(&held(&recording), &MRCLAM1_HELD);
}

#[test]
fn gridded_odometry_of_recording_1() {
    let Some(recording) = recording("mrclam1") else {
        return;
    };
    let world = recording.resample();
    assert_eq!((world.steps(), world.robots()), (75_000, 5));
    assert_table(
        &(0..5).map(|robot| euler(&world, robot)).collect::<Vec<_>>(),
        &MRCLAM1_EULER,
    );
}

#[test]
fn our_grid_is_the_published_one() {
    let Some(mut recording) = recording("mrclam1") else {
        return;
    };
    let given = recording.resample();
    recording
        .robots
        .iter_mut()
        .for_each(|robot| robot.odometry_50hz = None);
    let made = recording.resample();
    assert!((made.start_s() - given.start_s()).abs() < 1e-6);
    for robot in 0..5 {
        let differs = |step: &usize| {
            let [a, b] = [made.odometry(*step, robot), given.odometry(*step, robot)];
            (a[0] - b[0]).abs() > 2e-5 || (a[1] - b[1]).abs() > 2e-5
        };
        let different = (0..given.steps()).filter(differs).count();
        assert!(
            different <= 20,
            "R{}: {different} of 75000 rows differ",
            robot + 1
        );
    }
}

#[test]
fn held_odometry_of_recording_6() {
    let Some(recording) = recording("mrclam6") else {
        return;
    };
    assert_table(&held(&recording), &MRCLAM6_HELD);
}

#[test]
fn lost_tracking_in_recording_6_is_not_made_up() {
    let Some(recording) = recording("mrclam6") else {
        return;
    };
    let world = recording.resample();
    assert_eq!(world.steps(), 45_001);
    let last = |robot| {
        (0..world.steps())
            .rev()
            .find(|&step| world.truth(step, robot).is_some())
    };
    assert_eq!(last(0), Some(38_593), "R1's truth ends at 771.9 s");
    let unknown = (0..world.steps())
        .filter(|&step| world.truth(step, 3).is_none() && Some(step) < last(3))
        .count();
    assert!(
        (125..=130).contains(&unknown),
        "R4's gaps of 2.03 s and 0.56 s: {unknown} steps"
    );
}

#[test]
fn measurements_and_landmarks_are_all_there() {
    let Some(recording) = recording("mrclam1") else {
        return;
    };
    let counts: Vec<usize> = recording
        .robots
        .iter()
        .map(|robot| robot.measurements.len())
        .collect();
    assert_eq!(counts, [5723, 6699, 8742, 3991, 8792]);
    assert_eq!(
        (recording.landmarks.len(), recording.barcodes.len()),
        (15, 20)
    );
    let sees = |robot: usize, subjects: std::ops::RangeInclusive<u32>| {
        let seen = recording.robots[robot]
            .measurements
            .iter()
            .filter_map(|seen| recording.barcodes.get(&seen.barcode));
        seen.filter(|subject| subjects.contains(subject)).count()
    };
    assert_eq!((sees(0, 6..=20), sees(0, 1..=5)), (4771, 952));
}
