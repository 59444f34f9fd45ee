//! What came of scans.

use coloc_scan::{Finder, Look, Seen, View};

use super::Row;
use super::room::Room;
use super::scene::{Robot, Scene, own_heading};
use crate::random::Draws;

/// Within which bars ask for robots \[m\].
const WITHIN_M: f64 = 6.0;
const LEAST_BEAMS: usize = 5;
/// A word about a robot is about the one that stands so near \[m\].
const SAME_M: f64 = 0.3;
/// χ² at 95 % for two and three numbers.
const OUTSIDE: [f64; 2] = [5.991_464_547_107_979, 7.814_727_903_251_179];

/// Counts of many scans.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Score {
    pub(super) scans: u64,
    /// Robots of the team with enough beams, near enough.
    pub(super) visible: u64,
    /// Of these: said, with their own name; seen, whatever was said.
    pub(super) told: u64,
    pub(super) found: u64,
    /// All that was said.
    pub(super) said: u64,
    /// Of it: of another robot of the team, and of nothing of the team.
    pub(super) wrong: u64,
    pub(super) none: u64,
    /// With a heading.
    pub(super) headings: u64,
    /// NEES without and with a heading: how many, their sum, how many outside.
    pub(super) nees: [(u64, f64, u64); 2],
    /// Errors of range, bearing and heading: sum of squares and number \[m, rad, rad\].
    pub(super) squares: [f64; 3],
}

impl Score {
    pub(super) fn and(mut self, other: &Self) -> Self {
        self.scans += other.scans;
        self.visible += other.visible;
        self.told += other.told;
        self.found += other.found;
        self.said += other.said;
        self.wrong += other.wrong;
        self.none += other.none;
        self.headings += other.headings;
        for (own, other) in self.nees.iter_mut().zip(other.nees) {
            *own = (own.0 + other.0, own.1 + other.1, own.2 + other.2);
        }
        for (own, other) in self.squares.iter_mut().zip(other.squares) {
            *own += other;
        }
        self
    }
}

/// Draws robots into a room and looks for them.
pub(super) fn try_once(room: &Room, row: &Row, finder: &mut Finder, draws: &mut Draws) -> Score {
    let scene = Scene::draw(room, row, draws);
    let Ok(view) = View::check(scene.raw()) else {
        return Score::default();
    };
    let found = finder.find_turned(&view, scene.motion, &scene.priors, own_heading(row));
    let seen: Vec<Seen> = found.to_vec();
    let bodies: Vec<[f64; 2]> = finder.bodies().map(|(centre, _)| centre).collect();
    let mut score = Score {
        scans: 1,
        ..Score::default()
    };
    for robot in &scene.robots {
        let far = robot.pose[0].hypot(robot.pose[1]);
        let is_visible = robot.number.is_some()
            && far <= WITHIN_M
            && robot.beams >= LEAST_BEAMS
            && has_marks(&row.looks, robot.marks);
        if !is_visible {
            continue;
        }
        score.visible += 1;
        let is_near = |[x, y]: [f64; 2]| {
            let [own_x, own_y, _] = scene.seen_from(robot, 0.0);
            (x - own_x).hypot(y - own_y) <= SAME_M
        };
        let is_told = seen.iter().any(|it| Some(it.robot) == robot.number);
        score.told += u64::from(is_told);
        score.found += u64::from(is_told || bodies.iter().any(|it| is_near(*it)));
    }
    for seen in &seen {
        score.judge(&scene, seen);
    }
    score
}

/// Of robots with marks, three have to be seen: two would fit in two ways.
fn has_marks(looks: &[Look], marks: u32) -> bool {
    let are_marked = matches!(looks, [Look::Marks(_)]);
    !are_marked || marks.count_ones() >= 3
}

impl Score {
    fn judge(&mut self, scene: &Scene, seen: &Seen) {
        self.said += 1;
        let off = |robot: &&Robot| {
            let [x, y, _] = scene.seen_from(robot, seen.time_s);
            (seen.pose[0] - x).hypot(seen.pose[1] - y)
        };
        let nearest = scene.robots.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let near = nearest.filter(|robot| off(robot) <= SAME_M);
        match near.map(|robot| robot.number) {
            Some(Some(number)) if number == seen.robot => {}
            Some(Some(_)) => {
                self.wrong += 1;
                return;
            }
            Some(None) | None => {
                self.none += 1;
                return;
            }
        }
        let Some(robot) = near else {
            return;
        };
        let truth = scene.seen_from(robot, seen.time_s);
        let off = [0, 1, 2].map(|it| seen.pose[it] - truth[it]);
        let off = [off[0], off[1], coloc_estimator::angle::wrap(off[2])];
        let place = usize::from(seen.has_heading);
        let nees = nees(off, seen);
        let (count, sum, outside) = self.nees[place];
        self.nees[place] = (
            count + 1,
            sum + nees,
            outside + u64::from(nees > OUTSIDE[place]),
        );
        let far = truth[0].hypot(truth[1]);
        let along = (off[0] * truth[0] + off[1] * truth[1]) / far;
        let across = (off[1] * truth[0] - off[0] * truth[1]) / (far * far);
        self.squares[0] += along * along;
        self.squares[1] += across * across;
        if seen.has_heading {
            self.headings += 1;
            self.squares[2] += off[2] * off[2];
        }
    }
}

fn nees(off: [f64; 3], seen: &Seen) -> f64 {
    use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
    let c = &seen.covariance;
    if seen.has_heading {
        let inverse = Matrix3::from_fn(|row, column| c[row][column]).try_inverse();
        let off = Vector3::from(off);
        return inverse.map_or(f64::INFINITY, |it| (off.transpose() * it * off)[0]);
    }
    let inverse = Matrix2::new(c[0][0], c[0][1], c[1][0], c[1][1]).try_inverse();
    let off = Vector2::new(off[0], off[1]);
    inverse.map_or(f64::INFINITY, |it| (off.transpose() * it * off)[0])
}
