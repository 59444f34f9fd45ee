//! A convex set between two polygons, made of searches in one direction each.
//!
//! A search says how far the set goes and a point where it goes so far. The points span the inner polygon, the lines through them are the outer
//! one. Between two neighbouring lines a triangle is left in which nobody knows where the set ends. After the first four
//! searches the outer polygon has twice the area of the inner one, exactly; from there on each search goes into the largest triangle, and
//! takes three quarters of it at least.

use crate::measurement::{spaced, unit};
use crate::polygon::{area, centroid, cross, meet};
use crate::polytope::Support;

/// Directions nearer than this are one \[rad\].
const SAME: f64 = 1e-9;

/// Lines whose directions have a smaller cross product are parallel.
const PARALLEL: f64 = 1e-12;

/// When to stop.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Limits {
    /// Inner area of outer.
    pub ratio: f64,
    /// Outer area less inner \[m²\].
    pub gap: f64,
    /// How many searches at most, the first four among them.
    pub searches: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            ratio: 0.95,
            gap: 0.0,
            searches: 32,
        }
    }
}

/// What counts as nothing.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// A width \[m\].
    pub shortest: f64,
    /// A triangle's area, of the outer polygon's.
    pub triangle: f64,
    /// An inner edge: rounding of the searches' points \[m\].
    pub edge: f64,
}

impl Tolerance {
    /// For searches by linear programs in an arena.
    #[must_use]
    pub fn of_programs(arena: &crate::Arena) -> Self {
        Self {
            shortest: arena.shortest(),
            triangle: 1e-9,
            edge: 1e-6,
        }
    }
}

/// What the set is.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Shape {
    /// It has an area.
    Polygon,
    /// It has none.
    Segment([[f64; 2]; 2]),
    /// Not even a length.
    Point([f64; 2]),
    /// Only the arena stops it somewhere.
    Unbounded,
}

/// One search.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Side {
    /// A unit vector.
    pub direction: [f64; 2],
    /// What it found.
    pub found: Support,
    angle: f64,
    /// Nothing more to find between this side and the next one.
    closed: bool,
}

/// The two polygons.
#[derive(Clone, Debug)]
pub struct Sandwich {
    sides: Vec<Side>,
    shape: Shape,
    searches: usize,
    tolerance: Tolerance,
}

impl Sandwich {
    /// The first four searches, the first of them in direction `first`, a unit vector. `None` if a search fails.
    pub fn start(
        search: &mut impl FnMut([f64; 2]) -> Option<Support>,
        first: [f64; 2],
        tolerance: Tolerance,
    ) -> Option<Self> {
        let mut new = Self {
            sides: Vec::with_capacity(Limits::default().searches),
            shape: Shape::Polygon,
            searches: 0,
            tolerance,
        };
        let a = new.search(search, first)?;
        let b = new.search(search, opposite(first))?;
        let chord = [b.point[0] - a.point[0], b.point[1] - a.point[1]];
        let length = libm::hypot(chord[0], chord[1]);
        let (flat, short) = (
            a.value + b.value <= tolerance.shortest,
            length <= tolerance.shortest,
        );
        let along = chord.map(|it| it / length);
        let third = match (short, flat) {
            (true, _) => across(first),
            (false, true) => along,
            (false, false) => across(along),
        };
        let c = new.search(search, third)?;
        let d = new.search(search, opposite(third))?;
        let narrow = c.value + d.value <= tolerance.shortest;
        if new.sides.iter().any(|it| it.found.unbounded) {
            new.shape = Shape::Unbounded;
        } else if short && narrow {
            new.shape = Shape::Point(a.point);
        } else if flat {
            new.shape = Shape::Segment([c.point, d.point]);
        } else if narrow {
            new.shape = Shape::Segment([a.point, b.point]);
        }
        Some(new)
    }

    /// Searches until one of the limits is met, or nothing is left to find. `None` if one of the first four fails.
    pub fn approximate(
        search: &mut impl FnMut([f64; 2]) -> Option<Support>,
        first: [f64; 2],
        tolerance: Tolerance,
        limits: Limits,
    ) -> Option<Self> {
        let mut sandwich = Self::start(search, first, tolerance)?;
        while sandwich.searches < limits.searches
            && sandwich.ratio() < limits.ratio
            && sandwich.gap() > limits.gap
            && sandwich.refine(search)
        {}
        Some(sandwich)
    }

    /// `count` searches, at least three, in equally spaced directions, from x on.
    pub fn uniform(
        search: &mut impl FnMut([f64; 2]) -> Option<Support>,
        count: usize,
        tolerance: Tolerance,
    ) -> Option<Self> {
        let mut new = Self {
            sides: Vec::with_capacity(count),
            shape: Shape::Polygon,
            searches: 0,
            tolerance,
        };
        for k in 0..count {
            if new.search(search, unit(spaced(k, count)))?.unbounded {
                new.shape = Shape::Unbounded;
            }
        }
        Some(new)
    }

    /// One search into the largest triangle; whether there was anything left to find.
    pub fn refine(&mut self, search: &mut impl FnMut([f64; 2]) -> Option<Support>) -> bool {
        if self.shape != Shape::Polygon {
            return false;
        }
        let triangles = (0..self.sides.len()).map(|k| (k, self.triangle(k)));
        let largest = triangles.reduce(|a, b| if b.1 > a.1 { b } else { a });
        let Some((k, size)) = largest else {
            return false;
        };
        if size <= self.tolerance.triangle * self.outer_area() {
            return false;
        }
        let edge = self.edge(k);
        let length = libm::hypot(edge[0], edge[1]);
        let direction = [edge[1] / length, -edge[0] / length];
        // A search that fails costs this triangle alone: the outer polygon is good without.
        self.sides[k].closed = true;
        let before = self.sides.len();
        match self.search(search, direction) {
            Some(found) if found.unbounded => self.shape = Shape::Unbounded,
            Some(_) if self.sides.len() > before => self.open(direction),
            Some(_) | None => {}
        }
        true
    }

    fn search(
        &mut self,
        search: &mut impl FnMut([f64; 2]) -> Option<Support>,
        direction: [f64; 2],
    ) -> Option<Support> {
        self.searches += 1;
        let found = search(direction)?;
        self.insert(Side {
            direction,
            found,
            angle: libm::atan2(direction[1], direction[0]),
            closed: false,
        });
        Some(found)
    }

    /// Sides are in the order of their angles. Of two in the same direction the one that goes further stays.
    fn insert(&mut self, side: Side) {
        let same = self
            .sides
            .iter_mut()
            .find(|it| crate::wrap(it.angle - side.angle).abs() < SAME);
        if let Some(same) = same {
            if side.found.value > same.found.value {
                same.found.value = side.found.value;
                same.found.point = side.found.point;
            }
            same.found.safe = same.found.safe.max(side.found.safe);
            same.found.unbounded |= side.found.unbounded;
            return;
        }
        let place = self.sides.partition_point(|it| it.angle < side.angle);
        self.sides.insert(place, side);
    }

    /// The triangle into which was searched is two now, and both are open.
    fn open(&mut self, direction: [f64; 2]) {
        let angle = libm::atan2(direction[1], direction[0]);
        let count = self.sides.len();
        let new = self.sides.iter().position(|it| it.angle >= angle);
        if let Some(new) = new {
            self.sides[(new + count - 1) % count].closed = false;
        }
    }

    fn next(&self, k: usize) -> &Side {
        &self.sides[(k + 1) % self.sides.len()]
    }

    /// The inner edge from side `k` to the next one.
    fn edge(&self, k: usize) -> [f64; 2] {
        let (a, b) = (self.sides[k].found.point, self.next(k).found.point);
        [b[0] - a[0], b[1] - a[1]]
    }

    /// The area between side `k` and the next one in which nobody knows \[m²\].
    fn triangle(&self, k: usize) -> f64 {
        let (a, b) = (&self.sides[k], self.next(k));
        let turn = cross(a.direction, b.direction);
        let ahead = a.direction[0] * b.direction[0] + a.direction[1] * b.direction[1];
        let edge = self.edge(k);
        if turn.abs() < PARALLEL && ahead > 0.0 {
            return 0.0;
        }
        if turn < PARALLEL {
            return f64::INFINITY;
        }
        if a.closed || libm::hypot(edge[0], edge[1]) < self.tolerance.edge {
            return 0.0;
        }
        let apex = self.apex(k, |it| it.value);
        let from = [apex[0] - a.found.point[0], apex[1] - a.found.point[1]];
        (cross(from, edge) / 2.0).max(0.0)
    }

    /// Where side `k` and the next one meet.
    fn apex(&self, k: usize, how_far: impl Fn(&Support) -> f64) -> [f64; 2] {
        let (a, b) = (&self.sides[k], self.next(k));
        if cross(a.direction, b.direction).abs() < PARALLEL {
            return a.found.point;
        }
        meet(
            (a.direction, how_far(&a.found)),
            (b.direction, how_far(&b.found)),
        )
    }

    /// What the set is.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// How many searches.
    #[must_use]
    pub fn searches(&self) -> usize {
        self.searches
    }

    /// In the order of their directions.
    #[must_use]
    pub fn sides(&self) -> &[Side] {
        &self.sides
    }

    /// Points of the set.
    #[must_use]
    pub fn inner(&self) -> Vec<[f64; 2]> {
        self.sides.iter().map(|it| it.found.point).collect()
    }

    /// The polygon around the set, as the searches' points have it.
    #[must_use]
    pub fn outer(&self) -> Vec<[f64; 2]> {
        (0..self.sides.len())
            .map(|k| self.apex(k, |it| it.value))
            .collect()
    }

    /// The polygon around the set, which rounding cannot make too small: what is told to others.
    #[must_use]
    pub fn outer_safe(&self) -> Vec<[f64; 2]> {
        (0..self.sides.len())
            .map(|k| self.apex(k, |it| it.safe))
            .collect()
    }

    /// Whether no search says that `point` is outside.
    #[must_use]
    pub fn may_hold(&self, point: [f64; 2]) -> bool {
        self.sides
            .iter()
            .all(|it| it.direction[0] * point[0] + it.direction[1] * point[1] <= it.found.safe)
    }

    /// \[m²\]
    #[must_use]
    pub fn inner_area(&self) -> f64 {
        area(&self.inner())
    }

    /// \[m²\]
    #[must_use]
    pub fn outer_area(&self) -> f64 {
        area(&self.outer())
    }

    /// Outer area less inner \[m²\].
    #[must_use]
    pub fn gap(&self) -> f64 {
        match self.shape {
            Shape::Polygon => self.outer_area() - self.inner_area(),
            Shape::Segment(_) | Shape::Point(_) => 0.0,
            Shape::Unbounded => f64::INFINITY,
        }
    }

    /// Inner area of outer, from 0 to 1: 1 is exact, and so is a set without an area. Where a set is as thin as rounding, so is what this says.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        match self.shape {
            Shape::Polygon => (self.inner_area() / self.outer_area()).clamp(0.0, 1.0),
            Shape::Segment(_) | Shape::Point(_) => 1.0,
            Shape::Unbounded => 0.0,
        }
    }

    /// One point for those who need one: the centre of the outer polygon. An unbounded set has none.
    #[must_use]
    pub fn centroid(&self) -> Option<[f64; 2]> {
        match self.shape {
            Shape::Polygon => centroid(&self.outer()),
            Shape::Segment([a, b]) => Some([f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])]),
            Shape::Point(at) => Some(at),
            Shape::Unbounded => None,
        }
    }

    /// The distance from `estimate` to the farthest vertex of the outer polygon \[m\].
    #[must_use]
    pub fn protection_radius(&self, estimate: [f64; 2]) -> f64 {
        if self.shape == Shape::Unbounded {
            return f64::INFINITY;
        }
        let vertices = self.outer_safe().into_iter();
        vertices
            .map(|it| libm::hypot(it[0] - estimate[0], it[1] - estimate[1]))
            .fold(0.0, f64::max)
    }
}

fn opposite(direction: [f64; 2]) -> [f64; 2] {
    direction.map(|it| -it)
}

fn across(direction: [f64; 2]) -> [f64; 2] {
    [-direction[1], direction[0]]
}
