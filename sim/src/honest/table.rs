//! Tables for people.

/// Of this many columns.
#[derive(Clone, Debug)]
pub(crate) struct Table<const N: usize>(Vec<[String; N]>);

impl<const N: usize> Table<N> {
    pub(crate) fn new(head: [&str; N]) -> Self {
        let rule = std::array::from_fn(|_| "---".into());
        Self(vec![head.map(String::from), rule])
    }

    pub(crate) fn row(&mut self, row: [String; N]) {
        self.0.push(row);
    }

    /// In Markdown.
    pub(crate) fn text(&self) -> String {
        let line = |row: &[String; N]| format!("| {} |\n", row.join(" | "));
        self.0.iter().map(line).collect()
    }
}

/// Three digits, more before the point if need be.
pub(crate) fn digits(value: f64) -> String {
    if value.abs() < 9.995 {
        format!("{value:.2}")
    } else if value.abs() < 99.95 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

/// A share in per cent.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_markdown() {
        let mut table = Table::new(["a", "b"]);
        table.row([digits(1.234), percent(0.0567)]);
        table.row([digits(12.34), digits(123.4)]);
        let expected = "| a | b |\n| --- | --- |\n| 1.23 | 5.7 % |\n| 12.3 | 123 |\n";
        assert_eq!(table.text(), expected);
    }
}
