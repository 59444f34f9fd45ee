//! The mower of Plaza 1 and 2: its wheels and gyro, its radio, and where it was.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use flate2::read::GzDecoder;

/// What it drove, in a row of the recording.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Leg {
    /// Since the first row \[s\].
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    /// \[m, rad\]
    pub(super) way_m: f64,
    pub(super) turn_rad: f64,
}

/// What its radio said.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Range {
    pub(super) time_s: f64,
    pub(super) anchor: u16,
    pub(super) said_m: f64,
}

/// A recording.
pub(super) struct Recording {
    pub(super) number: u32,
    pub(super) legs: Vec<Leg>,
    pub(super) ranges: Vec<Range>,
    /// Number and place \[m\].
    pub(super) anchors: Vec<(u16, [f64; 2])>,
    truth: Vec<[f64; 4]>,
    begun_s: f64,
}

/// In this one the heading of the truth is that of the mower's rear.
const BACKWARDS: u32 = 2;

impl Recording {
    pub(super) fn read(data: &Path, number: u32) -> Result<Self, String> {
        let rows_of = |what: &str| format!("plaza{number}_{what}");
        let folder = data.join("plaza");
        let truth: Vec<[f64; 4]> = rows(&folder, &rows_of("groundtruth.csv.gz"))?;
        let driven: Vec<[f64; 3]> = rows(&folder, &rows_of("odometry.csv.gz"))?;
        let said: Vec<[f64; 4]> = rows(&folder, &rows_of("range.csv.gz"))?;
        let anchors: Vec<[f64; 3]> = rows(&folder, &rows_of("beacons.csv"))?;
        let begun_s = truth.first().map_or(0.0, |it| it[0]);
        let mut legs: Vec<Leg> = Vec::with_capacity(driven.len());
        for [time_s, way_m, turn_rad] in driven {
            let start_s = legs.last().map_or(0.0, |it| it.end_s);
            legs.push(Leg {
                start_s,
                end_s: time_s - begun_s,
                way_m,
                turn_rad,
            });
        }
        legs.retain(|it| it.end_s > it.start_s);
        let ranges = said.into_iter().map(|[time_s, _, anchor, said_m]| Range {
            time_s: time_s - begun_s,
            anchor: numbered(anchor),
            said_m,
        });
        let anchors = anchors.into_iter();
        Ok(Self {
            number,
            legs,
            ranges: ranges.collect(),
            anchors: anchors.map(|[it, x, y]| (numbered(it), [x, y])).collect(),
            truth,
            begun_s,
        })
    }

    /// Where it was, between two rows; `None` outside of them.
    pub(super) fn truth(&self, time_s: f64) -> Option<Pose> {
        let at_s = time_s + self.begun_s;
        let next = self.truth.partition_point(|it| it[0] < at_s);
        let after = self.truth.get(next)?;
        let before = self.truth.get(next.saturating_sub(1))?;
        let gap_s = after[0] - before[0];
        let part = if gap_s > 0.0 {
            (at_s - before[0]) / gap_s
        } else {
            0.0
        };
        let between = |it: usize| before[it] + part * (after[it] - before[it]);
        let heading = before[3] + part * wrap(after[3] - before[3]);
        let turned = if self.number == BACKWARDS {
            std::f64::consts::PI
        } else {
            0.0
        };
        Some(Pose::new(between(1), between(2), wrap(heading + turned)))
    }

    pub(super) fn seconds(&self) -> f64 {
        self.legs.last().map_or(0.0, |it| it.end_s)
    }

    pub(super) fn place(&self, anchor: u16) -> Option<[f64; 2]> {
        let mut all = self.anchors.iter();
        all.find(|(it, _)| *it == anchor).map(|(_, place)| *place)
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Saturates; what is then no anchor is none.
fn numbered(anchor: f64) -> u16 {
    anchor as u16
}

fn rows<const N: usize>(folder: &Path, name: &str) -> Result<Vec<[f64; N]>, String> {
    let path = folder.join(name);
    let said = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let file = File::open(&path).map_err(|error| said(&error))?;
    let is_packed = path.extension().is_some_and(|it| it == "gz");
    let text: Box<dyn Read> = if is_packed {
        Box::new(GzDecoder::new(file))
    } else {
        Box::new(file)
    };
    let lines = BufReader::new(text).lines().zip(1..).skip(1);
    lines
        .map(|(line, number)| {
            let line = line.map_err(|error| said(&error))?;
            let row: Option<Vec<f64>> = line.split(',').map(|it| it.trim().parse().ok()).collect();
            let row: Option<[f64; N]> = row.and_then(|it| it.try_into().ok());
            row.filter(|it| it.iter().all(|number| number.is_finite()))
                .ok_or_else(|| said(&format!("line {number} is not {N} numbers")))
        })
        .collect()
}
