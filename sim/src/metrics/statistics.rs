//! Quantiles that a comparison needs.

/// 97.5 % quantile of the normal distribution.
const Z_975: f64 = 1.959_963_984_540_054;

/// The interval in which the mean NEES of `runs` runs lies with 95 % probability if the filter is consistent:
/// `χ²_{3M}` quantiles over M, by Wilson and Hilferty's approximation (to 0.2 % at one run).
#[must_use]
pub fn nees_band(runs: u32) -> [f64; 2] {
    let degrees = 3.0 * f64::from(runs.max(1));
    let spread = 2.0 / (9.0 * degrees);
    [-Z_975, Z_975].map(|z| {
        let root = 1.0 - spread + z * spread.sqrt();
        3.0 * root * root * root
    })
}

/// 97.5 % quantile of Student's t distribution: an expansion in 1/ν; tabulated where that is too coarse.
#[must_use]
pub fn t_975(degrees: u32) -> f64 {
    const EXACT: [f64; 9] = [
        12.706_205, 4.302_653, 3.182_446, 2.776_445, 2.570_582, 2.446_912, 2.364_624, 2.306_004,
        2.262_157,
    ];
    let exact = degrees
        .checked_sub(1)
        .and_then(|index| EXACT.get(index as usize));
    exact
        .copied()
        .unwrap_or_else(|| expanded(f64::from(degrees.max(1))))
}

fn expanded(v: f64) -> f64 {
    let z = Z_975;
    let [z3, z5, z7] = [z.powi(3), z.powi(5), z.powi(7)];
    z + (z3 + z) / (4.0 * v)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * v * v)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * v.powi(3))
}

/// Mean and standard deviation (over n) of `values`; of no value they are no numbers.
#[must_use]
#[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
pub fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values
        .iter()
        .map(|value| (value - mean) * (value - mean))
        .sum::<f64>()
        / n;
    [mean, variance.sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_agree_with_published_tables() {
        for (degrees, table) in [
            (1, 12.706),
            (4, 2.776),
            (5, 2.571),
            (9, 2.262),
            (19, 2.093),
            (100, 1.984),
        ] {
            assert!(
                (t_975(degrees) - table).abs() < 2e-3,
                "t({degrees}) = {}",
                t_975(degrees)
            );
        }
        let [low, high] = nees_band(20);
        assert!(
            (low - 2.024).abs() < 2e-3 && (high - 4.165).abs() < 2e-3,
            "{low} .. {high}"
        );
    }

    #[test]
    fn mean_and_deviation_of_a_pair_and_of_nothing() {
        let [mean, deviation] = mean_and_deviation(&[1.0, 3.0]);
        assert!((mean - 2.0).abs() < 1e-12 && (deviation - 1.0).abs() < 1e-12);
        assert!(mean_and_deviation(&[]).iter().all(|figure| figure.is_nan()));
    }
}
