//! What the robots of MR.CLAM saw with their own cameras.

use std::collections::BTreeMap;
use std::path::Path;

use super::survey::Survey;
use crate::mrclam::{GridWorld, Recording};
use crate::world::World;

/// By so much the camera's stamps are late \[s\].
pub(super) const LATENCY_S: f64 = 0.04;

/// Who has a receiver: its truth has to be known, for the fixes are made of it.
const RECEIVERS: usize = 2;

/// When the recordings begin that the document has figures of \[s since 1970\], and how well that is known.
const DOCUMENTED: [(u32, f64); 2] = [(1, 1_248_272_263.325), (6, 1_248_444_175.103)];
const SAME_START_S: f64 = 1.0;

/// Why a recording says nothing of robots that see one another.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unusable {
    /// Nobody to see.
    #[error("one robot alone sees no other: the recording needs two at least")]
    OneRobot,
    /// Its start is not known.
    #[error("nobody ever knows where robot {0} is: its truth is missing")]
    NoTruth(u32),
    /// No camera, or no names.
    #[error(
        "no robot saw another one: is Barcodes.dat there, and RobotN_Measurement.dat of each robot?"
    )]
    NobodySeen,
}

/// What was seen.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Subject {
    /// A robot, from 0.
    Robot(usize),
    /// A tube, at its surveyed place.
    Landmark([f64; 2]),
}

/// One sighting.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Sighting {
    /// Since the first step \[s\].
    pub(super) time_s: f64,
    pub(super) observer: usize,
    pub(super) subject: Subject,
    pub(super) range_m: f64,
    pub(super) bearing_rad: f64,
}

/// A recording on its grid, and the sightings in their order.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Of MR.CLAM, where the document has figures of it.
    pub(super) number: Option<u32>,
    pub(super) world: GridWorld,
    pub(super) steps: usize,
    pub(super) sightings: Vec<Sighting>,
    /// What is wrong with it, and what became of that: landmarks that are not where the survey has them, and who sees or is seen by nobody.
    pub remarks: Vec<String>,
}

impl Recorded {
    pub(super) fn read(data: &Path, number: u32) -> Result<Self, String> {
        let folder = data.join(format!("mrclam{number}"));
        let recording = Recording::load(&folder).map_err(|error| error.to_string())?;
        Self::new(&recording).map_err(|error| error.to_string())
    }

    /// On its grid, as long as those that have a receiver are tracked.
    ///
    /// # Errors
    /// What is missing in it.
    pub fn new(recording: &Recording) -> Result<Self, Unusable> {
        let world = recording.resample();
        check(&world)?;
        let steps = tracked(&world);
        let last_s = world.time_s(steps) - world.start_s();
        let survey = Survey::checked(recording, &world);
        let mut sightings = sightings(recording, &world, &survey);
        sightings.retain(|it| (0.0..last_s).contains(&it.time_s));
        let mut remarks = survey.remarks;
        remarks.extend(unheard(recording, &sightings));
        let documented = DOCUMENTED
            .iter()
            .find(|(_, start_s)| (start_s - world.start_s()).abs() < SAME_START_S);
        let recorded = Self {
            number: documented.map(|(number, _)| *number),
            world,
            steps,
            sightings,
            remarks,
        };
        if recorded.among_robots().next().is_none() {
            return Err(Unusable::NobodySeen);
        }
        Ok(recorded)
    }

    /// Its number in MR.CLAM, where that is known.
    pub(super) fn title(&self) -> String {
        self.number.map_or_else(|| "–".into(), |it| it.to_string())
    }

    /// How long it is \[s\].
    #[must_use]
    pub fn length_s(&self) -> f64 {
        self.world.time_s(self.steps) - self.world.start_s()
    }

    /// The number that a robot has in the recording's file names.
    #[must_use]
    pub fn name(&self, robot: usize) -> String {
        let number = self.world.number(robot).map_or(robot + 1, |it| it as usize);
        format!("R{number}")
    }

    /// Sightings of robots, and of landmarks.
    #[must_use]
    pub fn counts(&self) -> [usize; 2] {
        let robots = self.among_robots().count();
        [robots, self.sightings.len() - robots]
    }

    /// Of one robot by another.
    pub(super) fn among_robots(&self) -> impl Iterator<Item = &Sighting> {
        let is_robot = |it: &&Sighting| matches!(it.subject, Subject::Robot(_));
        self.sightings.iter().filter(is_robot)
    }
}

/// What the recording should have said and does not.
fn unheard(recording: &Recording, sightings: &[Sighting]) -> Vec<String> {
    let mut remarks = Vec::new();
    for (robot, record) in recording.robots.iter().enumerate() {
        let number = record.number;
        let of = record.measurements.len();
        if of == 0 {
            remarks.push(format!(
                "robot {number} sees nothing: there is no Robot{number}_Measurement.dat"
            ));
        } else if sightings.iter().all(|it| it.observer != robot) {
            remarks.push(format!(
                "robot {number} sees nothing: none of its {of} sightings is of anybody in Barcodes.dat while all are tracked"
            ));
        }
        if sightings
            .iter()
            .all(|it| it.subject != Subject::Robot(robot))
        {
            remarks.push(format!(
                "robot {number} is seen by nobody: is it in Barcodes.dat?"
            ));
        }
    }
    if recording.landmarks.is_empty() {
        remarks.push("nobody sees landmarks: there is no Landmark_Groundtruth.dat".into());
    }
    remarks
}

fn check(world: &GridWorld) -> Result<(), Unusable> {
    if world.robots() < 2 {
        return Err(Unusable::OneRobot);
    }
    let mut robots = 0..world.robots();
    let unknown = robots.find(|&robot| world.initial(robot).is_none());
    unknown.map_or(Ok(()), |robot| {
        Err(Unusable::NoTruth(world.number(robot).unwrap_or_default()))
    })
}

/// Steps until somebody who has a receiver is tracked no longer, to the whole second.
fn tracked(world: &GridWorld) -> usize {
    let last = |robot| (0..world.steps()).rfind(|&step| world.truth(step, robot).is_some());
    let steps = (0..RECEIVERS.min(world.robots()))
        .filter_map(last)
        .map(|last| last + 1)
        .min();
    let second = steps_of(1.0, world);
    steps.unwrap_or_default() / second * second
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Saturates, which is what is wanted.
pub(super) fn steps_of(seconds: f64, world: &GridWorld) -> usize {
    (seconds / world.dt_s()).round() as usize
}

fn sightings(recording: &Recording, world: &GridWorld, survey: &Survey) -> Vec<Sighting> {
    let robots: BTreeMap<u32, usize> = (0..world.robots())
        .filter_map(|robot| Some((world.number(robot)?, robot)))
        .collect();
    let subject = |barcode: u32| {
        let number = recording.barcodes.get(&barcode)?;
        let robot = robots.get(number).map(|it| Subject::Robot(*it));
        robot.or_else(|| survey.places.get(number).map(|it| Subject::Landmark(*it)))
    };
    let mut all: Vec<Sighting> = Vec::new();
    for (observer, robot) in recording.robots.iter().enumerate() {
        let usable = robot.measurements.iter().filter(|it| it.range_m > 0.0);
        all.extend(usable.filter_map(|it| {
            Some(Sighting {
                time_s: it.time_s - LATENCY_S - world.start_s(),
                observer,
                subject: subject(it.barcode).filter(|it| *it != Subject::Robot(observer))?,
                range_m: it.range_m,
                bearing_rad: it.bearing_rad,
            })
        }));
    }
    all.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mrclam::{Measurement, OdometryRow, RobotRecord, TruthRow};

    /// A robot that stands, and saw these barcodes.
    fn robot(number: u32, x: f64, barcodes: &[u32]) -> RobotRecord {
        let seen = barcodes.iter().map(|barcode| Measurement {
            time_s: 1.0,
            barcode: *barcode,
            range_m: 2.0,
            bearing_rad: 0.0,
        });
        let odometry = |time_s| OdometryRow {
            time_s,
            velocity: [0.0; 2],
        };
        let truth = |tenths: u32| TruthRow {
            time_s: 0.1 * f64::from(tenths),
            pose: [x, 0.0, 0.0],
        };
        RobotRecord {
            number,
            odometry: [0.0, 4.0].map(odometry).to_vec(),
            odometry_50hz: None,
            truth: (0..40).map(truth).collect(),
            measurements: seen.collect(),
        }
    }

    #[test]
    fn what_is_missing_in_a_recording_is_said() {
        let robots = [(1, 0.0, &[12][..]), (2, 2.0, &[]), (3, 4.0, &[99])];
        let recording = Recording {
            robots: robots
                .map(|(number, x, seen)| robot(number, x, seen))
                .into(),
            barcodes: [(11, 1), (12, 2), (13, 3)].into(),
            landmarks: Vec::new(),
        };
        let remarks = Recorded::new(&recording).unwrap().remarks;
        let said = [
            "robot 1 is seen by nobody",
            "robot 2 sees nothing: there is no Robot2_Measurement.dat",
            "robot 3 sees nothing: none of its 1 sightings",
            "robot 3 is seen by nobody",
            "nobody sees landmarks",
        ];
        assert_eq!(remarks.len(), said.len(), "{remarks:?}");
        for (remark, said) in remarks.iter().zip(said) {
            assert!(remark.starts_with(said), "{remark}");
        }
    }
}
