//! A value that is never below the maximum, whatever was rounded.
//!
//! Any `y ≥ 0` bounds it: `c·z = (c − Aᵀy)·z + y·Az ≤ |c − Aᵀy|·Z + y·b`, with `Z` the box. So multipliers may be as wrong as they like;
//! only the rounding of this sum itself has to be allowed for.

use super::Simplex;

/// Rounding of `b·y`, of its terms' sum.
const OF_PRODUCT: f64 = 1e-12;

/// Rounding of a residual, at least, of its terms' sum.
const OF_RESIDUAL: f64 = 1e-15;

/// The bound by the vertex's own multipliers.
pub(super) fn upper(simplex: &Simplex) -> f64 {
    let columns = simplex.size - 1;
    let tau = simplex.tau_row();
    let (mut product, mut products) = (0.0, 0.0);
    let mut residual = simplex.objective.clone();
    let mut size: Vec<f64> = residual.iter().map(|it| it.abs()).collect();
    let mut count = vec![3.0; columns];
    for (&row, &multiplier) in simplex.working.iter().zip(&simplex.multipliers) {
        if row == tau || multiplier <= 0.0 {
            continue;
        }
        let term = simplex.rhs[row] * multiplier;
        product += term;
        products += term.abs();
        for &(column, factor) in simplex.terms(row).iter().filter(|it| it.0 < columns) {
            residual[column] -= factor * multiplier;
            size[column] += (factor * multiplier).abs();
            count[column] += 1.0;
        }
    }
    let mut rest = 0.0;
    for column in 0..columns {
        let rounding = OF_RESIDUAL.max(count[column] * f64::EPSILON) * size[column];
        rest += (residual[column].abs() + rounding) * simplex.program.largest(column);
    }
    (product + OF_PRODUCT * products + rest * (1.0 + OF_PRODUCT)).next_up()
}
