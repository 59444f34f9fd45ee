//! All inequalities of a team, in a frame that is fixed, and the shadows of what they leave.

use crate::measurement::{HalfPlane, Measurement, Place, Refused, unit};
use crate::program::Program;
use crate::simplex::{Conflict, NoVertex, Simplex};

/// What was measured has no scale if this coordinate is smaller \[m\].
const NO_SCALE_M: f64 = 1e-6;

/// A coordinate of a robot that is given, so that the frame is fixed.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Gauge {
    /// From 0.
    pub robot: usize,
    /// x: 0, y: 1.
    pub axis: usize,
    /// \[m\]
    pub value: f64,
}

/// Where everybody is at any rate, so that no program is without a maximum.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Arena {
    /// \[m\]
    pub centre: [f64; 2],
    /// Half of its side \[m\].
    pub half: f64,
}

impl Arena {
    /// Shorter than this is a point: rounding of positions in it \[m\].
    #[must_use]
    pub fn shortest(&self) -> f64 {
        1e-9 * (1.0 + self.half)
    }
}

/// What a row comes from.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// By its place in the list.
    Measurement(usize),
    /// Where a robot was, and how it can have moved.
    Motion(usize),
    /// Where one robot was seen from another, and how both can have moved.
    Pair(usize, usize),
}

/// Why a frame cannot be fixed so.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum BadFrame {
    /// A robot, axis or value that is none, or a coordinate that is given twice.
    BadGauge,
    /// The coordinate that gives the scale is zero.
    NoScale,
    /// Nobody sees the robot of the gauge.
    GaugeNotConnected,
    /// An arena that is no square, or a slack below zero.
    BadArena,
}

/// `Σ factor · coordinate ≤ rhs`
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Row {
    terms: [(usize, f64); 4],
    count: usize,
    /// \[m\]
    pub rhs: f64,
    /// What it comes from.
    pub source: Source,
}

impl Row {
    /// By the number of the unknown.
    #[must_use]
    pub fn terms(&self) -> &[(usize, f64)] {
        &self.terms[..self.count]
    }
}

#[derive(Copy, Clone, Debug, PartialEq)]
enum Coordinate {
    Free(usize),
    Given(f64),
}

/// A robot's position, or one seen from another: `x_i − x_j`.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Projection {
    /// From 0.
    Robot(usize),
    /// `(i, j)`
    Difference(usize, usize),
}

/// The inequalities.
#[derive(Clone, Debug)]
pub struct Polytope {
    coordinates: Vec<[Coordinate; 2]>,
    columns: usize,
    gauge: Vec<Gauge>,
    arena: Arena,
    slack_m: f64,
    rows: Vec<Row>,
    seen: Vec<bool>,
}

impl Polytope {
    /// Of `robots`, without any inequality yet. `slack_m` is added to each right-hand side, so that rounding of sines cuts nothing off.
    ///
    /// # Errors
    /// If the frame or the arena means nothing.
    pub fn new(
        robots: usize,
        gauge: &[Gauge],
        arena: Arena,
        slack_m: f64,
    ) -> Result<Self, BadFrame> {
        let square = arena.half > 0.0 && arena.half.is_finite();
        if !square
            || !arena.centre.iter().all(|it| it.is_finite())
            || !(0.0..1.0).contains(&slack_m)
        {
            return Err(BadFrame::BadArena);
        }
        let mut coordinates = vec![[Coordinate::Free(0); 2]; robots];
        for it in gauge {
            let place = coordinates
                .get_mut(it.robot)
                .and_then(|of| of.get_mut(it.axis));
            match place {
                Some(place @ Coordinate::Free(_)) if it.value.is_finite() => {
                    *place = Coordinate::Given(it.value);
                }
                _ => return Err(BadFrame::BadGauge),
            }
        }
        check_scale(&coordinates)?;
        let mut columns = 0;
        for coordinate in coordinates.iter_mut().flatten() {
            if let Coordinate::Free(number) = coordinate {
                *number = columns;
                columns += 1;
            }
        }
        Ok(Self {
            seen: vec![false; robots],
            gauge: gauge.to_vec(),
            coordinates,
            columns,
            arena,
            slack_m,
            rows: Vec::new(),
        })
    }

    /// Adds what `measurement` says.
    ///
    /// # Errors
    /// If it means nothing; then nothing is added.
    pub fn add(&mut self, measurement: &Measurement, source: Source) -> Result<(), Refused> {
        measurement.check(self.robots())?;
        let (from, to) = measurement.ends();
        for place in [from, to] {
            if let Place::Robot(robot) = place {
                self.seen[robot] = true;
            }
        }
        measurement.half_planes(&mut |half_plane| self.push(from, to, half_plane, source));
        Ok(())
    }

    /// Adds `half_plane` of a robot's position, or of one seen from another. Infinite ones say nothing.
    pub fn bound(&mut self, projection: Projection, half_plane: HalfPlane, source: Source) {
        if half_plane.rhs.is_finite() {
            let (from, to) = match projection {
                Projection::Robot(i) => (Place::At([0.0; 2]), Place::Robot(i)),
                Projection::Difference(i, j) => (Place::Robot(j), Place::Robot(i)),
            };
            self.push(from, to, half_plane, source);
        }
    }

    fn push(&mut self, from: Place, to: Place, half_plane: HalfPlane, source: Source) {
        let mut row = Row {
            terms: [(0, 0.0); 4],
            count: 0,
            rhs: half_plane.rhs,
            source,
        };
        for (place, sign) in [(from, -1.0), (to, 1.0)] {
            for axis in 0..2 {
                let factor = sign * half_plane.normal[axis];
                match self.coordinate(place, axis) {
                    Coordinate::Free(column) => {
                        row.terms[row.count] = (column, factor);
                        row.count += 1;
                    }
                    Coordinate::Given(value) => row.rhs -= factor * value,
                }
            }
        }
        row.rhs += self.slack_m;
        if row.count > 0 || row.rhs < 0.0 {
            self.rows.push(row);
        }
    }

    fn coordinate(&self, place: Place, axis: usize) -> Coordinate {
        match place {
            Place::Robot(robot) => self.coordinates[robot][axis],
            Place::At(at) => Coordinate::Given(at[axis]),
        }
    }

    /// Forgets the inequalities whose source `keep` does not keep.
    pub fn retain(&mut self, keep: impl Fn(Source) -> bool) {
        self.rows.retain(|row| keep(row.source));
    }

    /// How many robots.
    #[must_use]
    pub fn robots(&self) -> usize {
        self.coordinates.len()
    }

    /// All inequalities, without the arena.
    #[must_use]
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Where everybody is at any rate.
    #[must_use]
    pub fn arena(&self) -> Arena {
        self.arena
    }

    /// Whether each robot that fixes the frame was measured by somebody.
    ///
    /// # Errors
    /// If one was not: all others would be anywhere.
    pub fn check_connected(&self) -> Result<(), BadFrame> {
        let connected = self.gauge.iter().all(|it| self.seen[it.robot]);
        connected.then_some(()).ok_or(BadFrame::GaugeNotConnected)
    }

    /// All unknowns, in the arena, without any row.
    #[must_use]
    pub fn unknowns(&self) -> Program {
        let Arena { centre, half } = self.arena;
        let mut program = Program::new();
        for of_robot in &self.coordinates {
            for (axis, coordinate) in of_robot.iter().enumerate() {
                if let Coordinate::Free(_) = coordinate {
                    program.column(centre[axis] - half, centre[axis] + half);
                }
            }
        }
        program
    }

    /// The inequalities whose source `keep` keeps, as a program.
    #[must_use]
    pub fn program(&self, keep: impl Fn(Source) -> bool) -> Program {
        let mut program = self.unknowns();
        for row in self.rows.iter().filter(|row| keep(row.source)) {
            program.row(row.terms().iter().copied(), row.rhs);
        }
        program
    }

    /// What the inequalities leave.
    ///
    /// # Errors
    /// If that is nothing, or could not be found out.
    pub fn region(&self) -> Result<Region<'_>, NoVertex> {
        self.region_of(|_| true)
    }

    /// What the inequalities leave whose source `keep` keeps. The rows of a conflict are numbered among those that are kept.
    ///
    /// # Errors
    /// If that is nothing, or could not be found out.
    pub fn region_of(&self, keep: impl Fn(Source) -> bool) -> Result<Region<'_>, NoVertex> {
        let simplex = Simplex::start(self.program(keep))?;
        Ok(Region {
            polytope: self,
            simplex,
        })
    }

    /// Who takes part in a conflict of [`Self::region`], each once, in order.
    #[must_use]
    pub fn sources(&self, conflict: &Conflict) -> Vec<Source> {
        let rows = conflict.rows.iter();
        let mut sources: Vec<_> = rows.map(|(row, _)| self.rows[*row].source).collect();
        sources.sort_unstable();
        sources.dedup();
        sources
    }

    /// The unknowns of `direction · projection`, and what is known of it.
    #[must_use]
    pub fn objective(&self, projection: Projection, direction: [f64; 2]) -> Objective {
        let mut objective = Objective {
            terms: [(0, 0.0); 4],
            count: 0,
            known: 0.0,
        };
        let robots = match projection {
            Projection::Robot(i) => [Some((i, 1.0)), None],
            Projection::Difference(i, j) => [Some((i, 1.0)), Some((j, -1.0))],
        };
        for (robot, sign) in robots.into_iter().flatten() {
            for (axis, along) in direction.iter().enumerate() {
                let factor = sign * along;
                match self.coordinates[robot][axis] {
                    Coordinate::Free(column) => {
                        objective.terms[objective.count] = (column, factor);
                        objective.count += 1;
                    }
                    Coordinate::Given(value) => objective.known += factor * value,
                }
            }
        }
        objective
    }

    /// Where a robot is if the unknowns are `z`.
    #[must_use]
    pub fn position(&self, robot: usize, z: &[f64]) -> [f64; 2] {
        self.coordinates[robot].map(|coordinate| match coordinate {
            Coordinate::Free(column) => z[column],
            Coordinate::Given(value) => value,
        })
    }

    /// The unknowns if the robots are at `positions`.
    #[must_use]
    pub fn unknowns_at(&self, positions: &[[f64; 2]]) -> Vec<f64> {
        let mut z = vec![0.0; self.columns];
        for (of_robot, position) in self.coordinates.iter().zip(positions) {
            for (coordinate, value) in of_robot.iter().zip(position) {
                if let Coordinate::Free(column) = coordinate {
                    z[*column] = *value;
                }
            }
        }
        z
    }
}

/// A robot of which one coordinate is given and the other is not is the scale.
fn check_scale(coordinates: &[[Coordinate; 2]]) -> Result<(), BadFrame> {
    for of_robot in coordinates {
        if let [Coordinate::Given(value), Coordinate::Free(_)]
        | [Coordinate::Free(_), Coordinate::Given(value)] = of_robot
            && value.abs() < NO_SCALE_M
        {
            return Err(BadFrame::NoScale);
        }
    }
    Ok(())
}

/// What is maximized.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Objective {
    terms: [(usize, f64); 4],
    count: usize,
    /// What does not depend on any unknown.
    pub known: f64,
}

impl Objective {
    /// By the number of the unknown.
    #[must_use]
    pub fn terms(&self) -> &[(usize, f64)] {
        &self.terms[..self.count]
    }
}

/// What one search found in one direction.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Support {
    /// A point of the shadow that is as far as it goes.
    pub point: [f64; 2],
    /// How far that is.
    pub value: f64,
    /// No less than how far it goes.
    pub safe: f64,
    /// Only the arena stops it.
    pub unbounded: bool,
}

/// A polytope that is not empty.
#[derive(Clone, Debug)]
pub struct Region<'a> {
    polytope: &'a Polytope,
    simplex: Simplex,
}

impl Region<'_> {
    /// How far the shadow goes in `direction`, a unit vector; `None` if the program failed.
    pub fn support(&mut self, projection: Projection, direction: [f64; 2]) -> Option<Support> {
        let objective = self.polytope.objective(projection, direction);
        let optimum = self
            .simplex
            .maximize(objective.terms().iter().copied())
            .ok()?;
        let z = self.simplex.vertex();
        let point = match projection {
            Projection::Robot(i) => self.polytope.position(i, z),
            Projection::Difference(i, j) => {
                let (a, b) = (self.polytope.position(i, z), self.polytope.position(j, z));
                [a[0] - b[0], a[1] - b[1]]
            }
        };
        let known = objective.known;
        Some(Support {
            point,
            value: known + optimum.value,
            safe: (known + optimum.safe_upper).next_up(),
            unbounded: optimum.at_bound,
        })
    }

    /// The shadow in `count` directions that are equally spaced, from x on; where only the arena stops it, infinity.
    pub fn template(&mut self, projection: Projection, count: usize) -> Option<Vec<f64>> {
        let directions = (0..count).map(|k| unit(crate::measurement::spaced(k, count)));
        directions
            .map(|direction| {
                let found = self.support(projection, direction)?;
                Some(if found.unbounded {
                    f64::INFINITY
                } else {
                    found.safe
                })
            })
            .collect()
    }
}
