//! A primal simplex in inequality form.
//!
//! The state is a vertex: as many rows as there are unknowns, which hold with equality there, and the inverse of their matrix. A step
//! leaves one of them along an edge and takes up the row that it meets. Only the objective changes between the programs of one epoch, so
//! each starts where the last one ended.
//!
//! To find a first vertex there is one unknown more, `τ`, by which all inequalities are relaxed; it is made as small as it goes. If that
//! is not zero, nothing satisfies them all.

mod safe;

use crate::program::Program;

/// A relaxation of no more than this is rounding \[m\].
pub const FEASIBLE: f64 = 1e-7;

/// A multiplier over this is zero.
const PRICE: f64 = -1e-10;

/// Rounding of multipliers, of the largest of them.
const OF_LARGEST: f64 = 1e-14;

/// An edge or multipliers so long come from rows that are nearly parallel, and are worth a step of refinement.
const LONG: f64 = 1e4;

/// A row that is broken by more than this at the end is mended.
const BROKEN: f64 = 1e-12;

/// A step that goes no further than this goes nowhere.
const NOWHERE: f64 = 1e-12;

/// So many steps that go nowhere are taken for a circle.
const CIRCLE: usize = 40;

/// How careful a try is, from the first to the last.
#[derive(Copy, Clone, Debug)]
struct Care {
    /// The inverse is made anew after so many steps.
    refactor_after: usize,
    /// A row that an edge meets at less than this, of the edge's longest entry, is parallel to it.
    parallel: f64,
}

const CARE: [Care; 4] = [
    Care {
        refactor_after: 100,
        parallel: 1e-9,
    },
    Care {
        refactor_after: 1,
        parallel: 1e-9,
    },
    Care {
        refactor_after: 1,
        parallel: 1e-7,
    },
    Care {
        refactor_after: 1,
        parallel: 1e-5,
    },
];

/// Of the longest entry of an edge: a row that it meets at less than this spoils the inverse.
const SMALL_PIVOT: f64 = 1e-5;

/// Rows that are met so little later are met at once, and the one that is met most squarely is taken \[m\].
const AT_ONCE: f64 = 1e-11;

/// What a solution may miss its own equations by.
const ACCURATE: f64 = 1e-9;

/// Neither solved nor known to be infeasible: too many steps, or a matrix that has no inverse.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Failed;

/// Why there is no first vertex.
#[derive(Clone, Debug, PartialEq)]
pub enum NoVertex {
    /// Nothing satisfies all rows, and that is proven whatever was rounded.
    Infeasible(Conflict),
    /// It could not be found out.
    Failed,
}

/// Rows that exclude one another.
#[derive(Clone, Debug, PartialEq)]
pub struct Conflict {
    /// By how much all rows have to be relaxed at least \[m\].
    pub relaxation: f64,
    /// Rows with their multipliers (Farkas): no others are needed to show it.
    pub rows: Vec<(usize, f64)>,
}

/// A maximum.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Optimum {
    /// At the vertex, rounded as it happens to be.
    pub value: f64,
    /// No less than the true maximum.
    pub safe_upper: f64,
    /// The box is what stops it.
    pub at_bound: bool,
}

/// A vertex of a program.
#[derive(Clone, Debug)]
pub struct Simplex {
    program: Program,
    /// Unknowns, with τ.
    size: usize,
    /// All rows: those of the program, the lower and the upper bounds, then `−τ ≤ 0`.
    starts: Vec<usize>,
    terms: Vec<(usize, f64)>,
    rhs: Vec<f64>,
    /// The same, unknown by unknown: the rows that have it.
    of_unknown: Vec<usize>,
    in_rows: Vec<(usize, f64)>,
    /// The rows of the vertex.
    working: Vec<usize>,
    is_working: Vec<bool>,
    /// Row by row.
    inverse: Vec<f64>,
    z: Vec<f64>,
    objective: Vec<f64>,
    multipliers: Vec<f64>,
    step: Vec<f64>,
    /// Of each row, how fast an edge goes towards it.
    towards: Vec<f64>,
    /// Of each row, as far as they are known.
    slacks: Vec<f64>,
    has_slacks: bool,
    entering: Vec<f64>,
    /// Rows that an edge goes towards, how far it is there and how squarely they are met.
    ahead: Vec<(usize, f64, f64)>,
    residual: Vec<f64>,
    columns: Vec<safe::Column>,
    matrix: Vec<f64>,
    /// Where `−τ ≤ 0` stays for ever once there is a vertex.
    held: Option<usize>,
    steps_since_refactor: usize,
    care: Care,
}

impl Simplex {
    /// A vertex of `program`.
    ///
    /// # Errors
    /// If it has none, or if that could not be found out.
    pub fn start(program: Program) -> Result<Self, NoVertex> {
        let mut simplex = Self::new(program);
        simplex.restart()?;
        Ok(simplex)
    }

    /// Maximizes the sum of `terms`. Names unknowns that there are.
    ///
    /// # Errors
    /// If it fails, also from a first vertex.
    pub fn maximize(
        &mut self,
        terms: impl IntoIterator<Item = (usize, f64)>,
    ) -> Result<Optimum, Failed> {
        self.objective.fill(0.0);
        for (column, factor) in terms {
            self.objective[column] += factor;
        }
        if self.settle(None).is_err() {
            self.maximize_anew()?;
        }
        Ok(self.optimum())
    }

    /// From a first vertex, with more and more care.
    fn maximize_anew(&mut self) -> Result<(), Failed> {
        let objective = self.objective.clone();
        let mut tried = Err(Failed);
        for care in CARE {
            self.care = care;
            tried = self.find_vertex().map_err(|_| Failed);
            self.objective.copy_from_slice(&objective);
            tried = tried.and_then(|()| self.settle(None));
            if tried.is_ok() {
                break;
            }
        }
        self.care = CARE[0];
        tried
    }

    /// Where the last maximum was found.
    #[must_use]
    pub fn vertex(&self) -> &[f64] {
        &self.z[..self.size - 1]
    }

    /// What it solves.
    #[must_use]
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// The rows of the vertex: of the program first, then lower bounds, then upper ones.
    #[must_use]
    pub fn working_rows(&self) -> Vec<usize> {
        let tau = self.tau_row();
        self.working
            .iter()
            .copied()
            .filter(|&it| it != tau)
            .collect()
    }

    fn new(program: Program) -> Self {
        let (columns, rows) = (program.columns(), program.rows());
        let (size, all) = (columns + 1, rows + 2 * columns + 1);
        let mut starts = vec![0];
        let mut terms = Vec::new();
        let mut rhs = Vec::with_capacity(all);
        for row in 0..rows {
            terms.extend_from_slice(program.terms(row));
            terms.push((columns, -1.0));
            starts.push(terms.len());
            rhs.push(program.rhs(row));
        }
        for column in 0..columns {
            terms.push((column, -1.0));
            starts.push(terms.len());
            rhs.push(-program.bounds(column).0);
        }
        for column in 0..columns {
            terms.push((column, 1.0));
            starts.push(terms.len());
            rhs.push(program.bounds(column).1);
        }
        terms.push((columns, -1.0));
        starts.push(terms.len());
        rhs.push(0.0);
        let (of_unknown, in_rows) = by_unknown(size, &starts, &terms);
        Self {
            program,
            size,
            starts,
            terms,
            rhs,
            of_unknown,
            in_rows,
            working: Vec::with_capacity(size),
            is_working: vec![false; all],
            inverse: vec![0.0; size * size],
            z: vec![0.0; size],
            objective: vec![0.0; size],
            multipliers: vec![0.0; size],
            step: vec![0.0; size],
            towards: vec![0.0; all],
            slacks: vec![0.0; all],
            has_slacks: false,
            entering: vec![0.0; size],
            ahead: Vec::with_capacity(all),
            residual: vec![0.0; size],
            columns: vec![safe::Column::default(); columns],
            matrix: vec![0.0; size * size],
            held: None,
            steps_since_refactor: 0,
            care: CARE[0],
        }
    }

    fn tau_row(&self) -> usize {
        self.rhs.len() - 1
    }

    fn terms(&self, row: usize) -> &[(usize, f64)] {
        &self.terms[self.starts[row]..self.starts[row + 1]]
    }

    fn dot(&self, row: usize, vector: &[f64]) -> f64 {
        let terms = self.terms(row).iter();
        terms.map(|&(column, factor)| factor * vector[column]).sum()
    }

    fn slack(&self, row: usize) -> f64 {
        self.rhs[row] - self.dot(row, &self.z)
    }

    /// The first phase, with more and more care.
    fn restart(&mut self) -> Result<(), NoVertex> {
        let mut tried = Err(NoVertex::Failed);
        for care in CARE {
            self.care = care;
            tried = self.find_vertex();
            if tried != Err(NoVertex::Failed) {
                break;
            }
        }
        self.care = CARE[0];
        tried
    }

    /// From the lower corner of the box to a vertex at which τ is zero.
    fn find_vertex(&mut self) -> Result<(), NoVertex> {
        self.begin_at_corner();
        self.objective.fill(0.0);
        self.objective[self.size - 1] = -1.0;
        let tau = self.tau_row();
        if !self.is_working[tau] {
            self.settle(Some(tau)).map_err(|Failed| NoVertex::Failed)?;
        }
        if !self.is_working[tau] {
            let relaxation = self.z[self.size - 1];
            if relaxation > FEASIBLE {
                return Err(self.no_vertex(relaxation));
            }
            self.take_up_tau();
        }
        self.held = self.working.iter().position(|&row| row == tau);
        self.refactor().map_err(|Failed| NoVertex::Failed)
    }

    fn begin_at_corner(&mut self) {
        let (columns, rows) = (self.size - 1, self.program.rows());
        (self.held, self.has_slacks) = (None, false);
        self.steps_since_refactor = 0;
        for column in 0..columns {
            self.z[column] = self.program.bounds(column).0;
        }
        self.z[columns] = 0.0;
        let slacks = (0..rows).map(|row| (row, self.slack(row)));
        let worst = slacks.min_by(|a, b| a.1.total_cmp(&b.1));
        let worst = worst.filter(|it| it.1 < 0.0);
        self.z[columns] = worst.map_or(0.0, |it| -it.1);
        let last = worst.map_or(self.tau_row(), |it| it.0);
        self.is_working.fill(false);
        self.working.clear();
        self.working.extend(rows..rows + columns);
        self.working.push(last);
        self.inverse.fill(0.0);
        for column in 0..columns {
            self.inverse[column * self.size + column] = -1.0;
        }
        for term in self.starts[last]..self.starts[last + 1] {
            let (column, factor) = self.terms[term];
            // The factor of τ itself is −1, and so is its entry.
            let sign = if column == columns { 1.0 } else { -1.0 };
            self.inverse[columns * self.size + column] = sign * factor;
        }
        for &row in &self.working {
            self.is_working[row] = true;
        }
    }

    /// A conflict only where it is proven: an alarm is no matter of rounding.
    fn no_vertex(&mut self, relaxation: f64) -> NoVertex {
        if safe::proves_empty(self) {
            NoVertex::Infeasible(self.conflict(relaxation))
        } else {
            NoVertex::Failed
        }
    }

    fn conflict(&self, relaxation: f64) -> Conflict {
        let rows = self.working.iter().zip(&self.multipliers);
        let rows =
            rows.filter(|(row, multiplier)| **row < self.program.rows() && **multiplier > -PRICE);
        Conflict {
            relaxation,
            rows: rows.map(|(row, multiplier)| (*row, *multiplier)).collect(),
        }
    }

    /// τ is zero but for rounding, yet `−τ ≤ 0` is no row of the vertex: it takes the place of the row that leaves it best.
    fn take_up_tau(&mut self) {
        let last = (self.size - 1) * self.size;
        let of_tau = &self.inverse[last..];
        let best = (0..self.size).max_by(|&a, &b| of_tau[a].abs().total_cmp(&of_tau[b].abs()));
        let Some(leaving) = best else { return };
        self.find_step(leaving);
        let length = self.z[self.size - 1] / -self.step[self.size - 1];
        self.pivot(leaving, self.tau_row(), length);
        self.has_slacks = false;
    }

    /// Climbs until the top is one within rounding, or row `until` is met.
    fn settle(&mut self, until: Option<usize>) -> Result<(), Failed> {
        for _ in 0..4 {
            self.climb(until)?;
            if until.is_some_and(|row| self.is_working[row]) {
                return Ok(());
            }
            let worst = self.mend();
            if worst >= -FEASIBLE && self.is_settled() {
                return Ok(());
            }
            self.refactor()?;
        }
        Err(Failed)
    }

    /// Whether vertex and multipliers satisfy their equations, and no multiplier is below zero.
    fn is_settled(&mut self) -> bool {
        self.find_residual();
        let tolerance = ACCURATE.max(OF_LARGEST * longest(&self.multipliers));
        let residual = self.residual.iter().all(|it| it.abs() <= tolerance);
        let kept = |row: usize| {
            let slack = self.slack(row);
            slack >= -FEASIBLE && slack.abs() <= ACCURATE * (1.0 + self.rhs[row].abs())
        };
        let signs =
            (0..self.size).all(|q| Some(q) == self.held || self.multipliers[q] >= -tolerance);
        residual && signs && self.working.iter().all(|&row| kept(row))
    }

    /// Steps until no edge leads upwards, or until row `until` is met.
    fn climb(&mut self, until: Option<usize>) -> Result<(), Failed> {
        let most = 200 + 20 * (self.size + self.rhs.len());
        let mut nowhere = 0;
        for _ in 0..most {
            if self.steps_since_refactor >= self.care.refactor_after {
                self.refactor()?;
            }
            self.find_multipliers();
            let bland = nowhere >= CIRCLE;
            let Some(leaving) = self.leaving(bland) else {
                return Ok(());
            };
            self.find_step(leaving);
            let Some((row, length)) = self.met(bland) else {
                return Err(Failed);
            };
            nowhere = if length <= NOWHERE { nowhere + 1 } else { 0 };
            self.advance(length);
            self.pivot(leaving, row, length);
            if until == Some(row) {
                return Ok(());
            }
        }
        Err(Failed)
    }

    /// `y = A_W⁻ᵀ c`
    fn find_multipliers(&mut self) {
        self.multipliers.fill(0.0);
        for (i, &factor) in self.objective.iter().enumerate() {
            if factor != 0.0 {
                let row = &self.inverse[i * self.size..(i + 1) * self.size];
                for (multiplier, entry) in self.multipliers.iter_mut().zip(row) {
                    *multiplier += factor * entry;
                }
            }
        }
        if longest(&self.multipliers) > LONG {
            self.refine_multipliers();
        }
    }

    /// The place in the vertex whose row is best left.
    fn leaving(&self, bland: bool) -> Option<usize> {
        let zero = PRICE.min(-OF_LARGEST * longest(&self.multipliers));
        let candidates =
            (0..self.size).filter(|&q| Some(q) != self.held && self.multipliers[q] < zero);
        if bland {
            candidates.min_by_key(|&q| self.working[q])
        } else {
            candidates.min_by(|&a, &b| self.multipliers[a].total_cmp(&self.multipliers[b]))
        }
    }

    /// The edge that leaves row `q` of the vertex and stays on all others.
    fn find_step(&mut self, q: usize) {
        for (i, entry) in self.step.iter_mut().enumerate() {
            *entry = -self.inverse[i * self.size + q];
        }
        if longest(&self.step) > LONG {
            self.refine_step(q);
        }
    }

    /// One step of iterative refinement: `δ += A_W⁻¹ (−e_q − A_W δ)`.
    fn refine_step(&mut self, q: usize) {
        for place in 0..self.size {
            let aim = if place == q { -1.0 } else { 0.0 };
            self.residual[place] = aim - self.dot(self.working[place], &self.step);
        }
        for i in 0..self.size {
            let line = &self.inverse[i * self.size..(i + 1) * self.size];
            let more: f64 = line.iter().zip(&self.residual).map(|(a, b)| a * b).sum();
            self.step[i] += more;
        }
    }

    /// The row that the edge meets first, and how far that is.
    fn met(&mut self, bland: bool) -> Option<(usize, f64)> {
        let parallel = self.care.parallel * longest(&self.step).max(1.0);
        let tolerance = if bland { 0.0 } else { AT_ONCE };
        self.find_towards();
        if !self.has_slacks {
            self.find_slacks();
        }
        let mut ahead = core::mem::take(&mut self.ahead);
        ahead.clear();
        let mut first = f64::INFINITY;
        for (row, &towards) in self.towards.iter().enumerate() {
            if towards > parallel && !self.is_working[row] {
                let slack = self.slacks[row].max(0.0);
                first = first.min((slack + tolerance) / towards);
                ahead.push((row, slack / towards, towards));
            }
        }
        let mut best: Option<(usize, f64, f64)> = None;
        for &(row, length, towards) in ahead.iter().filter(|it| it.1 <= first) {
            if best.is_none_or(|(_, _, steepest)| !bland && towards > steepest) {
                best = Some((row, length, towards));
            }
        }
        self.ahead = ahead;
        best.map(|(row, length, _)| (row, length))
    }

    /// Of all rows at once: an edge moves few unknowns.
    fn find_towards(&mut self) {
        self.towards.fill(0.0);
        for (unknown, &step) in self.step.iter().enumerate() {
            if step != 0.0 {
                let rows = self.of_unknown[unknown]..self.of_unknown[unknown + 1];
                for &(row, factor) in &self.in_rows[rows] {
                    self.towards[row] += factor * step;
                }
            }
        }
    }

    fn find_slacks(&mut self) {
        self.slacks.copy_from_slice(&self.rhs);
        for (unknown, &z) in self.z.iter().enumerate() {
            if z != 0.0 {
                let rows = self.of_unknown[unknown]..self.of_unknown[unknown + 1];
                for &(row, factor) in &self.in_rows[rows] {
                    self.slacks[row] -= factor * z;
                }
            }
        }
        self.has_slacks = true;
    }

    /// Goes along the edge that was looked along for the row that it meets first.
    fn advance(&mut self, length: f64) {
        for (slack, towards) in self.slacks.iter_mut().zip(&self.towards) {
            *slack -= length * towards;
        }
    }

    /// Goes along the edge, and takes up `row` in the place of row `q` of the vertex.
    fn pivot(&mut self, q: usize, row: usize, length: f64) {
        let size = self.size;
        for (z, step) in self.z.iter_mut().zip(&self.step) {
            *z += length * step;
        }
        self.express(row);
        let divisor = self.entering[q];
        self.entering[q] -= 1.0;
        for i in 0..size {
            let factor = -self.step[i] / divisor;
            if factor != 0.0 {
                let line = &mut self.inverse[i * size..(i + 1) * size];
                for (entry, other) in line.iter_mut().zip(&self.entering) {
                    *entry -= factor * other;
                }
            }
        }
        self.is_working[self.working[q]] = false;
        self.is_working[row] = true;
        self.working[q] = row;
        let is_small = divisor.abs() < SMALL_PIVOT * longest(&self.step).max(1.0);
        self.steps_since_refactor += if is_small { CARE[0].refactor_after } else { 1 };
    }

    /// `w = a A_W⁻¹`: the row as a sum of the vertex's rows.
    fn express(&mut self, row: usize) {
        self.entering.fill(0.0);
        for term in self.starts[row]..self.starts[row + 1] {
            let (column, factor) = self.terms[term];
            let line = &self.inverse[column * self.size..(column + 1) * self.size];
            for (entry, other) in self.entering.iter_mut().zip(line) {
                *entry += factor * other;
            }
        }
    }

    /// The inverse and the vertex anew from the rows (Gauss-Jordan).
    fn refactor(&mut self) -> Result<(), Failed> {
        let size = self.size;
        self.matrix.fill(0.0);
        self.inverse.fill(0.0);
        for i in 0..size {
            let row = self.working[i];
            for term in self.starts[row]..self.starts[row + 1] {
                let (column, factor) = self.terms[term];
                self.matrix[i * size + column] = factor;
            }
            self.inverse[i * size + i] = 1.0;
        }
        for column in 0..size {
            let best = (column..size)
                .max_by(|&a, &b| self.entry(a, column).total_cmp(&self.entry(b, column)));
            let Some(best) = best.filter(|&it| self.entry(it, column) > 1e-13) else {
                return Err(Failed);
            };
            self.swap_lines(best, column);
            self.eliminate(column);
        }
        self.steps_since_refactor = 0;
        self.z.fill(0.0);
        self.refine_vertex();
        Ok(())
    }

    fn entry(&self, line: usize, column: usize) -> f64 {
        self.matrix[line * self.size + column].abs()
    }

    fn swap_lines(&mut self, a: usize, b: usize) {
        for k in 0..self.size {
            self.matrix.swap(a * self.size + k, b * self.size + k);
            self.inverse.swap(a * self.size + k, b * self.size + k);
        }
    }

    fn eliminate(&mut self, column: usize) {
        let size = self.size;
        let scale = 1.0 / self.matrix[column * size + column];
        for k in 0..size {
            self.matrix[column * size + k] *= scale;
            self.inverse[column * size + k] *= scale;
        }
        for line in (0..size).filter(|&line| line != column) {
            let factor = self.matrix[line * size + column];
            if factor != 0.0 {
                for k in 0..size {
                    self.matrix[line * size + k] -= factor * self.matrix[column * size + k];
                    self.inverse[line * size + k] -= factor * self.inverse[column * size + k];
                }
            }
        }
    }

    /// One step of iterative refinement: `z += A_W⁻¹ (b_W − A_W z)`.
    fn refine_vertex(&mut self) {
        self.has_slacks = false;
        for q in 0..self.size {
            self.residual[q] = self.slack(self.working[q]);
        }
        for i in 0..self.size {
            let line = &self.inverse[i * self.size..(i + 1) * self.size];
            self.z[i] += line
                .iter()
                .zip(&self.residual)
                .map(|(a, b)| a * b)
                .sum::<f64>();
        }
    }

    /// `c − A_Wᵀ y`
    fn find_residual(&mut self) {
        self.residual.copy_from_slice(&self.objective);
        for q in 0..self.size {
            let row = self.working[q];
            for term in self.starts[row]..self.starts[row + 1] {
                let (column, factor) = self.terms[term];
                self.residual[column] -= factor * self.multipliers[q];
            }
        }
    }

    /// One step of iterative refinement: `y += A_W⁻ᵀ (c − A_Wᵀ y)`.
    fn refine_multipliers(&mut self) {
        self.find_residual();
        for i in 0..self.size {
            let line = &self.inverse[i * self.size..(i + 1) * self.size];
            for (multiplier, entry) in self.multipliers.iter_mut().zip(line) {
                *multiplier += entry * self.residual[i];
            }
        }
    }

    /// Undoes what rounding did on the way: rows that are broken a little are taken up again, by dual steps. What is left of the worst row's
    /// slack, of those that are not the vertex's.
    fn mend(&mut self) -> f64 {
        self.refine_vertex();
        let mut left = self.worst();
        for _ in 0..2 * self.size {
            let (row, slack) = left;
            if slack >= -BROKEN * (1.0 + self.rhs[row].abs()) {
                break;
            }
            self.find_multipliers();
            self.express(row);
            let Some(leaving) = self.given_up_for_row() else {
                break;
            };
            self.find_step(leaving);
            let length = -slack / self.entering[leaving];
            self.pivot(leaving, row, length);
            self.refine_vertex();
            left = self.worst();
        }
        self.find_multipliers();
        self.refine_multipliers();
        left.1
    }

    /// The row, of those that are not the vertex's, that is broken most, and its slack.
    fn worst(&mut self) -> (usize, f64) {
        self.find_slacks();
        let rows = (0..self.rhs.len()).filter(|&row| !self.is_working[row]);
        rows.map(|row| (row, self.slacks[row]))
            .fold(
                (0, f64::INFINITY),
                |worst, it| {
                    if it.1 < worst.1 { it } else { worst }
                },
            )
    }

    /// The place in the vertex that keeps all multipliers above zero if the expressed row takes it.
    fn given_up_for_row(&self) -> Option<usize> {
        let ratio = |q: usize| self.multipliers[q].max(0.0) / self.entering[q];
        (0..self.size)
            .filter(|&q| Some(q) != self.held && self.entering[q] > 1e-7)
            .min_by(|&a, &b| ratio(a).total_cmp(&ratio(b)))
    }

    fn optimum(&mut self) -> Optimum {
        let safe_upper = safe::upper(self);
        let rows = self.program.rows();
        let tau = self.tau_row();
        let mut working = self.working.iter().zip(&self.multipliers);
        Optimum {
            value: self.objective.iter().zip(&self.z).map(|(c, z)| c * z).sum(),
            safe_upper,
            at_bound: working.any(|(&row, &y)| row >= rows && row != tau && y > 1e-9),
        }
    }
}

/// The rows that have each unknown, and where those of one begin.
fn by_unknown(
    size: usize,
    starts: &[usize],
    terms: &[(usize, f64)],
) -> (Vec<usize>, Vec<(usize, f64)>) {
    let mut of_unknown = vec![0; size + 1];
    for (unknown, _) in terms {
        of_unknown[unknown + 1] += 1;
    }
    for unknown in 0..size {
        of_unknown[unknown + 1] += of_unknown[unknown];
    }
    let mut next = of_unknown.clone();
    let mut in_rows = vec![(0, 0.0); terms.len()];
    for (row, ends) in starts.windows(2).enumerate() {
        for &(unknown, factor) in &terms[ends[0]..ends[1]] {
            in_rows[next[unknown]] = (row, factor);
            next[unknown] += 1;
        }
    }
    (of_unknown, in_rows)
}

fn longest(vector: &[f64]) -> f64 {
    vector.iter().fold(0.0, |longest, it| longest.max(it.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Program {
        let mut program = Program::new();
        for _ in 0..2 {
            program.column(-10.0, 10.0);
        }
        for column in 0..2 {
            program.row([(column, 1.0)], 1.0);
            program.row([(column, -1.0)], 0.0);
        }
        program
    }

    #[test]
    fn a_square_has_its_corners() {
        let mut simplex = Simplex::start(square()).unwrap();
        let found = simplex.maximize([(0, 1.0), (1, 2.0)]).unwrap();
        assert_eq!(simplex.vertex(), [1.0, 1.0]);
        assert!(found.value == 3.0 && found.safe_upper >= 3.0 && !found.at_bound);
        let found = simplex.maximize([(0, -1.0), (1, -1.0)]).unwrap();
        assert_eq!(simplex.vertex(), [0.0, 0.0]);
        assert!(found.safe_upper >= 0.0 && found.safe_upper < 1e-11);
    }

    #[test]
    fn what_excludes_one_another_is_named() {
        let mut program = square();
        program.row([(0, -1.0), (1, -1.0)], -3.0);
        program.row([(0, 1.0), (1, -1.0)], 5.0);
        let Err(NoVertex::Infeasible(conflict)) = Simplex::start(program) else {
            panic!("it is infeasible");
        };
        assert!((conflict.relaxation - 1.0 / 3.0).abs() < 1e-12);
        let mut rows: Vec<_> = conflict.rows.iter().map(|it| it.0).collect();
        rows.sort_unstable();
        assert_eq!(rows, [0, 2, 4]);
    }

    #[test]
    fn what_only_the_box_stops_is_said() {
        let mut program = Program::new();
        program.column(-10.0, 10.0);
        program.row([(0, -1.0)], 0.0);
        let mut simplex = Simplex::start(program).unwrap();
        assert!(simplex.maximize([(0, 1.0)]).unwrap().at_bound);
        assert!(!simplex.maximize([(0, -1.0)]).unwrap().at_bound);
    }
}
