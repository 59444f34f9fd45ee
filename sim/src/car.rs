//! One minute of a real car: its rear wheels, a satellite receiver, and a reference (comma2k19's example, recorded by comma.ai).

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use coloc_calibrate::{Fix, State, Way};
use flate2::read::GzDecoder;

/// What was recorded, in metres east and north of where the reference begins, and in seconds since then.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Car {
    /// Of the rear wheels, by their speeds.
    pub ways: Vec<Way>,
    /// Of the receiver, its stamps being when they were computed.
    pub fixes: Vec<Fix>,
    /// How long each fix then took to arrive \[s\].
    pub took_s: Vec<f64>,
    /// The reference, by time.
    pub reference: Vec<Sample>,
}

/// Where the car was.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// \[s\]
    pub time_s: f64,
    /// East and north \[m\].
    pub position: [f64; 2],
    /// \[m/s\]
    pub velocity: [f64; 2],
}

/// Why there is none.
#[derive(Debug, thiserror::Error)]
pub enum CarError {
    /// Of the operating system.
    #[error("{0}: {1}")]
    Unreadable(&'static str, io::Error),
    /// A line that is not as it should be.
    #[error("{0}:{1}: not {2} numbers")]
    Malformed(&'static str, usize, usize),
}

/// WGS 84 \[m\].
const SEMI_MAJOR_M: f64 = 6_378_137.0;
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;

/// The plane that touches the earth at a point.
#[derive(Copy, Clone, Debug)]
struct Plane {
    origin: [f64; 3],
    east: [f64; 3],
    north: [f64; 3],
}

impl Plane {
    /// At a point given in earth-centred coordinates.
    fn at(origin: [f64; 3]) -> Self {
        let [x, y, z] = origin;
        let longitude = y.atan2(x);
        let across = x.hypot(y);
        // Bowring's first step is right to a micrometre near the ground.
        let reduced = (z / (across * (1.0 - ECCENTRICITY_SQUARED).sqrt())).atan();
        let other = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED);
        let minor = SEMI_MAJOR_M * (1.0 - ECCENTRICITY_SQUARED).sqrt();
        let latitude = (z + other * minor * reduced.sin().powi(3))
            .atan2(across - ECCENTRICITY_SQUARED * SEMI_MAJOR_M * reduced.cos().powi(3));
        let ((sin, cos), (below, beside)) = (latitude.sin_cos(), longitude.sin_cos());
        Self {
            origin,
            east: [-below, beside, 0.0],
            north: [-sin * beside, -sin * below, cos],
        }
    }

    fn turned(&self, way: [f64; 3]) -> [f64; 2] {
        [self.east, self.north].map(|axis| (0..3).map(|it| axis[it] * way[it]).sum())
    }

    fn on(&self, point: [f64; 3]) -> [f64; 2] {
        self.turned([0, 1, 2].map(|it| point[it] - self.origin[it]))
    }
}

/// Earth-centred, of degrees and metres.
fn earth_centred(latitude: f64, longitude: f64, altitude: f64) -> [f64; 3] {
    let ((sin, cos), (below, beside)) = (
        latitude.to_radians().sin_cos(),
        longitude.to_radians().sin_cos(),
    );
    let radius = SEMI_MAJOR_M / (1.0 - ECCENTRICITY_SQUARED * sin * sin).sqrt();
    let across = (radius + altitude) * cos;
    let up = (radius * (1.0 - ECCENTRICITY_SQUARED) + altitude) * sin;
    [across * beside, across * below, up]
}

impl Car {
    /// Reads the folder.
    ///
    /// # Errors
    /// A file that is missing, or a line that is not as it should be.
    pub fn read(folder: &Path) -> Result<Self, CarError> {
        let poses: Vec<[f64; 11]> = rows(folder, "pose.csv.gz")?;
        let Some([begin_s, x, y, z, ..]) = poses.first().copied() else {
            return Ok(Self::default());
        };
        let plane = Plane::at([x, y, z]);
        let reference = poses.iter().map(|row| Sample {
            time_s: row[0] - begin_s,
            position: plane.on([row[1], row[2], row[3]]),
            velocity: plane.turned([row[8], row[9], row[10]]),
        });
        let fixes: Vec<[f64; 7]> = rows(folder, "gnss_ublox.csv")?;
        let fix = |row: &[f64; 7]| Fix {
            receiver: 0,
            stamp_s: row[4] - begin_s,
            position: plane.on(earth_centred(row[1], row[2], row[5])),
        };
        let speeds: Vec<[f64; 6]> = rows(folder, "wheel_speed.csv.gz")?;
        Ok(Self {
            ways: ways(&speeds, begin_s),
            fixes: fixes.iter().map(fix).collect(),
            took_s: fixes.iter().map(|row| row[0] - row[4]).collect(),
            reference: reference.collect(),
        })
    }

    /// The reference at a moment, between its samples.
    #[must_use]
    pub fn at(&self, time_s: f64) -> Option<Sample> {
        let next = self.reference.partition_point(|it| it.time_s < time_s);
        let (before, after) = (
            self.reference.get(next.checked_sub(1)?)?,
            self.reference.get(next)?,
        );
        let part = (time_s - before.time_s) / (after.time_s - before.time_s);
        let between =
            |a: [f64; 2], b: [f64; 2]| [0, 1].map(|it: usize| a[it] + part * (b[it] - a[it]));
        Some(Sample {
            time_s,
            position: between(before.position, after.position),
            velocity: between(before.velocity, after.velocity),
        })
    }
}

/// The rear wheels', each frame's speed for the time since the one before, as the daemon has it.
fn ways(speeds: &[[f64; 6]], begin_s: f64) -> Vec<Way> {
    let way = |pair: &[[f64; 6]]| {
        let dt_s = pair[1][0] - pair[0][0];
        Way {
            start_s: pair[0][0] - begin_s,
            end_s: pair[1][0] - begin_s,
            read: [pair[1][3] * dt_s, pair[1][4] * dt_s],
            state: State::Rolling,
            gyro: None,
        }
    };
    speeds.windows(2).map(way).collect()
}

fn rows<const N: usize>(folder: &Path, name: &'static str) -> Result<Vec<[f64; N]>, CarError> {
    let unreadable = |error| CarError::Unreadable(name, error);
    let file = File::open(folder.join(name)).map_err(unreadable)?;
    let packed = Path::new(name).extension().is_some_and(|it| it == "gz");
    let text: Box<dyn Read> = if packed {
        Box::new(GzDecoder::new(file))
    } else {
        Box::new(file)
    };
    let lines = BufReader::new(text).lines().enumerate().skip(1);
    lines
        .map(|(index, line)| {
            let line = line.map_err(unreadable)?;
            let numbers: Option<Vec<f64>> = line.split(',').map(|it| it.parse().ok()).collect();
            numbers
                .and_then(|it| it.try_into().ok())
                .ok_or(CarError::Malformed(name, index + 1, N))
        })
        .collect()
}
