//! Where landmarks stand: as surveyed, unless what was seen of them says otherwise.

use std::collections::BTreeMap;

use super::recorded::{LATENCY_S, steps_of};
use crate::mrclam::{GridWorld, Landmark, Recording};
use crate::world::World;

/// Sightings put a landmark this near to where it stands, in the middle \[m\].
const NEAR_M: f64 = 0.5;

/// So many sightings at least say that a landmark is somewhere else.
const ENOUGH: usize = 20;

/// Places by the landmark's number.
pub(super) struct Survey {
    pub(super) places: BTreeMap<u32, [f64; 2]>,
    pub(super) remarks: Vec<String>,
}

impl Survey {
    /// Two landmarks that are seen in each other's places are swapped back, as those numbered 11 and 17 of MR.CLAM 1; one that is seen
    /// where none stands is left out.
    pub(super) fn checked(recording: &Recording, world: &GridWorld) -> Self {
        let seen = seen(recording, world);
        let mut survey = Self {
            places: BTreeMap::new(),
            remarks: Vec::new(),
        };
        for landmark in &recording.landmarks {
            survey.take(landmark, &recording.landmarks, &seen);
        }
        survey
    }

    fn take(&mut self, landmark: &Landmark, all: &[Landmark], seen: &BTreeMap<u32, [f64; 2]>) {
        let Landmark { subject, position } = *landmark;
        let is_at = |number: u32, place| seen.get(&number).is_none_or(|it| is_near(*it, place));
        if is_at(subject, position) {
            self.places.insert(subject, position);
            return;
        }
        let other = all
            .iter()
            .find(|it| is_at(subject, it.position) && is_at(it.subject, position));
        if let Some(other) = other {
            self.places.insert(subject, other.position);
        }
        self.remarks.push(match other {
            Some(other) => format!(
                "landmark {subject} is seen where the survey has {}, and the other way round: swapped back",
                other.subject
            ),
            None => format!("landmark {subject} is seen where the survey has none: left out"),
        });
    }
}

fn is_near([x, y]: [f64; 2], [a, b]: [f64; 2]) -> bool {
    (x - a).hypot(y - b) < NEAR_M
}

/// The middle of where each landmark was seen, by the true poses of those that saw it.
fn seen(recording: &Recording, world: &GridWorld) -> BTreeMap<u32, [f64; 2]> {
    let mut points: BTreeMap<u32, Vec<[f64; 2]>> = BTreeMap::new();
    for (observer, robot) in recording.robots.iter().enumerate() {
        for it in &robot.measurements {
            let subject = recording.barcodes.get(&it.barcode);
            let since_s = it.time_s - LATENCY_S - world.start_s();
            let pose = world.truth(steps_of(since_s, world), observer);
            if let (Some(subject), Some(pose)) = (subject, pose) {
                let (sin, cos) = (pose.phi + it.bearing_rad).sin_cos();
                let point = [pose.x + it.range_m * cos, pose.y + it.range_m * sin];
                points.entry(*subject).or_default().push(point);
            }
        }
    }
    points.retain(|_, points| points.len() >= ENOUGH);
    let middles = points.into_iter().map(|(number, points)| {
        let axis = |i: usize| median(points.iter().map(|it| it[i]).collect());
        (number, [axis(0), axis(1)])
    });
    middles.collect()
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mrclam::{Measurement, OdometryRow, RobotRecord, TruthRow};

    /// A robot that stands at the origin and sees each `(barcode, place)` thirty times.
    fn recording(landmarks: &[(u32, [f64; 2])], seen: &[(u32, [f64; 2])]) -> Recording {
        let measurements = seen.iter().flat_map(|(barcode, [x, y])| {
            (0..30).map(|_| Measurement {
                time_s: 1.0,
                barcode: *barcode,
                range_m: x.hypot(*y),
                bearing_rad: y.atan2(*x),
            })
        });
        let robot = RobotRecord {
            number: 1,
            odometry: [0.0, 2.0].map(still).to_vec(),
            odometry_50hz: None,
            truth: [0.0, 0.4, 0.8, 1.2].map(at_the_origin).to_vec(),
            measurements: measurements.collect(),
        };
        let landmark = |(subject, position): &(u32, [f64; 2])| Landmark {
            subject: *subject,
            position: *position,
        };
        Recording {
            robots: vec![robot],
            barcodes: [6, 7, 8].map(|it| (it, it)).into(),
            landmarks: landmarks.iter().map(landmark).collect(),
        }
    }

    fn still(time_s: f64) -> OdometryRow {
        OdometryRow {
            time_s,
            velocity: [0.0; 2],
        }
    }

    fn at_the_origin(time_s: f64) -> TruthRow {
        TruthRow {
            time_s,
            pose: [0.0; 3],
        }
    }

    fn checked(landmarks: &[(u32, [f64; 2])], seen: &[(u32, [f64; 2])]) -> Survey {
        let recording = recording(landmarks, seen);
        Survey::checked(&recording, &recording.resample())
    }

    #[test]
    fn what_was_surveyed_stays_where_it_is_seen_there_or_hardly_seen() {
        let landmarks = [(6, [2.0, 0.0]), (7, [0.0, 3.0])];
        let survey = checked(&landmarks, &[(6, [2.1, 0.1])]);
        assert!(survey.remarks.is_empty(), "{:?}", survey.remarks);
        assert_eq!(survey.places, landmarks.into());
    }

    #[test]
    fn two_that_are_seen_in_each_others_place_are_swapped_back() {
        let landmarks = [(6, [2.0, 0.0]), (7, [0.0, 3.0])];
        let survey = checked(&landmarks, &[(6, [0.1, 3.0]), (7, [2.0, 0.1])]);
        assert_eq!(survey.places, [(6, [0.0, 3.0]), (7, [2.0, 0.0])].into());
        assert_eq!(survey.remarks.len(), 2);
    }

    #[test]
    fn one_that_is_seen_where_none_stands_is_left_out() {
        let landmarks = [(6, [2.0, 0.0]), (7, [0.0, 3.0])];
        let survey = checked(&landmarks, &[(6, [5.0, 5.0]), (7, [0.0, 3.0])]);
        assert_eq!(survey.places, [(7, [0.0, 3.0])].into());
        assert!(survey.remarks[0].contains("left out"));
    }
}
