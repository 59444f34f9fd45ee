//! A hall that is made up, and what laser scanners see that drive in it.

use std::f64::consts::{PI, TAU};

use coloc_estimator::Pose;
use coloc_scan::Look;

use super::scene::{ANGLE_SIGMA_RAD, RANGE_SIGMA_M, SHAPE_SIGMA_M};
use super::solid::{Solid, placed, solids};
use crate::random::{Noise, Purpose};

/// Beams of a turn, all the way round.
pub const BEAMS: usize = 360;
/// From one beam to the next \[rad\].
pub const STEP_RAD: f64 = TAU / 360.0;
/// Of the first one, from forward to the left \[rad\].
pub const FIRST_RAD: f64 = -PI;
/// How long a turn takes \[s\].
pub const TURN_S: f64 = 0.1;
/// It sees no farther \[m\].
pub const FARTHEST_M: f64 = 30.0;
/// In the stream of random numbers a turn takes the room of so many steps.
const ROOM: usize = 64;

/// Walls, pillars, and what the robots in between look like.
#[derive(Clone, Debug)]
pub struct Hall {
    solids: Vec<Solid>,
    looks: Vec<Look>,
    /// By so much is each robot larger than it is said to be \[m\].
    larger_m: Vec<f64>,
    mount: Pose,
    noise: Noise,
}

impl Hall {
    /// Half as long and wide as that, with pillars (place and radius); a robot looks like its place in `looks`, and has its scanner at
    /// `mount`.
    #[must_use]
    pub fn new(
        half_m: [f64; 2],
        pillars: &[[f64; 3]],
        looks: Vec<Look>,
        mount: Pose,
        seed: u64,
    ) -> Self {
        let [x, y] = half_m;
        let corners = [[x, y], [-x, y], [-x, -y], [x, -y]];
        let wall = |it: usize| Solid::Wall {
            from: corners[it],
            to: corners[(it + 1) % 4],
        };
        let pillars = pillars.iter().map(|&[x, y, radius]| Solid::Disc {
            centre: [x, y],
            radius,
        });
        let noise = Noise::new(seed, 0);
        let larger =
            |robot| SHAPE_SIGMA_M * noise.draws(Purpose::Laser, 0, robot, robot + 1).normal();
        Self {
            solids: (0..4).map(wall).chain(pillars).collect(),
            larger_m: (0..looks.len()).map(larger).collect(),
            looks,
            mount,
            noise,
        }
    }

    /// What the robots look like.
    #[must_use]
    pub fn looks(&self) -> &[Look] {
        &self.looks
    }

    /// The turn number `turn` of a robot's scanner: a range for each beam, which is measured while everybody drives. `pose` says where a
    /// robot is, so long after the turn began \[s\].
    pub fn scan(
        &self,
        robot: usize,
        turn: usize,
        pose: impl Fn(usize, f64) -> Option<Pose>,
        ranges: &mut Vec<f32>,
    ) {
        let mut draws = self
            .noise
            .draws(Purpose::Laser, turn.saturating_mul(ROOM), robot, robot);
        ranges.clear();
        for beam in 0..BEAMS {
            let [noise, off] = draws.normals::<2>();
            #[allow(clippy::cast_precision_loss)] // Some hundreds.
            let beam = beam as f64;
            let time_s = beam * STEP_RAD / TAU * TURN_S;
            let angle = FIRST_RAD + beam * STEP_RAD + ANGLE_SIGMA_RAD * off;
            let range = self.cast(robot, angle, |robot| pose(robot, time_s));
            #[allow(clippy::cast_possible_truncation)] // As a scanner says it.
            ranges.push((range + RANGE_SIGMA_M * noise) as f32);
        }
    }

    /// Until a ray meets something.
    fn cast(&self, robot: usize, angle: f64, pose: impl Fn(usize) -> Option<Pose>) -> f64 {
        let Some(own) = pose(robot) else {
            return f64::INFINITY;
        };
        let origin = placed([own.x, own.y, own.phi], [self.mount.x, self.mount.y]);
        let angle = own.phi + self.mount.phi + angle;
        let mut nearest = f64::INFINITY;
        let mut meet = |solid: &Solid| {
            nearest = solid
                .range(origin, angle)
                .unwrap_or(f64::INFINITY)
                .min(nearest);
        };
        self.solids.iter().for_each(&mut meet);
        for (other, (look, larger)) in self.looks.iter().zip(&self.larger_m).enumerate() {
            let Some(there) = pose(other).filter(|_| other != robot) else {
                continue;
            };
            let solids = solids(look, [there.x, there.y, there.phi], *larger);
            for (solid, _) in &solids {
                meet(solid);
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(turn: usize) -> Vec<f32> {
        let looks = vec![Look::Cylinder { radius_m: 0.3 }; 2];
        let hall = Hall::new([5.0, 4.0], &[[0.0, 3.0, 0.2]], looks, Pose::default(), 1);
        let poses = [Pose::default(), Pose::new(2.0, 0.0, 0.0)];
        let mut ranges = Vec::new();
        hall.scan(0, turn, |robot, _| Some(poses[robot]), &mut ranges);
        ranges
    }

    #[test]
    fn walls_pillars_and_the_other_robot_are_where_they_stand() {
        let ranges = scan(1);
        for (degree, metres) in [(0, 1.7), (90, 2.8), (180, 5.0), (-90, 4.0)] {
            let beam = usize::try_from(degree + 180).unwrap() % BEAMS;
            assert!(
                (ranges[beam] - metres).abs() < 0.1,
                "{degree}°: {}",
                ranges[beam]
            );
        }
    }

    #[test]
    fn each_turn_has_noise_of_its_own_and_always_the_same() {
        assert_eq!(scan(7), scan(7));
        let apart = scan(7)
            .iter()
            .zip(scan(8))
            .filter(|(a, b)| a.to_bits() == b.to_bits())
            .count();
        assert!(apart < 10, "{apart}");
    }
}
