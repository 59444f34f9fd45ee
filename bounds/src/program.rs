//! Linear programs over a box: `maximize c·z` where `A z ≤ b`.

/// The inequalities, and between what bounds each unknown is.
#[derive(Clone, Debug, Default)]
pub struct Program {
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Where the terms of each row start, and where the last one's end.
    starts: Vec<usize>,
    terms: Vec<(usize, f64)>,
    rhs: Vec<f64>,
}

impl Program {
    /// Without unknowns and rows.
    #[must_use]
    pub fn new() -> Self {
        Self {
            starts: vec![0],
            ..Self::default()
        }
    }

    /// One more unknown; its number.
    pub fn column(&mut self, lower: f64, upper: f64) -> usize {
        self.lower.push(lower);
        self.upper.push(upper);
        self.lower.len() - 1
    }

    /// One more inequality; its number. Terms name unknowns that there are, each once.
    pub fn row(&mut self, terms: impl IntoIterator<Item = (usize, f64)>, rhs: f64) -> usize {
        self.terms.extend(terms);
        self.starts.push(self.terms.len());
        self.rhs.push(rhs);
        self.rhs.len() - 1
    }

    /// How many unknowns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.lower.len()
    }

    /// How many inequalities, without those of the box.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rhs.len()
    }

    /// What is on the left of row `row`.
    #[must_use]
    pub fn terms(&self, row: usize) -> &[(usize, f64)] {
        &self.terms[self.starts[row]..self.starts[row + 1]]
    }

    /// What is on its right.
    #[must_use]
    pub fn rhs(&self, row: usize) -> f64 {
        self.rhs[row]
    }

    /// Between what an unknown is.
    #[must_use]
    pub fn bounds(&self, column: usize) -> (f64, f64) {
        (self.lower[column], self.upper[column])
    }

    /// How large an unknown can be, by its box.
    pub(crate) fn largest(&self, column: usize) -> f64 {
        self.lower[column].abs().max(self.upper[column].abs())
    }
}
