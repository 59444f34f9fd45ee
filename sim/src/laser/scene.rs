//! A recorded room with robots in it, and what a scanner makes of it.

use coloc_scan::beams::ScannerMotion;
use coloc_scan::finder::OwnHeading;
use coloc_scan::{Look, Prior, Raw};

use super::Row;
use super::room::Room;
use super::solid::{Pose, Solid, solids};
use crate::random::Draws;

/// A team.
pub(super) const TEAM: usize = 5;
/// Nearer and farther there are none \[m\].
const NEAREST_M: f64 = 0.7;
const FARTHEST_M: f64 = 7.0;
/// Between a robot and a wall, or another robot \[m\].
const CLEAR_M: f64 = 0.1;
/// Of priors \[m, m, rad\].
pub(super) const PRIOR_SIGMAS: [f64; 3] = [0.3, 0.3, 0.174_532_925_199_432_95];
/// A robot is where it is believed to be with this probability, and one that nobody knows is there with that.
const PRESENT: f64 = 0.9;
const UNLISTED: f64 = 0.2;
/// The next robot meets the one before: beside it, or behind it.
const CROSSES: f64 = 0.2;
/// Errors of the scanner: range, angle, and of robots: their size \[m, rad, m\].
pub(super) const RANGE_SIGMA_M: f64 = 0.015;
pub(super) const ANGLE_SIGMA_RAD: f64 = 0.001;
pub(super) const SHAPE_SIGMA_M: f64 = 0.005;
/// Ranges come in steps of a centimetre, as those of the recordings.
const ROUNDED_M: f64 = 0.01;
/// Half of the angle that a beam lights up, and how often it gives a range between those of two things that it lights up.
const BEAM_RAD: f64 = 0.002;
const MIXES: f64 = 0.5;
/// A scanner that turns ten times a second \[s/rad\].
const SWEEP_S_PER_RAD: f64 = 0.1 / std::f64::consts::TAU;
/// It drives and turns up to so fast.
const MOST_SPEED_M_S: f64 = 0.7;
const MOST_TURN_RAD_S: f64 = 0.7;

/// A robot of the scene.
#[derive(Clone, Debug)]
pub(super) struct Robot {
    /// Its number; none of one that nobody knows.
    pub(super) number: Option<u16>,
    /// Where it is when the scan begins.
    pub(super) pose: Pose,
    /// So many beams met it and nothing else.
    pub(super) beams: usize,
    /// Which of its marks were met, a bit each.
    pub(super) marks: u32,
    solids: Vec<(Solid, bool)>,
}

/// A room with robots.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    pub(super) robots: Vec<Robot>,
    pub(super) priors: Vec<Prior>,
    pub(super) motion: ScannerMotion,
    ranges: Vec<f32>,
    intensities: Vec<f32>,
    angle_min: f64,
    step: f64,
}

/// What a ray met.
struct Met {
    range: f64,
    robot: Option<usize>,
    /// Of a mark, its bit.
    mark: u32,
}

impl Scene {
    /// Puts robots into a room, and scans it.
    pub(super) fn draw(room: &Room, row: &Row, draws: &mut Draws) -> Self {
        let mut scene = Self {
            robots: Vec::new(),
            priors: Vec::new(),
            motion: ScannerMotion {
                velocity_m_s: [draws.uniform(-MOST_SPEED_M_S, MOST_SPEED_M_S), 0.0],
                turn_rad_s: draws.uniform(-MOST_TURN_RAD_S, MOST_TURN_RAD_S),
            },
            ranges: Vec::new(),
            intensities: Vec::new(),
            angle_min: room.angle_min,
            step: room.step,
        };
        for number in 0..TEAM {
            scene.add_listed(room, row, number, draws);
        }
        if draws.happens(UNLISTED)
            && let Some(pose) = scene.free_place(room, &row.looks[0], draws)
        {
            scene.stand(None, &row.looks[0], pose, draws);
        }
        let turned = PRIOR_SIGMAS[2] * draws.normal();
        if row.turned {
            scene.turn_priors(turned);
        }
        scene.scan(room, draws);
        scene
    }

    fn add_listed(&mut self, room: &Room, row: &Row, number: usize, draws: &mut Draws) {
        let look = number % row.looks.len();
        let is_present = draws.happens(PRESENT);
        let Some(pose) = self.free_place(room, &row.looks[look], draws) else {
            return;
        };
        let off = draws.normals::<3>();
        #[allow(clippy::cast_possible_truncation)] // A few.
        let robot = number as u16 + 1;
        let variances = PRIOR_SIGMAS.map(|sigma| sigma * sigma);
        self.priors.push(Prior {
            robot,
            look,
            pose: [0, 1, 2].map(|it| pose[it] + PRIOR_SIGMAS[it] * off[it]),
            covariance: [0, 1, 2]
                .map(|row| [0, 1, 2].map(|it| if it == row { variances[it] } else { 0.0 })),
        });
        if is_present {
            self.stand(Some(robot), &row.looks[look], pose, draws);
        }
    }

    fn stand(&mut self, number: Option<u16>, look: &Look, pose: Pose, draws: &mut Draws) {
        let larger = SHAPE_SIGMA_M * draws.normal();
        self.robots.push(Robot {
            number,
            pose,
            beams: 0,
            marks: 0,
            solids: solids(look, pose, larger),
        });
    }

    /// The scanner's own heading is off: all priors are, by one angle.
    fn turn_priors(&mut self, angle: f64) {
        let (sin, cos) = angle.sin_cos();
        let variance = PRIOR_SIGMAS[2] * PRIOR_SIGMAS[2];
        for prior in &mut self.priors {
            let [x, y, heading] = prior.pose;
            prior.pose = [cos * x - sin * y, sin * x + cos * y, heading + angle];
            let slope = [-prior.pose[1], prior.pose[0], 1.0];
            for row in 0..3 {
                for column in 0..3 {
                    prior.covariance[row][column] += slope[row] * slope[column] * variance;
                }
            }
        }
    }

    /// Somewhere in the free part of the room.
    fn free_place(&self, room: &Room, look: &Look, draws: &mut Draws) -> Option<Pose> {
        let reach = look.reach_m() + CLEAR_M;
        let met = self
            .robots
            .last()
            .filter(|_| draws.happens(CROSSES))
            .map(|it| it.pose);
        for attempt in 0..60 {
            let heading = draws.uniform(-std::f64::consts::PI, std::f64::consts::PI);
            let [x, y] = if let Some(met) = met.filter(|_| attempt < 20) {
                beside(met, look, draws)
            } else {
                somewhere(room, draws)
            };
            let far = x.hypot(y);
            let is_free = room
                .range(y.atan2(x))
                .is_some_and(|range| range > far + reach)
                && far >= NEAREST_M.max(reach + 0.2)
                && room
                    .points()
                    .iter()
                    .all(|it| (it[0] - x).hypot(it[1] - y) > reach)
                && self
                    .robots
                    .iter()
                    .all(|it| (it.pose[0] - x).hypot(it.pose[1] - y) > reach + look.reach_m());
            if is_free {
                return Some([x, y, heading]);
            }
        }
        None
    }

    fn scan(&mut self, room: &Room, draws: &mut Draws) {
        for place in 0..room.ranges.len() {
            #[allow(clippy::cast_precision_loss)] // Some hundreds.
            let time_s = place as f64 * self.time_increment_s();
            let scanner = self.scanner_at(time_s);
            let angle = room.angle(place) + scanner[2] + ANGLE_SIGMA_RAD * draws.normal();
            let [low, own, high] =
                [-BEAM_RAD, 0.0, BEAM_RAD].map(|off| self.cast(room, scanner, angle + off));
            let noise = RANGE_SIGMA_M * draws.normal();
            let (mixes, part) = (draws.happens(MIXES), draws.uniform(0.0, 1.0));
            let spread = [low.range, high.range];
            let is_edge = (spread[0] - spread[1]).abs() > 0.2 && low.robot != high.robot;
            let is_mixed = is_edge && mixes && spread.iter().all(|it| it.is_finite());
            let range = match own.robot {
                _ if is_mixed => spread[0] + part * (spread[1] - spread[0]),
                // The room's own noise is in the recording.
                None => own.range,
                Some(robot) => {
                    self.robots[robot].beams += usize::from(!is_mixed);
                    self.robots[robot].marks |= own.mark;
                    ((own.range + noise) / ROUNDED_M).round() * ROUNDED_M
                }
            };
            #[allow(clippy::cast_possible_truncation)] // As a scanner says it.
            self.ranges.push(range as f32);
            self.intensities
                .push(if own.mark > 0 && !is_mixed { 1.0 } else { 0.2 });
        }
    }

    fn cast(&self, room: &Room, scanner: Pose, angle: f64) -> Met {
        let [x, y, _] = scanner;
        let (sin, cos) = angle.sin_cos();
        // The room stands still: it is as much nearer as the scanner has come towards it.
        let range = room
            .range(angle)
            .map_or(f64::INFINITY, |range| range - x * cos - y * sin);
        let mut met = Met {
            range: range.max(0.05),
            robot: None,
            mark: 0,
        };
        for (number, robot) in self.robots.iter().enumerate() {
            for (place, (solid, bright)) in robot.solids.iter().enumerate() {
                let range = solid
                    .range([x, y], angle)
                    .filter(|range| *range < met.range);
                if let Some(range) = range {
                    met = Met {
                        range,
                        robot: Some(number),
                        mark: u32::from(*bright) << place,
                    };
                }
            }
        }
        met
    }

    /// Where the scanner is then, seen from where it began.
    pub(super) fn scanner_at(&self, time_s: f64) -> Pose {
        let [forward, _] = self.motion.velocity_m_s;
        let turn = self.motion.turn_rad_s * time_s;
        let (sin, cos) = (0.5 * turn).sin_cos();
        [forward * time_s * cos, forward * time_s * sin, turn]
    }

    fn time_increment_s(&self) -> f64 {
        self.step * SWEEP_S_PER_RAD
    }

    #[allow(clippy::cast_possible_truncation)] // As a scanner says it.
    pub(super) fn raw(&self) -> Raw<'_> {
        Raw {
            angle_min_rad: self.angle_min as f32,
            angle_increment_rad: self.step as f32,
            time_increment_s: self.time_increment_s() as f32,
            range_min_m: 0.02,
            range_max_m: 40.0,
            ranges: &self.ranges,
            intensities: &self.intensities,
        }
    }

    /// Where a robot is, seen from where the scanner was then.
    pub(super) fn seen_from(&self, robot: &Robot, time_s: f64) -> Pose {
        let [x, y, turn] = self.scanner_at(time_s);
        let (sin, cos) = turn.sin_cos();
        let [dx, dy] = [robot.pose[0] - x, robot.pose[1] - y];
        [
            cos * dx + sin * dy,
            cos * dy - sin * dx,
            robot.pose[2] - turn,
        ]
    }
}

/// How far off the scanner's own heading may be.
pub(super) fn own_heading(row: &Row) -> OwnHeading {
    let sigma = if row.turned { PRIOR_SIGMAS[2] } else { 0.0 };
    OwnHeading {
        variance: sigma * sigma,
        ..OwnHeading::default()
    }
}

/// Right beside a robot, or behind it.
fn beside([x, y, _]: Pose, look: &Look, draws: &mut Draws) -> [f64; 2] {
    let far = 2.0 * look.reach_m() + draws.uniform(CLEAR_M, 0.6);
    let (sin, cos) = draws
        .uniform(-std::f64::consts::PI, std::f64::consts::PI)
        .sin_cos();
    [x + far * cos, y + far * sin]
}

/// Somewhere before the scanner: as often in each square metre, near and far.
fn somewhere(room: &Room, draws: &mut Draws) -> [f64; 2] {
    let last = room.angle(room.ranges.len() - 1);
    let (sin, cos) = draws.uniform(room.angle_min, last).sin_cos();
    let squares = draws.uniform(NEAREST_M * NEAREST_M, FARTHEST_M * FARTHEST_M);
    [squares.sqrt() * cos, squares.sqrt() * sin]
}
