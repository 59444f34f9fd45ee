//! Robots as rays meet them: worked out by itself, not by what is held to bars here.

use coloc_scan::Look;

/// A pose in the plane \[m, m, rad\].
pub(super) type Pose = [f64; 3];

/// What a ray can meet.
#[derive(Copy, Clone, Debug)]
pub(super) enum Solid {
    Disc { centre: [f64; 2], radius: f64 },
    Wall { from: [f64; 2], to: [f64; 2] },
}

/// Of a mark on its pole \[m\].
pub(super) const MARK_M: f64 = 0.03;
/// What carries the marks \[m\].
const CARRIER_M: f64 = 0.12;

/// A point of a body frame, in the frame of `pose`.
pub(super) fn placed(pose: Pose, [x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = pose[2].sin_cos();
    [pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y]
}

/// The solids of a robot that looks so and is larger by `larger`, each with whether it is bright.
pub(super) fn solids(look: &Look, pose: Pose, larger: f64) -> Vec<(Solid, bool)> {
    match look {
        Look::Cylinder { radius_m } => vec![(disc([pose[0], pose[1]], radius_m + larger), false)],
        Look::Rectangle {
            length_m,
            width_m,
            centre_m,
        } => {
            let (x, y) = (0.5 * length_m + larger, 0.5 * width_m + larger);
            let corner =
                |sx: f64, sy: f64| placed(pose, [centre_m[0] + sx * x, centre_m[1] + sy * y]);
            let corners = [
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
            ];
            let wall = |it: usize| {
                let wall = Solid::Wall {
                    from: corners[it],
                    to: corners[(it + 1) % 4],
                };
                (wall, false)
            };
            (0..4).map(wall).collect()
        }
        Look::Marks(pattern) => {
            let marks = pattern.marks().iter();
            let marks = marks.map(|mark| (disc(placed(pose, *mark), MARK_M), true));
            let carrier = (disc([pose[0], pose[1]], CARRIER_M + larger), false);
            marks.chain([carrier]).collect()
        }
    }
}

fn disc(centre: [f64; 2], radius: f64) -> Solid {
    Solid::Disc { centre, radius }
}

impl Solid {
    /// How far a ray goes until it meets this.
    pub(super) fn range(&self, origin: [f64; 2], angle: f64) -> Option<f64> {
        let (sin, cos) = angle.sin_cos();
        match *self {
            Self::Disc { centre, radius } => {
                let off = [centre[0] - origin[0], centre[1] - origin[1]];
                let along = off[0] * cos + off[1] * sin;
                let aside = off[1] * cos - off[0] * sin;
                let inside = radius * radius - aside * aside;
                (inside > 0.0 && along > 0.0).then(|| along - inside.sqrt())
            }
            Self::Wall { from, to } => {
                let way = [to[0] - from[0], to[1] - from[1]];
                let off = [from[0] - origin[0], from[1] - origin[1]];
                let slant = cos * way[1] - sin * way[0];
                let range = (off[0] * way[1] - off[1] * way[0]) / slant;
                let part = (off[0] * sin - off[1] * cos) / slant;
                (range > 0.0 && (0.0..=1.0).contains(&part)).then_some(range)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_meets_what_stands_in_its_way() {
        let round = disc([2.0, 0.0], 0.5);
        assert!((round.range([0.0, 0.0], 0.0).unwrap_or(0.0) - 1.5).abs() < 1e-12);
        assert!((round.range([1.0, 0.0], 0.0).unwrap_or(0.0) - 0.5).abs() < 1e-12);
        assert_eq!(round.range([0.0, 0.0], 0.3), None);
        let look = Look::Rectangle {
            length_m: 0.6,
            width_m: 0.4,
            centre_m: [0.1, 0.0],
        };
        let ranges = |pose| {
            let solids = solids(&look, pose, 0.0);
            let ranges = solids.iter().filter_map(|it| it.0.range([0.0, 0.0], 0.0));
            ranges.fold(f64::INFINITY, f64::min)
        };
        assert!((ranges([2.0, 0.0, 0.0]) - 1.8).abs() < 1e-12);
        assert!((ranges([2.0, 0.0, std::f64::consts::PI]) - 1.6).abs() < 1e-12);
    }
}
