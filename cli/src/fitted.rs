//! Numbers in columns.

/// `value` with as many of `decimals` as fit into `width` characters, right-aligned; `–` if it is no number.
pub(crate) fn fitted(value: f64, width: usize, decimals: usize) -> String {
    if !value.is_finite() {
        return format!("{:>width$}", "–");
    }
    let fits = |text: &String| text.len() <= width;
    let text = (0..=decimals)
        .rev()
        .map(|decimals| format!("{value:.decimals$}"))
        .find(fits)
        .unwrap_or_else(|| format!("{value:.0e}"));
    format!("{text:>width$}")
}

#[cfg(test)]
mod tests {
    use super::fitted;

    #[test]
    fn decimals_give_way_to_the_width() {
        assert_eq!(fitted(1.23456, 7, 3), "  1.235");
        assert_eq!(fitted(-1234.567, 7, 3), "-1234.6");
        assert_eq!(fitted(1_234_567.0, 7, 3), "1234567");
        assert_eq!(fitted(-1.0e12, 7, 3), "  -1e12");
        assert_eq!(fitted(f64::NAN, 4, 1), "   –");
    }
}
