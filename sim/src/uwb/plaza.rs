//! A mower among four radios on a lawn: Plaza 1 and 2 of Djugash, Hamner and Roth, Journal of Field Robotics 26 (9), 2009.

use coloc_estimator::partial::{Alone, Reading};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, LandmarkSighting, Measurement, Motion,
    OdometrySample, Origin, Pose, Slot, TickInputs, step,
};
use coloc_uwb::{Corrected, Place, Ranging, Settings};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use super::drive::{SKIDDING, Sums, increment, noise, settings, stamp};
use super::recording::{Leg, Range, Recording};
use super::{Form, MOST_OUTSIDE};
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use crate::random::{Noise, Purpose};

/// How well the start is known \[m, rad\].
const START: [f64; 2] = [0.1, 0.05];
/// Of an anchor's place \[m\].
const ANCHOR_SIGMA_M: f64 = 0.01;
/// What is new in every reading of these radios \[m\].
const RADIO_SIGMA_M: f64 = 0.55;
/// What is not, as a part of the range, where it is not learned.
const UNKNOWN_SCALE: f64 = 0.1;
/// The first part of the drive is for learning, where that ends.
const FOR_LEARNING: f64 = 1.0 / 3.0;

/// RMS of the position \[m\].
const BAR_M: f64 = 0.6;

/// What is done about a range that is too long.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Way {
    /// Nothing: it is said to err by a tenth.
    AsSaid,
    /// Learned in the first third, and no longer; judged in the rest.
    Once,
    /// Learned all the time, judged from the start.
    Always,
}

struct Row {
    name: &'static str,
    way: Way,
}

const ROWS: [Row; 3] = [
    Row {
        name: "as the radio says it, σ of a tenth that stays",
        way: Way::AsSaid,
    },
    Row {
        name: "learned in the first third, judged in the rest",
        way: Way::Once,
    },
    Row {
        name: "learned while it drives, judged from the start",
        way: Way::Always,
    },
];

/// The mower, driven again.
struct Drive<'a> {
    recording: &'a Recording,
    way: Way,
    estimator: Estimator<Vec<Slot>>,
    ranging: Ranging,
    /// Where the radio's filter is in time \[s\].
    ranged_s: f64,
    sums: Sums,
    said: u64,
    refused: u64,
}

const SLOTS: usize = 256;

impl<'a> Drive<'a> {
    fn new(recording: &'a Recording, way: Way, noise: &Noise) -> Self {
        let truth = recording.truth(0.0).unwrap_or_default();
        let [m, rad] = START;
        let [x, y, phi] = noise.draws(Purpose::Start, 0, 0, 0).normals();
        let pose = Pose::new(truth.x + m * x, truth.y + m * y, truth.phi + rad * phi);
        let variances = [m * m, m * m, rad * rad];
        let covariance = Covariance3::diagonal(variances).unwrap_or_default();
        let belief = Belief::independent(pose, covariance);
        let storage = vec![Slot::default(); SLOTS];
        let radios = Settings {
            sigma_m: RADIO_SIGMA_M,
            ..Settings::default()
        };
        let begun = Vector3::new(pose.x, pose.y, pose.phi);
        Self {
            recording,
            way,
            estimator: Estimator::new(settings(), stamp(0.0), belief, storage),
            ranging: Ranging::new(radios, begun, Matrix3::from_diagonal(&variances.into())),
            ranged_s: 0.0,
            sums: Sums::default(),
            said: 0,
            refused: 0,
        }
    }

    fn run(mut self) -> (Sums, [u64; 2], Ranging) {
        let odometry = noise(&SKIDDING);
        let mut rest = self.recording.ranges.as_slice();
        for leg in &self.recording.legs {
            let seconds = leg.end_s - leg.start_s;
            let motion = odometry.nonholonomic([leg.way_m / seconds, leg.turn_rad / seconds]);
            let come = rest.partition_point(|it| it.time_s <= leg.end_s);
            let (now, later) = rest.split_at(come);
            rest = later;
            let mut measurements = vec![driven(leg, motion)];
            for range in now {
                self.drive_to(range.time_s, &motion);
                measurements.extend(self.hear(range));
            }
            self.drive_to(leg.end_s, &motion);
            let inputs = TickInputs {
                stamp: stamp(leg.end_s),
                measurements: &measurements,
            };
            let outputs = step(&mut self.estimator, &inputs);
            let belief = outputs.estimate.belief;
            self.account(leg.end_s, &belief);
        }
        (self.sums, [self.said, self.refused], self.ranging)
    }

    fn drive_to(&mut self, time_s: f64, motion: &Motion) {
        let seconds = time_s - self.ranged_s;
        if seconds > 0.0 {
            self.ranging.drive(&increment(motion, seconds));
            self.ranged_s = time_s;
        }
    }

    /// As a driver of the radio does: what was learned before corrects a reading, then that teaches.
    fn hear(&mut self, range: &Range) -> Option<Measurement> {
        let position = self.recording.place(range.anchor)?;
        let reading = self.corrected(range)?;
        let place = Place {
            position: Vector2::from(position),
            covariance: Matrix2::from_diagonal_element(ANCHOR_SIGMA_M * ANCHOR_SIGMA_M),
            moves: false,
        };
        if self.learns(range.time_s) {
            let learned = self
                .ranging
                .learn(range.anchor, range.said_m, Vector2::zeros(), &place);
            self.refused += u64::from(learned.is_err());
        }
        self.said += 1;
        let slow = reading.slow * reading.range_m;
        Some(Measurement::Landmark(LandmarkSighting {
            stamp: stamp(range.time_s),
            origin: Origin::counted(self.said),
            landmark: range.anchor,
            reading: Reading::Alone(Alone::Range {
                range_m: reading.range_m,
                variances: [reading.white, slow * slow],
                mount: Pose::default(),
            }),
            position,
            covariance: Covariance2::diagonal([ANCHOR_SIGMA_M * ANCHOR_SIGMA_M; 2]).ok()?,
        }))
    }

    fn corrected(&self, range: &Range) -> Option<Corrected> {
        if self.way == Way::AsSaid {
            return Some(Corrected {
                range_m: range.said_m,
                white: RADIO_SIGMA_M * RADIO_SIGMA_M,
                slow: UNKNOWN_SCALE,
            });
        }
        self.ranging.corrected(range.anchor, range.said_m)
    }

    fn learns(&self, time_s: f64) -> bool {
        let first = time_s < FOR_LEARNING * self.recording.seconds();
        self.way == Way::Always || self.way == Way::Once && first
    }

    fn account(&mut self, time_s: f64, belief: &Belief) {
        let is_judged = self.way != Way::Once || !self.learns(time_s);
        if let Some(truth) = self.recording.truth(time_s).filter(|_| is_judged) {
            self.sums.push(belief, &truth);
        }
    }
}

fn driven(leg: &Leg, motion: Motion) -> Measurement {
    Measurement::Odometry(OdometrySample {
        source: 0,
        start: stamp(leg.start_s),
        stamp: stamp(leg.end_s),
        motion,
    })
}

/// Runs all rows.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let title = "A mower among four radios (Plaza 1 and 2), anchors at surveyed places";
    let said = |text: String, missed| Finding {
        title: title.into(),
        text,
        missed,
    };
    let Some(data) = &form.data else {
        let skipped =
            "SKIPPED: no recordings; set COLOC_DATA to the folder that holds plaza\n".to_string();
        return said(skipped, Vec::new());
    };
    let mut table = Table::new([
        "recording",
        "ranges",
        "position RMS, m",
        "heading RMS, rad",
        "outside",
        "too long, by anchor",
    ]);
    let mut missed = Vec::new();
    for number in [1, 2] {
        let recording = match Recording::read(data, number) {
            Ok(recording) => recording,
            Err(error) => return said(String::new(), vec![error]),
        };
        for row in &ROWS {
            let draws: Vec<_> = (0..form.draws)
                .into_par_iter()
                .map(|draw| Drive::new(&recording, row.way, &Noise::new(form.seed, draw)).run())
                .collect();
            let sums = draws
                .iter()
                .fold(Sums::default(), |sums, it| sums.plus(&it.0));
            judge(&recording, row, &sums, &mut missed);
            table.row(line(&recording, row, &sums, draws.first()));
        }
    }
    said(table.text(), missed)
}

fn judge(recording: &Recording, row: &Row, sums: &Sums, missed: &mut Vec<String>) {
    let (rms_m, outside) = (sums.rms_m(), sums.outside());
    let is_held = rms_m <= BAR_M && outside <= MOST_OUTSIDE;
    if row.way != Way::AsSaid && !is_held {
        let (number, name) = (recording.number, row.name);
        missed.push(format!(
            "Plaza {number}, {name}: {rms_m:.2} m, {} outside",
            percent(outside)
        ));
    }
}

fn line(
    recording: &Recording,
    row: &Row,
    sums: &Sums,
    first: Option<&(Sums, [u64; 2], Ranging)>,
) -> [String; 6] {
    let learned = first.filter(|_| row.way != Way::AsSaid).map(|(_, _, it)| {
        let anchors = recording.anchors.iter();
        let each = anchors.map(|(anchor, _)| {
            let it = it.calibration(*anchor);
            format!("{:.1} % {:+.2} m", 100.0 * it.scale, it.offset_m)
        });
        each.collect::<Vec<_>>().join(", ")
    });
    [
        recording.number.to_string(),
        row.name.into(),
        digits(sums.rms_m()),
        digits(sums.rms_rad()),
        percent(sums.outside()),
        learned.unwrap_or_else(|| "–".into()),
    ]
}
