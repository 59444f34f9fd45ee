//! What a team can know at all \[B10\]: the rank of its measurements' Jacobians over some instants, `H_k Φ_{k−1} … Φ_0`.

use coloc_estimator::{Covariance3, Motion, Pose};
use coloc_rounds::model::{Kind, drive, predict};
use nalgebra::Matrix3;

use super::Matrix;

/// Singular values below this part of the largest are rounding.
const ROUNDING: f64 = 1e-9;

/// What is measured at every instant.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Sense {
    /// What.
    pub kind: Kind,
    /// By whom, or of whom.
    pub a: usize,
    /// Of whom; of no meaning where there is no second robot.
    pub b: usize,
}

/// Robots that move and what they measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Where they are.
    pub poses: Vec<Pose>,
    /// How they move, `[v_x, v_y, ω]`; `Φ = I` if there is no motion.
    pub motions: Option<Vec<[f64; 3]>>,
    /// From one instant to the next \[s\].
    pub dt_s: f64,
    /// Instants.
    pub instants: usize,
    /// What they measure.
    pub senses: Vec<Sense>,
}

/// The stacked matrix.
#[must_use]
pub fn stacked(setting: &Setting) -> Matrix {
    let robots = setting.poses.len();
    let per_instant: usize = setting.senses.iter().map(|it| it.kind.dimension()).sum();
    let mut all = Matrix::zeros(per_instant * setting.instants, 3 * robots);
    let mut poses = setting.poses.clone();
    let mut phi = vec![Matrix3::identity(); robots];
    let mut row = 0;
    for _ in 0..setting.instants {
        for sense in &setting.senses {
            let expected = predict(sense.kind, &poses[sense.a], &poses[sense.b]);
            let rows = sense.kind.dimension();
            let mut put = |robot: usize, h: &Matrix3<f64>| {
                let block = h * phi[robot];
                let mut place = all.view_mut((row, 3 * robot), (rows, 3));
                place.copy_from(&block.rows(0, rows));
            };
            put(sense.a, &expected.first);
            if sense.kind.is_of_two() {
                put(sense.b, &expected.second);
            }
            row += rows;
        }
        if let Some(motions) = &setting.motions {
            for (robot, velocity) in motions.iter().enumerate() {
                let motion = Motion::Holonomic {
                    velocity: *velocity,
                    noise: Covariance3::ZERO,
                };
                let step = drive(&poses[robot], &motion, setting.dt_s);
                poses[robot] = step.pose;
                phi[robot] = step.jacobian * phi[robot];
            }
        }
    }
    all
}

/// How many of the team's 3 N numbers are observable, from the singular values.
#[must_use]
pub fn rank(matrix: &Matrix) -> usize {
    let values = matrix.singular_values();
    let least = ROUNDING * values.iter().copied().fold(0.0, f64::max);
    values.iter().filter(|value| **value > least).count()
}

/// What a team has, in words: who sees whom, who has fixes or knows its pose otherwise, who moves.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outfit {
    /// How many robots.
    pub robots: usize,
    /// Who sees whom, and what of it.
    pub sights: Vec<(usize, usize, Option<Kind>)>,
    /// Who has a receiver.
    pub fixes: Vec<usize>,
    /// Who has a compass besides, or is a landmark: its pose is known.
    pub known: Vec<usize>,
    /// Who stands still.
    pub still: Vec<usize>,
}

/// What is observable of it, and what would help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Of 3 for each robot.
    pub rank: usize,
    /// Numbers that nobody can know.
    pub missing: usize,
    /// Robots whose own pose is not observable.
    pub lost: Vec<usize>,
    /// Robots that would have to move for more to be observable, each alone.
    pub should_move: Vec<usize>,
    /// Robots of which a receiver would make more observable, each alone.
    pub should_have_fixes: Vec<usize>,
}

impl Outfit {
    /// What can be known of the team in general: robots at places without any symmetry.
    #[must_use]
    pub fn judge(&self) -> Finding {
        let matrix = stacked(&self.setting());
        let rank = rank(&matrix);
        let missing = 3 * self.robots - rank;
        let better = |outfit: &Self| self::rank(&stacked(&outfit.setting())) > rank;
        let moved = |robot: &usize| {
            let mut other = self.clone();
            other.still.retain(|it| it != robot);
            better(&other)
        };
        let with_fixes = |robot: &usize| {
            let mut other = self.clone();
            other.fixes.push(*robot);
            better(&other)
        };
        Finding {
            rank,
            missing,
            lost: (0..self.robots)
                .filter(|robot| is_lost(&matrix, rank, *robot))
                .collect(),
            should_move: self.still.iter().copied().filter(moved).collect(),
            should_have_fixes: (0..self.robots)
                .filter(|it| !self.fixes.contains(it) && !self.known.contains(it))
                .filter(with_fixes)
                .collect(),
        }
    }

    #[allow(clippy::cast_precision_loss)] // A team is small.
    fn setting(&self) -> Setting {
        let (mut poses, mut motions) = (Vec::new(), Vec::new());
        for robot in 0..self.robots {
            let k = robot as f64;
            // Places on a spiral, and arcs of different curvature.
            let (turn, far) = (2.399_963 * k + 0.3, 2.0 + 1.3 * k);
            poses.push(Pose::new(
                far * libm::cos(turn),
                far * libm::sin(turn),
                1.7 * k + 0.2,
            ));
            let is_still = self.still.contains(&robot);
            motions.push(if is_still {
                [0.0; 3]
            } else {
                [0.5 + 0.07 * k, 0.0, 0.3 - 0.11 * k]
            });
        }
        let sense = |kind, a, b| Sense { kind, a, b };
        let sights = self
            .sights
            .iter()
            .map(|(a, b, kind)| sense(kind.unwrap_or(Kind::Pose), *a, *b));
        let fixes = self.fixes.iter().map(|it| sense(Kind::Position, *it, *it));
        let known = self
            .known
            .iter()
            .map(|it| sense(Kind::AbsolutePose, *it, *it));
        Setting {
            poses,
            motions: Some(motions),
            dt_s: 1.0,
            instants: 5,
            senses: sights.chain(fixes).chain(known).collect(),
        }
    }
}

/// Whether the rank would grow if the robot's pose were measured beside: then it is not observable.
fn is_lost(matrix: &Matrix, known: usize, robot: usize) -> bool {
    let rows = matrix.nrows();
    let mut with = matrix.clone().insert_rows(rows, 3, 0.0);
    let mut pose = with.view_mut((rows, 3 * robot), (3, 3));
    pose.fill_with_identity();
    rank(&with) > known
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(robots: usize) -> Outfit {
        Outfit {
            robots,
            sights: (1..robots).map(|it| (it - 1, it, None)).collect(),
            ..Outfit::default()
        }
    }

    #[test]
    fn a_team_without_a_receiver_knows_all_but_where_it_is_and_one_receiver_is_enough() {
        let finding = chain(3).judge();
        assert_eq!((finding.rank, finding.missing), (6, 3));
        assert_eq!(finding.lost, [0, 1, 2]);
        assert_eq!(finding.should_have_fixes, [0, 1, 2]);
        let with = Outfit {
            fixes: vec![1],
            ..chain(3)
        };
        assert_eq!(with.judge().missing, 0);
    }

    #[test]
    fn a_receiver_on_a_robot_that_stands_leaves_the_heading_and_who_should_move_is_named() {
        let still = Outfit {
            fixes: vec![0],
            still: vec![0, 1, 2],
            ..chain(3)
        };
        let finding = still.judge();
        assert_eq!((finding.missing, finding.lost), (1, vec![0, 1, 2]));
        assert_eq!(finding.should_move, [0]);
        assert_eq!(finding.should_have_fixes, [1, 2]);
    }

    #[test]
    fn who_sees_nobody_is_lost_alone() {
        let mut outfit = chain(3);
        outfit.robots = 4;
        outfit.known = vec![2];
        let finding = outfit.judge();
        assert_eq!(finding.lost, [3]);
        assert_eq!(finding.should_have_fixes, [3]);
    }
}
