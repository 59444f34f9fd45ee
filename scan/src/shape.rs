//! What a robot looks like at the height of the scanner, and what a ray makes of it.

use nalgebra::Vector2;

use crate::beams::Ray;

/// As many marks as a pattern has at most.
pub const MOST_MARKS: usize = 8;

/// What a robot looks like at the height of the scanner.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Look {
    /// A cylinder around the robot's origin. It has no heading.
    Cylinder {
        /// \[m\]
        radius_m: f64,
    },
    /// A rectangle that looks along its length.
    Rectangle {
        /// From its rear to its front \[m\].
        length_m: f64,
        /// From its left to its right \[m\].
        width_m: f64,
        /// Where its middle is in the robot's body frame \[m\].
        centre_m: [f64; 2],
    },
    /// Reflective marks, whatever carries them.
    Marks(Pattern),
}

/// Where marks are in a robot's body frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Pattern {
    marks: [[f64; 2]; MOST_MARKS],
    count: usize,
    radius_m: f64,
}

/// A robot is no larger \[m\].
const MOST_REACH_M: f64 = 5.0;
/// Marks that are nearer to each other are one, where they are seen \[m\].
const LEAST_APART_M: f64 = 0.05;
/// Pairs of marks are known by how far they are apart, if that differs by so much \[m\].
const LEAST_OTHER_M: f64 = 0.01;

/// Of each pair \[m\].
fn distances(marks: &[[f64; 2]]) -> Vec<f64> {
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let pairs = marks.iter().enumerate();
    pairs
        .flat_map(|(place, one)| marks[..place].iter().map(move |other| apart(one, other)))
        .collect()
}

impl Pattern {
    /// Of these marks, the middles of poles with this radius; zero for what is flat \[m\].
    ///
    /// # Errors
    /// What is wrong with them, in words.
    pub fn new(marks: &[[f64; 2]], radius_m: f64) -> Result<Self, &'static str> {
        if !(3..=MOST_MARKS).contains(&marks.len()) {
            return Err("a pattern has 3 to 8 marks");
        }
        if !marks.iter().flatten().all(|it| it.abs() <= MOST_REACH_M) {
            return Err("marks are at most 5 m from the robot's origin");
        }
        let mut apart = distances(marks);
        apart.sort_by(f64::total_cmp);
        if apart[0] < LEAST_APART_M.max(2.0 * radius_m) {
            return Err(
                "two marks nearer to each other than 5 cm, or than their poles are wide, are seen as one",
            );
        }
        if apart
            .windows(2)
            .any(|pair| pair[1] - pair[0] < LEAST_OTHER_M)
        {
            return Err(
                "two pairs of marks are as far apart, to 1 cm: which is which could not be seen",
            );
        }
        let mut pattern = Self {
            marks: [[0.0; 2]; MOST_MARKS],
            count: marks.len(),
            radius_m,
        };
        pattern.marks[..marks.len()].copy_from_slice(marks);
        Ok(pattern)
    }

    /// The marks.
    #[must_use]
    pub fn marks(&self) -> &[[f64; 2]] {
        &self.marks[..self.count]
    }

    /// Of the poles \[m\].
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }
}

impl Look {
    /// From its middle to its farthest point \[m\].
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        match self {
            Self::Cylinder { radius_m } => *radius_m,
            Self::Rectangle {
                length_m, width_m, ..
            } => 0.5 * length_m.hypot(*width_m),
            Self::Marks(pattern) => {
                let reaches = pattern.marks().iter().map(|[x, y]| x.hypot(*y));
                reaches.fold(0.0, f64::max)
            }
        }
    }
}

/// A body that stands somewhere.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) enum Body {
    Round {
        centre: Vector2<f64>,
        radius: f64,
    },
    Square {
        centre: Vector2<f64>,
        /// Along its length and across.
        half: Vector2<f64>,
        /// Which way its length goes, of length 1.
        along: Vector2<f64>,
    },
}

/// Where a ray meets a body.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Hit {
    pub(crate) range: f64,
    /// Of the surface there, outward.
    pub(crate) normal: Vector2<f64>,
}

/// A vector turned to the left by a right angle.
pub(crate) fn left_of(vector: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-vector.y, vector.x)
}

/// How far the second goes to the left of the first.
pub(crate) fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

impl Body {
    /// Where `ray` meets the body, that is so much larger on each side.
    pub(crate) fn hit(&self, ray: &Ray, larger: f64) -> Option<Hit> {
        match *self {
            Self::Round { centre, radius } => hit_round(ray, centre, radius + larger),
            Self::Square {
                centre,
                half,
                along,
            } => hit_square(ray, centre, half.add_scalar(larger), along),
        }
    }

    /// Whether `point` is inside of the body, that is so much larger on each side.
    pub(crate) fn contains(&self, point: Vector2<f64>, larger: f64) -> bool {
        match *self {
            Self::Round { centre, radius } => (point - centre).norm() <= radius + larger,
            Self::Square {
                centre,
                half,
                along,
            } => {
                let off = point - centre;
                let (x, y) = (off.dot(&along), off.dot(&left_of(along)));
                x.abs() <= half.x + larger && y.abs() <= half.y + larger
            }
        }
    }

    pub(crate) fn centre(&self) -> Vector2<f64> {
        match *self {
            Self::Round { centre, .. } | Self::Square { centre, .. } => centre,
        }
    }

    /// From its middle to its farthest point.
    pub(crate) fn reach(&self) -> f64 {
        match *self {
            Self::Round { radius, .. } => radius,
            Self::Square { half, .. } => half.norm(),
        }
    }
}

fn hit_round(ray: &Ray, centre: Vector2<f64>, radius: f64) -> Option<Hit> {
    let off = centre - ray.origin;
    let along = off.dot(&ray.direction);
    let across = cross(ray.direction, off);
    let inside = radius * radius - across * across;
    let range = along - inside.max(0.0).sqrt();
    (radius > 0.0 && inside >= 0.0 && range > 0.0).then(|| Hit {
        range,
        normal: (ray.origin + ray.direction * range - centre) / radius,
    })
}

/// Where a ray meets a rectangle, in the rectangle's own frame: through which face, and its range as a fraction.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Entry {
    /// Whether through a face that looks along its length, not across.
    pub(crate) is_along: bool,
    /// 1: that face looks the way of its axis; −1: the other way.
    pub(crate) sign: f64,
    over: f64,
    under: f64,
}

/// Through which face a ray that starts at `from` and goes along `way` enters a rectangle around the origin. No division: it is asked of
/// every beam in every step of a fit.
#[inline]
pub(crate) fn enter(from: Vector2<f64>, way: Vector2<f64>, half: Vector2<f64>) -> Option<Entry> {
    let (sign_x, sign_y) = (1.0_f64.copysign(way.x), 1.0_f64.copysign(way.y));
    let (speed_x, speed_y) = (way.x.abs(), way.y.abs());
    // How far it is to the near and to the far face, as often as the speed.
    let (place_x, place_y) = (from.x * sign_x, from.y * sign_y);
    let (near_x, near_y) = (-half.x - place_x, -half.y - place_y);
    let (far_x, far_y) = (half.x - place_x, half.y - place_y);
    let is_along = near_x * speed_y > near_y * speed_x;
    let (over, under, sign, enters, leaves) = if is_along {
        (near_x, speed_x, -sign_x, near_x * speed_y, far_y * speed_x)
    } else {
        (near_y, speed_y, -sign_y, near_y * speed_x, far_x * speed_y)
    };
    (over > 0.0 && enters <= leaves).then_some(Entry {
        is_along,
        sign,
        over,
        under,
    })
}

fn hit_square(
    ray: &Ray,
    centre: Vector2<f64>,
    half: Vector2<f64>,
    along: Vector2<f64>,
) -> Option<Hit> {
    let (left, off) = (left_of(along), ray.origin - centre);
    let from = Vector2::new(off.dot(&along), off.dot(&left));
    let way = Vector2::new(ray.direction.dot(&along), ray.direction.dot(&left));
    let entry = enter(from, way, half)?;
    let axis = if entry.is_along { along } else { left };
    Some(Hit {
        range: entry.over / entry.under,
        normal: axis * entry.sign,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Met;

    fn ray(x: f64, y: f64) -> Ray {
        Ray {
            origin: Vector2::zeros(),
            direction: Vector2::new(x, y).normalize(),
            met: Met::Nothing,
        }
    }

    #[test]
    fn a_ray_meets_a_cylinder_in_front_of_it_and_none_beside_or_behind() {
        let body = Body::Round {
            centre: Vector2::new(2.0, 0.0),
            radius: 0.5,
        };
        let hit = body.hit(&ray(1.0, 0.0), 0.0).unwrap();
        assert!((hit.range - 1.5).abs() < 1e-12 && (hit.normal.x + 1.0).abs() < 1e-12);
        assert_eq!(body.hit(&ray(1.0, 0.3), 0.0), None);
        assert!(body.hit(&ray(1.0, 0.3), 0.2).is_some());
        assert_eq!(body.hit(&ray(-1.0, 0.0), 0.0), None);
    }

    #[test]
    fn a_ray_meets_the_face_of_a_rectangle_that_looks_at_it() {
        let body = Body::Square {
            centre: Vector2::new(2.0, 0.1),
            half: Vector2::new(0.3, 0.2),
            along: Vector2::new(0.0, 1.0),
        };
        let hit = body.hit(&ray(1.0, 0.0), 0.0).unwrap();
        assert!((hit.range - 1.8).abs() < 1e-12 && (hit.normal.x + 1.0).abs() < 1e-12);
        assert_eq!(body.hit(&ray(1.0, -0.2), 0.0), None);
        assert!(body.contains(Vector2::new(2.19, 0.39), 0.0));
        assert!(!body.contains(Vector2::new(2.21, 0.1), 0.0));
        assert!(body.contains(Vector2::new(2.21, 0.1), 0.02));
    }

    #[test]
    fn a_ray_along_a_face_meets_the_one_across_or_none() {
        let half = Vector2::new(0.3, 0.2);
        let way = Vector2::new(1.0, 0.0);
        for (y, meets) in [(0.19, true), (-0.19, true), (0.21, false), (-0.21, false)] {
            let entry = enter(Vector2::new(-1.0, y), way, half);
            assert_eq!(entry.is_some(), meets, "{y}");
            assert!(entry.is_none_or(|it| it.is_along && it.sign < 0.0));
        }
        let inside = enter(Vector2::zeros(), way, half);
        assert!(inside.is_none());
    }

    #[test]
    fn a_pattern_has_marks() {
        assert!(
            Pattern::new(&[[0.0; 2]; 2], 0.0).is_err()
                && Pattern::new(&[[0.0; 2]; 9], 0.0).is_err()
        );
        for (marks, said) in [
            ([[0.0; 2]; 3], "seen as one"),
            ([[0.3, 0.0], [0.0, 0.2], [0.0, 0.17]], "seen as one"),
            ([[0.3, 0.0], [-0.1, 0.2], [-0.1, -0.2]], "which is which"),
            ([[0.3, 0.0], [0.0, 0.2], [1e9, 0.0]], "at most 5 m"),
            ([[0.3, 0.0], [0.0, 0.2], [f64::NAN, 0.0]], "at most 5 m"),
        ] {
            let problem = Pattern::new(&marks, 0.0).unwrap_err();
            assert!(problem.contains(said), "{problem}");
        }
        let marks = [[0.3, 0.0], [0.0, 0.2], [0.0, -0.1]];
        assert!(Pattern::new(&marks, 0.2).is_err());
        let pattern = Pattern::new(&marks, 0.0).unwrap();
        assert_eq!(pattern.marks().len(), 3);
        assert!((Look::Marks(pattern).reach_m() - 0.3).abs() < 1e-12);
    }
}
