//! Systems of linear equations of a positive definite matrix.

/// Lower triangle of Cholesky's factor, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cholesky {
    lower: Vec<f64>,
    size: usize,
}

impl Cholesky {
    /// Of a row-major matrix; nothing if it is not positive definite.
    pub(crate) fn new(matrix: &[f64], size: usize) -> Option<Self> {
        let mut lower = matrix.to_vec();
        for row in 0..size {
            for column in 0..=row {
                let dot: f64 = (0..column)
                    .map(|it| lower[row * size + it] * lower[column * size + it])
                    .sum();
                let rest = matrix[row * size + column] - dot;
                lower[row * size + column] = if row == column {
                    if !(rest.is_finite() && rest > 1e-14 * matrix[row * size + row].abs()) {
                        return None;
                    }
                    rest.sqrt()
                } else {
                    rest / lower[column * size + column]
                };
            }
        }
        Some(Self { lower, size })
    }

    pub(crate) fn solve(&self, right: &[f64]) -> Vec<f64> {
        let at = |row: usize, column: usize| self.lower[row * self.size + column];
        let mut x = right.to_vec();
        for row in 0..self.size {
            let dot: f64 = (0..row).map(|it| at(row, it) * x[it]).sum();
            x[row] = (x[row] - dot) / at(row, row);
        }
        for row in (0..self.size).rev() {
            let dot: f64 = (row + 1..self.size).map(|it| at(it, row) * x[it]).sum();
            x[row] = (x[row] - dot) / at(row, row);
        }
        x
    }

    /// The inverse, row-major.
    pub(crate) fn inverse(&self) -> Vec<f64> {
        (0..self.size)
            .flat_map(|row| {
                let mut unit = vec![0.0; self.size];
                unit[row] = 1.0;
                self.solve(&unit)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MATRIX: [f64; 9] = [4.0, 2.0, -1.0, 2.0, 5.0, 0.5, -1.0, 0.5, 3.0];

    #[test]
    fn an_inverse_undoes_the_matrix() {
        let inverse = Cholesky::new(&MATRIX, 3).unwrap().inverse();
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            let product: f64 = (0..3)
                .map(|it| MATRIX[3 * row + it] * inverse[3 * it + column])
                .sum();
            let expected = if row == column { 1.0 } else { 0.0 };
            assert!((product - expected).abs() < 1e-14, "{row} {column}");
        }
    }

    #[test]
    fn what_is_not_positive_definite_has_no_factor() {
        assert_eq!(Cholesky::new(&[1.0, 1.0, 1.0, 1.0], 2), None);
        assert_eq!(Cholesky::new(&[1.0, 2.0, 2.0, 1.0], 2), None);
        assert_eq!(Cholesky::new(&[f64::NAN], 1), None);
    }
}
