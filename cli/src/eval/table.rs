//! A table: aligned columns on a terminal, or Markdown.

use std::fmt::Write;

/// Rows under headings, with a title that says what they are.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    pub(crate) title: String,
    pub(crate) headings: Vec<String>,
    /// Each as long as `headings`.
    pub(crate) rows: Vec<Vec<String>>,
}

impl Table {
    pub(crate) fn new(title: impl Into<String>, headings: &[&str]) -> Self {
        Self {
            title: title.into(),
            headings: headings.iter().map(|&heading| heading.into()).collect(),
            rows: Vec::new(),
        }
    }

    /// For a terminal: the first two columns to the left, numbers to the right.
    pub(crate) fn text(&self) -> String {
        let widths = self.widths();
        let mut text = format!("{}\n", self.title);
        let mut before: &str = "";
        for row in std::iter::once(&self.headings).chain(&self.rows) {
            let group = row.first().map_or("", String::as_str);
            for (column, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                let repeated = column == 0 && group == before && self.headings.len() > 3;
                let cell = if repeated { "" } else { cell };
                let pad = " ".repeat(width - cell.chars().count());
                let (left, right) = if column < 2 {
                    (cell, pad.as_str())
                } else {
                    (pad.as_str(), cell)
                };
                let _ = write!(text, "  {left}{right}"); // Strings take everything.
            }
            text.truncate(text.trim_end().len());
            text.push('\n');
            before = group;
        }
        text
    }

    fn widths(&self) -> Vec<usize> {
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            let longest = cells.map(|cell| cell.chars().count()).max().unwrap_or(0);
            longest.max(self.headings[column].chars().count())
        };
        (0..self.headings.len()).map(width).collect()
    }

    /// For a document.
    pub(crate) fn markdown(&self) -> String {
        let mut text = format!("**{}**\n\n", self.title);
        let rule: Vec<String> = (0..self.headings.len())
            .map(|column| if column < 2 { "---" } else { "---:" }.into())
            .collect();
        for row in [&self.headings, &rule].into_iter().chain(&self.rows) {
            let _ = writeln!(text, "| {} |", row.join(" | "));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("Errors", &["robot", "method", "x [cm]", "y [cm]"]);
        let row = |cells: [&str; 4]| cells.map(String::from).to_vec();
        table.rows = vec![
            row(["R1", "sl", "102", "3.1"]),
            row(["R1", "coloc", "2.5", "2.59"]),
        ];
        table
    }

    #[test]
    fn columns_are_aligned_and_a_group_is_named_once() {
        assert_eq!(
            table().text(),
            "Errors\n  robot  method  x [cm]  y [cm]\n  R1     sl         102     3.1\n         coloc      2.5    2.59\n"
        );
    }

    #[test]
    fn markdown_is_complete() {
        let expected = "**Errors**\n\n| robot | method | x [cm] | y [cm] |\n| --- | --- | ---: | ---: |\n\
            | R1 | sl | 102 | 3.1 |\n| R1 | coloc | 2.5 | 2.59 |\n";
        assert_eq!(table().markdown(), expected);
    }
}
