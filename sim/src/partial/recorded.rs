//! What the robots of MR.CLAM saw with their own cameras.

use std::collections::BTreeMap;
use std::path::Path;

use crate::mrclam::{GridWorld, Recording};
use crate::world::World;

/// By so much the camera's stamps are late \[s\].
const LATENCY_S: f64 = 0.04;

/// The second of these recordings is cut where the tracking of its first robot ends \[s\].
const END_OF_6_S: f64 = 771.0;

/// Tubes whose barcodes are swapped in recording 1.
const SWAPPED: [u32; 2] = [11, 17];

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
pub(super) struct Recorded {
    pub(super) number: u32,
    pub(super) world: GridWorld,
    pub(super) steps: usize,
    pub(super) sightings: Vec<Sighting>,
}

impl Recorded {
    pub(super) fn read(data: &Path, number: u32) -> Result<Self, String> {
        let folder = data.join(format!("mrclam{number}"));
        let recording = Recording::load(&folder).map_err(|error| error.to_string())?;
        let world = recording.resample();
        let end_s = if number == 6 {
            END_OF_6_S
        } else {
            f64::INFINITY
        };
        let steps = (0..world.steps())
            .take_while(|&step| world.time_s(step) - world.start_s() <= end_s)
            .count();
        let last_s = world.time_s(steps) - world.start_s();
        let mut sightings = sightings(&recording, &world, number == 1);
        sightings.retain(|it| (0.0..last_s).contains(&it.time_s));
        Ok(Self {
            number,
            world,
            steps,
            sightings,
        })
    }

    /// Of one robot by another.
    pub(super) fn among_robots(&self) -> impl Iterator<Item = &Sighting> {
        let is_robot = |it: &&Sighting| matches!(it.subject, Subject::Robot(_));
        self.sightings.iter().filter(is_robot)
    }
}

fn sightings(recording: &Recording, world: &GridWorld, is_swapped: bool) -> Vec<Sighting> {
    let robots: BTreeMap<u32, usize> = (0..world.robots())
        .filter_map(|robot| Some((world.number(robot)?, robot)))
        .collect();
    let places: BTreeMap<u32, [f64; 2]> = recording
        .landmarks
        .iter()
        .map(|it| (swapped(it.subject, is_swapped), it.position))
        .collect();
    let subject = |barcode: u32| {
        let number = recording.barcodes.get(&barcode)?;
        let robot = robots.get(number).map(|it| Subject::Robot(*it));
        robot.or_else(|| places.get(number).map(|it| Subject::Landmark(*it)))
    };
    let mut all: Vec<Sighting> = Vec::new();
    for (observer, robot) in recording.robots.iter().enumerate() {
        all.extend(robot.measurements.iter().filter_map(|it| {
            Some(Sighting {
                time_s: it.time_s - LATENCY_S - world.start_s(),
                observer,
                subject: subject(it.barcode)?,
                range_m: it.range_m,
                bearing_rad: it.bearing_rad,
            })
        }));
    }
    all.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    all
}

fn swapped(subject: u32, is_swapped: bool) -> u32 {
    match (is_swapped, subject) {
        (true, a) if a == SWAPPED[0] => SWAPPED[1],
        (true, b) if b == SWAPPED[1] => SWAPPED[0],
        (_, other) => other,
    }
}
