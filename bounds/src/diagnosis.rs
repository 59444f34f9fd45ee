//! What does not fit, and how far an estimate is outside.

use crate::polytope::{Polytope, Projection, Source};
use crate::program::Program;
use crate::simplex::{Conflict, FEASIBLE, Failed, NoVertex, Simplex};

/// The least that measurements have to be relaxed, each on its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Elastic {
    /// The sum \[m\].
    pub total: f64,
    /// By how much each is relaxed \[m\], in the order of sources. The sum is unique, this need not be.
    pub slacks: Vec<(Source, f64)>,
}

impl Elastic {
    /// Who is relaxed most, if anybody is. A hint: who alone explains a conflict is said by [`removable`].
    #[must_use]
    pub fn suspect(&self) -> Option<Source> {
        let relaxed = self.slacks.iter().filter(|it| it.1 > FEASIBLE);
        relaxed.max_by(|a, b| a.1.total_cmp(&b.1)).map(|it| it.0)
    }
}

/// All sources of a polytope, each once, in order.
#[must_use]
pub fn sources(polytope: &Polytope) -> Vec<Source> {
    let mut sources: Vec<_> = polytope.rows().iter().map(|it| it.source).collect();
    sources.sort_unstable();
    sources.dedup();
    sources
}

/// The smallest sum of relaxations, one a source, with which everything fits.
///
/// # Errors
/// If the program fails.
pub fn elastic(polytope: &Polytope) -> Result<Elastic, Failed> {
    let sources = sources(polytope);
    let mut program = polytope.unknowns();
    let most = 8.0 * largest(&program) + largest_rhs(polytope);
    let first = program.columns();
    for _ in &sources {
        program.column(0.0, most);
    }
    for row in polytope.rows() {
        let slack = sources.binary_search(&row.source).map_err(|_| Failed)?;
        let terms = row.terms().iter().copied();
        program.row(terms.chain([(first + slack, -1.0)]), row.rhs);
    }
    let mut simplex = Simplex::start(program).map_err(|_| Failed)?;
    let best = simplex.maximize((0..sources.len()).map(|it| (first + it, -1.0)))?;
    let slacks = simplex.vertex()[first..].iter().map(|it| it.max(0.0));
    Ok(Elastic {
        total: (-best.value).max(0.0),
        slacks: sources.iter().copied().zip(slacks).collect(),
    })
}

fn largest(program: &Program) -> f64 {
    let columns = 0..program.columns();
    columns.map(|it| program.largest(it)).fold(1.0, f64::max)
}

fn largest_rhs(polytope: &Polytope) -> f64 {
    let rows = polytope.rows().iter();
    rows.map(|it| it.rhs.abs()).fold(0.0, f64::max)
}

/// Every source without which alone all the rest fits. One is a finding; several are "one of these"; none is "more than one".
///
/// Only those who take part in the conflict are tried: the others cannot dissolve it.
///
/// # Errors
/// If a program fails.
pub fn removable(polytope: &Polytope, conflict: &Conflict) -> Result<Vec<Source>, Failed> {
    let mut found = Vec::new();
    for source in polytope.sources(conflict) {
        if fits_without(polytope, |it| it == source)? {
            found.push(source);
        }
    }
    Ok(found)
}

/// Whether all fits that is not `left_out`.
///
/// # Errors
/// If the program fails.
pub fn fits_without(
    polytope: &Polytope,
    left_out: impl Fn(Source) -> bool,
) -> Result<bool, Failed> {
    match polytope.region_of(|source| !left_out(source)) {
        Ok(_) => Ok(true),
        Err(NoVertex::Infeasible(_)) => Ok(false),
        Err(NoVertex::Failed) => Err(Failed),
    }
}

/// How far an estimate is from where the robot can be, in the larger of x and y \[m\].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Distance {
    /// Zero inside.
    pub metres: f64,
    /// It is no less than this, whatever was rounded. Over zero it is proven that the estimate is outside.
    pub at_least: f64,
}

/// How far `estimate` is from where the robot can be.
///
/// # Errors
/// If the polytope is empty or the program fails.
pub fn membership(
    polytope: &Polytope,
    robot: usize,
    estimate: [f64; 2],
) -> Result<Distance, NoVertex> {
    let mut program = polytope.program(|_| true);
    let arena = polytope.arena();
    let off = (0..2).map(|axis| (estimate[axis] - arena.centre[axis]).abs());
    let most = 2.0 * (off.fold(0.0, f64::max) + arena.half + largest(&program));
    let distance = program.column(0.0, most);
    for (normal, rhs) in [
        ([1.0, 0.0], estimate[0]),
        ([-1.0, 0.0], -estimate[0]),
        ([0.0, 1.0], estimate[1]),
        ([0.0, -1.0], -estimate[1]),
    ] {
        let objective = polytope.objective(Projection::Robot(robot), normal);
        let terms = objective.terms().iter().copied();
        program.row(terms.chain([(distance, -1.0)]), rhs - objective.known);
    }
    let mut simplex = Simplex::start(program)?;
    let best = simplex
        .maximize([(distance, -1.0)])
        .map_err(|Failed| NoVertex::Failed)?;
    Ok(Distance {
        metres: (-best.value).max(0.0),
        at_least: (-best.safe_upper).max(0.0),
    })
}

/// The row that `positions` of all robots break most, by how much, and where it comes from; `None` if there is no row.
///
/// Over zero they cannot all be right; each may be, on its own.
#[must_use]
pub fn joint_residual(polytope: &Polytope, positions: &[[f64; 2]]) -> Option<(f64, Source)> {
    let z = polytope.unknowns_at(positions);
    let rows = polytope.rows().iter();
    rows.map(|row| {
        let left: f64 = row
            .terms()
            .iter()
            .map(|&(column, factor)| factor * z[column])
            .sum();
        (left - row.rhs, row.source)
    })
    .reduce(|a, b| if b.0 > a.0 { b } else { a })
}
