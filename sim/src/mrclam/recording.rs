//! A recording as it was written: every row of every file.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::table::{ReadError, ReadErrorKind, find, require, rows, timed_rows};

/// Velocity at a moment.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct OdometryRow {
    /// Seconds since 1970.
    pub time_s: f64,
    /// `[v, ω]` \[m/s, rad/s\].
    pub velocity: [f64; 2],
}

/// True pose at a moment.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct TruthRow {
    /// Seconds since 1970.
    pub time_s: f64,
    /// `[x, y, φ]` \[m, m, rad\].
    pub pose: [f64; 3],
}

/// The camera's sighting of a barcode.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Seconds since 1970; sightings of one image share it.
    pub time_s: f64,
    /// The number on the tube; [`Recording::barcodes`] says whose it is. Misread ones belong to nobody.
    pub barcode: u32,
    /// \[m\]
    pub range_m: f64,
    /// Counter-clockwise from the robot's forward axis.
    pub bearing_rad: f64,
}

/// A tube that stands still.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Landmark {
    /// Subject number.
    pub subject: u32,
    /// `[x, y]` \[m\].
    pub position: [f64; 2],
}

/// Everything recorded of one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotRecord {
    /// The N of its files, which is its subject number.
    pub number: u32,
    /// Rows as logged, about 67 Hz, with drop-outs; some share a time.
    pub odometry: Vec<OdometryRow>,
    /// Rows of the `_50Hz` file, where there is one.
    pub odometry_50hz: Option<Vec<OdometryRow>>,
    /// Rows of the true pose, with gaps.
    pub truth: Vec<TruthRow>,
    /// Rows of the camera; empty where the file is missing.
    pub measurements: Vec<Measurement>,
}

/// A folder of MR.CLAM files.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// In ascending number.
    pub robots: Vec<RobotRecord>,
    /// Barcode to subject number; empty where the file is missing.
    pub barcodes: BTreeMap<u32, u32>,
    /// As published: dataset 1 swaps landmarks 11 and 17. Empty where the file is missing.
    pub landmarks: Vec<Landmark>,
}

impl Recording {
    /// Reads the recording in `folder`. Odometry and truth of at least one robot must be there.
    ///
    /// # Errors
    /// What is missing or malformed, naming file and line.
    pub fn load(folder: &Path) -> Result<Self, ReadError> {
        let numbers = robot_numbers(folder)?;
        Ok(Self {
            robots: numbers
                .into_iter()
                .map(|number| robot(folder, number))
                .collect::<Result<_, _>>()?,
            barcodes: barcodes(folder)?,
            landmarks: landmarks(folder)?,
        })
    }
}

fn robot_numbers(folder: &Path) -> Result<Vec<u32>, ReadError> {
    let entries = fs::read_dir(folder).map_err(|error| ReadError::in_file(folder, error))?;
    let names = entries
        .filter_map(Result::ok)
        .map(|entry| entry.file_name());
    let mut numbers: Vec<u32> = names
        .filter_map(|name| robot_number(name.to_str()?))
        .collect();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.is_empty() {
        Err(ReadError::in_file(folder, ReadErrorKind::NoRobots))
    } else {
        Ok(numbers)
    }
}

fn robot_number(name: &str) -> Option<u32> {
    let name = name.strip_suffix(".gz").unwrap_or(name);
    name.strip_prefix("Robot")?
        .strip_suffix("_Odometry.dat")?
        .parse()
        .ok()
}

fn robot(folder: &Path, number: u32) -> Result<RobotRecord, ReadError> {
    let gridded = find(folder, &format!("Robot{number}_Odometry_50Hz.dat"));
    Ok(RobotRecord {
        number,
        odometry: odometry(&require(folder, &format!("Robot{number}_Odometry.dat"))?)?,
        odometry_50hz: gridded.map(|path| odometry(&path)).transpose()?,
        truth: truth(&require(folder, &format!("Robot{number}_Groundtruth.dat"))?)?,
        measurements: measurements(folder, number)?,
    })
}

fn odometry(path: &Path) -> Result<Vec<OdometryRow>, ReadError> {
    let rows = timed_rows::<3>(path)?;
    Ok(rows
        .into_iter()
        .map(|[time_s, v, omega]| OdometryRow {
            time_s,
            velocity: [v, omega],
        })
        .collect())
}

fn truth(path: &Path) -> Result<Vec<TruthRow>, ReadError> {
    let rows = timed_rows::<4>(path)?;
    Ok(rows
        .into_iter()
        .map(|[time_s, x, y, phi]| TruthRow {
            time_s,
            pose: [x, y, phi],
        })
        .collect())
}

fn measurements(folder: &Path, number: u32) -> Result<Vec<Measurement>, ReadError> {
    let Some(path) = find(folder, &format!("Robot{number}_Measurement.dat")) else {
        return Ok(Vec::new());
    };
    let measurement = |(line, [time_s, barcode, range_m, bearing_rad]): (usize, [f64; 4])| {
        let barcode = code(&path, line, barcode)?;
        Ok(Measurement {
            time_s,
            barcode,
            range_m,
            bearing_rad,
        })
    };
    rows::<4>(&path)?.into_iter().map(measurement).collect()
}

fn barcodes(folder: &Path) -> Result<BTreeMap<u32, u32>, ReadError> {
    let Some(path) = find(folder, "Barcodes.dat") else {
        return Ok(BTreeMap::new());
    };
    let pair = |(line, [subject, barcode]): (usize, [f64; 2])| {
        Ok((code(&path, line, barcode)?, code(&path, line, subject)?))
    };
    rows::<2>(&path)?.into_iter().map(pair).collect()
}

fn landmarks(folder: &Path) -> Result<Vec<Landmark>, ReadError> {
    let Some(path) = find(folder, "Landmark_Groundtruth.dat") else {
        return Ok(Vec::new());
    };
    let landmark = |(line, [subject, x, y]): (usize, [f64; 3])| {
        Ok(Landmark {
            subject: code(&path, line, subject)?,
            position: [x, y],
        })
    };
    rows::<3>(&path)?.into_iter().map(landmark).collect()
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Checked to be a whole number in range.
fn code(path: &Path, line: usize, number: f64) -> Result<u32, ReadError> {
    if number.fract() == 0.0 && (0.0..1e6).contains(&number) {
        return Ok(number as u32);
    }
    Err(ReadError::on_line(path, line, ReadErrorKind::Code(number)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        folder
    }

    #[test]
    fn robots_are_found_by_their_files() {
        let folder = folder(&[
            ("Robot12_Odometry.dat", "0 0.1 0\n"),
            ("Robot12_Groundtruth.dat", "0 1 2 3\n"),
            ("Robot3_Odometry.dat", "0 0.1 0\n"),
            ("Robot3_Groundtruth.dat", "0 1 2 3\n"),
            ("Robot3_Measurement.dat", "0 5 1.5 -0.1\n"),
            ("Barcodes.dat", "12 5\n"),
        ]);
        let recording = Recording::load(folder.path()).expect("a recording");
        assert_eq!(
            recording
                .robots
                .iter()
                .map(|robot| robot.number)
                .collect::<Vec<_>>(),
            [3, 12]
        );
        assert_eq!(
            recording.barcodes[&recording.robots[0].measurements[0].barcode],
            12
        );
    }

    #[test]
    fn what_is_missing_is_named() {
        let empty = folder(&[]);
        let error = Recording::load(empty.path())
            .expect_err("empty")
            .to_string();
        assert!(error.contains("not an MR.CLAM recording"), "{error}");
        let half = folder(&[("Robot1_Odometry.dat", "0 0 0\n")]);
        let error = Recording::load(half.path())
            .expect_err("no truth")
            .to_string();
        assert!(
            error.contains("Robot1_Groundtruth.dat (or Robot1_Groundtruth.dat.gz) is missing"),
            "{error}"
        );
    }

    #[test]
    fn a_barcode_that_is_no_whole_number_is_refused() {
        let folder = folder(&[
            ("Robot1_Odometry.dat", "0 0 0\n"),
            ("Robot1_Groundtruth.dat", "0 0 0 0\n"),
            ("Robot1_Measurement.dat", "0 5.5 1 0\n"),
        ]);
        let error = Recording::load(folder.path())
            .expect_err("half a barcode")
            .to_string();
        assert!(
            error.ends_with("Robot1_Measurement.dat:1: 5.5 is not a subject or barcode number"),
            "{error}"
        );
    }
}
