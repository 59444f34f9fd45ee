//! Figures as people read them: three or four digits, units in the heading.

/// Metres as centimetres.
pub(crate) fn cm(metres: f64) -> String {
    digits(100.0 * metres)
}

/// Radians.
pub(crate) fn rad(radians: f64) -> String {
    finite(radians, |radians| format!("{radians:.4}"))
}

/// A share as percent.
pub(crate) fn percent(share: f64) -> String {
    finite(share, |share| format!("{:.1}", 100.0 * share))
}

/// As percent without decimals.
pub(crate) fn whole_percent(share: f64) -> String {
    finite(share, |share| format!("{:.0}", 100.0 * share))
}

/// A figure made from nothing is a dash.
fn finite(value: f64, format: fn(f64) -> String) -> String {
    if value.is_finite() {
        format(value)
    } else {
        "–".into()
    }
}

/// As many decimals as matter.
pub(crate) fn digits(value: f64) -> String {
    match value.abs() {
        size if !size.is_finite() => "–".into(),
        size if size < 99.995 => format!("{value:.2}"),
        size if size < 9999.5 => format!("{value:.0}"),
        _ => format!("{value:.1e}"),
    }
}

/// With its sign, which is what matters in a difference.
pub(crate) fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(digits) => format!("−{digits}"),
        None if text == "–" => text.into(),
        None => format!("+{text}"),
    }
}

/// `None` as a dash.
pub(crate) fn or_dash(value: Option<f64>, format: fn(f64) -> String) -> String {
    value.map_or_else(|| "–".into(), format)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_matter() {
        assert_eq!(
            [0.0316, 1.026, 40.0, f64::INFINITY].map(cm),
            ["3.16", "103", "4000", "–"]
        );
        assert_eq!(digits(173_584.0), "1.7e5");
        assert_eq!(percent(0.0512), "5.1");
        assert_eq!([signed("-1.20"), signed("0.30")], ["−1.20", "+0.30"]);
        assert_eq!(or_dash(None, digits), "–");
    }

    #[test]
    fn a_figure_made_from_nothing_is_a_dash() {
        for format in [cm, rad, percent, whole_percent, digits] {
            assert_eq!(format(f64::NAN), "–");
        }
        assert_eq!(signed(&digits(f64::NAN)), "–");
    }
}
