//! Robots in a hall find one another in the scans of their laser scanners: rectangles with their heading, cylinders without.

use coloc_estimator::Pose;
use coloc_scan::Look;
use coloc_sim::laser::hall::Hall;

use super::{Eyes, Scene, rings};
use crate::args::DemoArgs;
use crate::demo::DemoError;

/// Half of the hall, and its pillars: place and radius \[m\].
const HALL_M: [f64; 2] = [8.2, 6.0];
const PILLARS_M: [[f64; 3]; 4] = [
    [7.0, 4.8, 0.2],
    [-7.0, 4.8, 0.2],
    [-7.0, -4.8, 0.2],
    [7.0, -4.8, 0.2],
];

const LONG: Look = Look::Rectangle {
    length_m: 0.7,
    width_m: 0.5,
    centre_m: [0.0, 0.0],
};
const ROUND: Look = Look::Cylinder { radius_m: 0.25 };

/// What each robot looks like.
const LOOKS: [Look; rings::MOST] = [LONG, LONG, ROUND, LONG, ROUND];

/// Where each robot has its scanner: forward, left, turned \[m, m, rad\].
pub(crate) const MOUNT: [f64; 3] = [0.1, 0.0, 0.0];

pub(super) fn scene(args: &DemoArgs) -> Result<Scene, DemoError> {
    let robots = args.robots.map_or(LOOKS.len(), usize::from);
    let looks = LOOKS.iter().copied().take(robots).collect();
    let [x, y, turned] = MOUNT;
    let mount = Pose::new(x, y, turned);
    let hall = Hall::new(HALL_M, &PILLARS_M, looks, mount, args.seed);
    rings::scene(args, "laser", "by scans alone", Eyes::Scans(hall))
}
