//! A room with five robots in it, as a scanner of 360 beams sees it.

use std::f64::consts::PI;

use coloc_scan::beams::ScannerMotion;
use coloc_scan::finder::OwnHeading;
use coloc_scan::{BadScan, Finder, Look, Prior, Raw, Settings, View};

const LENGTH_M: f64 = 0.7;
const WIDTH_M: f64 = 0.5;
const RADIUS_M: f64 = 0.25;
/// Where the robots are, seen from the scanner \[m, m, rad\].
const ROBOTS: [[f64; 3]; 5] = [
    [2.0, 1.0, 0.3],
    [-3.0, 1.0, 0.5],
    [0.5, -2.0, 1.0],
    [-1.5, -2.5, 2.0],
    [1.0, 3.5, 1.5],
];

/// What the robots look like.
pub(crate) const ROUND: Look = Look::Cylinder { radius_m: RADIUS_M };
/// The same.
pub(crate) const LONG: Look = Look::Rectangle {
    length_m: LENGTH_M,
    width_m: WIDTH_M,
    centre_m: [0.0, 0.0],
};

/// The scan, what is believed of the robots, and who finds them.
pub(crate) struct Office {
    ranges: Vec<f32>,
    own: OwnHeading,
    team: Vec<Prior>,
    finder: Finder,
}

impl Office {
    /// With robots that look so, seen by one that knows its heading so well \[rad\].
    #[must_use]
    pub(crate) fn new(look: Look, heading_sigma_rad: f64) -> Self {
        let variance = heading_sigma_rad * heading_sigma_rad;
        Self {
            ranges: (0..360).map(|place| beam(&look, place)).collect(),
            own: OwnHeading {
                variance,
                about_m: [0.0; 2],
            },
            team: (1..)
                .zip(&ROBOTS)
                .map(|(robot, pose)| prior(robot, *pose, variance))
                .collect(),
            finder: Finder::new(Settings::of(vec![look])),
        }
    }

    /// Looks through the scan once: how many robots were told.
    ///
    /// # Errors
    /// None, unless a number of this file is changed for the worse.
    pub(crate) fn find(&mut self) -> Result<usize, BadScan> {
        #[allow(clippy::cast_possible_truncation)] // As a scanner says it.
        let view = View::check(Raw {
            angle_min_rad: -PI as f32,
            angle_increment_rad: (PI / 180.0) as f32,
            time_increment_s: 0.1 / 360.0,
            range_max_m: 30.0,
            ranges: &self.ranges,
            ..Raw::default()
        })?;
        let (team, own) = (&self.team, self.own);
        let found = self
            .finder
            .find_turned(&view, ScannerMotion::default(), team, own);
        Ok(found.len())
    }
}

fn beam(look: &Look, place: u16) -> f32 {
    let angle = -PI + f64::from(place) * PI / 180.0;
    // With a desk or a shelf every twenty degrees.
    let is_near = !(place / 20).is_multiple_of(2);
    let wall = if is_near { 4.5 } else { 5.0 } + 0.005 * f64::from(place * 7 % 5);
    let ranges = ROBOTS.iter().filter_map(|pose| meet(look, *pose, angle));
    #[allow(clippy::cast_possible_truncation)] // As a scanner says it.
    let range = ranges.fold(wall, f64::min) as f32;
    range
}

/// Of a rectangle or a cylinder, where a beam meets it.
fn meet(look: &Look, [x, y, heading]: [f64; 3], angle: f64) -> Option<f64> {
    let (sin, cos) = angle.sin_cos();
    if let Look::Cylinder { radius_m } = look {
        let (along, aside) = (x * cos + y * sin, y * cos - x * sin);
        let inside = radius_m * radius_m - aside * aside;
        return (inside > 0.0 && along > 0.0).then(|| along - inside.sqrt());
    }
    let (s, c) = heading.sin_cos();
    let from = [-c * x - s * y, s * x - c * y];
    let way = [c * cos + s * sin, c * sin - s * cos];
    let spans = [(0, 0.5 * LENGTH_M), (1, 0.5 * WIDTH_M)].map(|(it, half)| {
        let ends = [-half, half].map(|end: f64| (end - from[it]) / way[it]);
        [ends[0].min(ends[1]), ends[0].max(ends[1])]
    });
    let (enters, leaves) = (spans[0][0].max(spans[1][0]), spans[0][1].min(spans[1][1]));
    (enters > 0.0 && enters < leaves).then_some(enters)
}

/// Off by 0.3 m and 10°, and by the own heading.
fn prior(robot: u16, [x, y, heading]: [f64; 3], own: f64) -> Prior {
    Prior {
        robot,
        look: 0,
        pose: [x, y, heading],
        covariance: [
            [0.09 + y * y * own, -x * y * own, -y * own],
            [-x * y * own, 0.09 + x * x * own, x * own],
            [-y * own, x * own, 0.03 + own],
        ],
    }
}
