//! A value that is never below the maximum, whatever was rounded.
//!
//! Any `y ≥ 0` bounds it: `c·z = (c − Aᵀy)·z + y·Az ≤ |c − Aᵀy|·Z + y·b`, with `Z` the box. So multipliers may be as wrong as they like;
//! only the rounding of this sum itself has to be allowed for.

use super::Simplex;

/// Rounding of `b·y`, of its terms' sum.
const OF_PRODUCT: f64 = 1e-12;

/// Rounding of a residual, at least, of its terms' sum.
const OF_RESIDUAL: f64 = 1e-15;

/// Sums of one unknown.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Column {
    /// `c − Aᵀy`
    residual: f64,
    /// `|c| + |A|ᵀy`
    size: f64,
    terms: f64,
}

/// The bound by the vertex's own multipliers.
pub(super) fn upper(simplex: &mut Simplex) -> f64 {
    for (column, &factor) in simplex.columns.iter_mut().zip(&simplex.objective) {
        *column = Column {
            residual: factor,
            size: factor.abs(),
            terms: 3.0,
        };
    }
    bound(simplex)
}

/// Whether the multipliers prove that nothing satisfies all rows: then zero itself would be below zero.
pub(super) fn proves_empty(simplex: &mut Simplex) -> bool {
    simplex.columns.fill(Column {
        terms: 3.0,
        ..Column::default()
    });
    bound(simplex) < 0.0
}

/// With the objective that stands in the columns.
fn bound(simplex: &mut Simplex) -> f64 {
    let tau_row = simplex.tau_row();
    let tau = simplex.columns.len();
    let (mut product, mut products) = (0.0, 0.0);
    for (&row, &multiplier) in simplex.working.iter().zip(&simplex.multipliers) {
        if row == tau_row || multiplier <= 0.0 {
            continue;
        }
        let term = simplex.rhs[row] * multiplier;
        product += term;
        products += term.abs();
        let terms = simplex.starts[row]..simplex.starts[row + 1];
        for &(column, factor) in simplex.terms[terms].iter().filter(|it| it.0 < tau) {
            let sums = &mut simplex.columns[column];
            sums.residual -= factor * multiplier;
            sums.size += (factor * multiplier).abs();
            sums.terms += 1.0;
        }
    }
    let columns = simplex.columns.iter().enumerate();
    let rest: f64 = columns
        .map(|(column, sums)| {
            let rounding = OF_RESIDUAL.max(sums.terms * f64::EPSILON) * sums.size;
            (sums.residual.abs() + rounding) * simplex.program.largest(column)
        })
        .sum();
    (product + OF_PRODUCT * products + rest * (1.0 + OF_PRODUCT)).next_up()
}
