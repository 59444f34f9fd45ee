//! Small dense matrices of any size, for filters whose measurements have any dimension.

/// Row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    entries: Vec<f64>,
}

impl Matrix {
    /// Of zeros.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            entries: vec![0.0; rows * columns],
        }
    }

    /// `entry(row, column)` everywhere.
    #[must_use]
    pub fn from_fn(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut matrix = Self::zeros(rows, columns);
        for row in 0..rows {
            for column in 0..columns {
                matrix.entries[row * columns + column] = entry(row, column);
            }
        }
        matrix
    }

    /// I
    #[must_use]
    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, size, |row, column| f64::from(u8::from(row == column)))
    }

    /// A column.
    #[must_use]
    pub fn column(entries: &[f64]) -> Self {
        Self::from_fn(entries.len(), 1, |row, _| entries[row])
    }

    /// Rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// An entry.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.entries[row * self.columns + column]
    }

    /// Sets an entry.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.entries[row * self.columns + column] = value;
    }

    /// All entries, row by row.
    #[must_use]
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// Numbers in it.
    #[must_use]
    pub fn numbers(&self) -> usize {
        self.entries.len()
    }

    /// Whether every entry is zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.entries.iter().all(|entry| *entry == 0.0)
    }

    /// `self · other`
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        let mut product = Self::zeros(self.rows, other.columns);
        for row in 0..self.rows {
            for (k, factor) in self.row(row).iter().enumerate() {
                let target = &mut product.entries[row * other.columns..][..other.columns];
                for (entry, right) in target.iter_mut().zip(other.row(k)) {
                    *entry += factor * right;
                }
            }
        }
        product
    }

    /// `self · otherᵀ`
    #[must_use]
    pub fn times_transposed(&self, other: &Self) -> Self {
        Self::from_fn(self.rows, other.rows, |row, column| {
            let pairs = self.row(row).iter().zip(other.row(column));
            pairs.map(|(a, b)| a * b).sum()
        })
    }

    /// The transpose.
    #[must_use]
    pub fn transposed(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |row, column| self.at(column, row))
    }

    /// `self + factor · other`
    #[must_use]
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let mut sum = self.clone();
        for (entry, right) in sum.entries.iter_mut().zip(&other.entries) {
            *entry += factor * right;
        }
        sum
    }

    /// Half of it and of its transpose.
    #[must_use]
    pub fn symmetric(&self) -> Self {
        Self::from_fn(self.rows, self.columns, |row, column| {
            0.5 * (self.at(row, column) + self.at(column, row))
        })
    }

    /// Writes `block` with its first entry at a place.
    pub fn put(&mut self, row: usize, column: usize, block: &Self) {
        for i in 0..block.rows {
            for j in 0..block.columns {
                self.set(row + i, column + j, block.at(i, j));
            }
        }
    }

    /// L of `self = L Lᵀ`; `None` where the pivots tell that the smallest eigenvalue may be 10⁻¹² of the largest or less.
    #[must_use]
    pub fn cholesky(&self) -> Option<Self> {
        let mut root = Self::zeros(self.rows, self.rows);
        let largest = (0..self.rows).map(|i| self.at(i, i)).fold(0.0, f64::max);
        for i in 0..self.rows {
            for j in 0..=i {
                let known: f64 = (0..j).map(|k| root.at(i, k) * root.at(j, k)).sum();
                let rest = self.at(i, j) - known;
                if i > j {
                    root.set(i, j, rest / root.at(j, j));
                } else if rest.is_finite() && rest > 1e-12 * largest {
                    root.set(i, i, rest.sqrt());
                } else {
                    return None;
                }
            }
        }
        Some(root)
    }

    /// `L⁻¹ right`, `self` being lower triangular.
    #[must_use]
    pub fn solve_lower(&self, right: &Self) -> Self {
        let mut solution = right.clone();
        for column in 0..right.columns {
            for row in 0..self.rows {
                let known: f64 = (0..row)
                    .map(|k| self.at(row, k) * solution.at(k, column))
                    .sum();
                let value = (solution.at(row, column) - known) / self.at(row, row);
                solution.set(row, column, value);
            }
        }
        solution
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.columns..][..self.columns]
    }

    /// The singular values, the largest first: one-sided Jacobi, which finds small ones as precisely as large ones (Hestenes 1958).
    #[must_use]
    pub fn singular_values(&self) -> Vec<f64> {
        let mut columns: Vec<Vec<f64>> = (0..self.columns)
            .map(|column| (0..self.rows).map(|row| self.at(row, column)).collect())
            .collect();
        for _ in 0..MOST_SWEEPS {
            if !sweep(&mut columns) {
                break;
            }
        }
        let mut values: Vec<f64> = columns.iter().map(|it| dot(it, it).sqrt()).collect();
        values.sort_by(|a, b| b.total_cmp(a));
        values
    }
}

const MOST_SWEEPS: usize = 60;

/// Turns every pair of columns until they are orthogonal; whether any was not.
fn sweep(columns: &mut [Vec<f64>]) -> bool {
    let mut has_turned = false;
    for q in 1..columns.len() {
        for p in 0..q {
            let [a, b] = [&columns[p], &columns[q]].map(|it| dot(it, it));
            let across = dot(&columns[p], &columns[q]);
            if across == 0.0 || across.abs() <= 1e-15 * (a * b).sqrt() {
                continue;
            }
            has_turned = true;
            let zeta = (b - a) / (2.0 * across);
            let t = zeta.signum() / (zeta.abs() + libm::hypot(1.0, zeta));
            let c = 1.0 / libm::hypot(1.0, t);
            let s = c * t;
            let (left, right) = columns.split_at_mut(q);
            for (x, y) in left[p].iter_mut().zip(&mut right[0]) {
                (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
            }
        }
    }
    has_turned
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
