//! The file as it is written, held against its description: every key known and in its place, every value allowed.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::Fault;
use super::hint::{missing, unknown};
use super::others::OTHERS;
use super::shape::{Kind, Shape};

/// Everything that is wrong.
pub(super) fn review(text: &str, document: &DeTable<'_>) -> Vec<Fault> {
    let mut review = Review {
        text,
        faults: Vec::new(),
    };
    review.table("", Shape::whole(), document, None);
    review.faults.sort_by_key(|fault| fault.at);
    review.faults
}

/// Everything that is wrong in the section of another program.
pub(super) fn review_section(
    text: &str,
    document: &DeTable<'_>,
    name: &str,
    shape: Shape,
) -> Vec<Fault> {
    let mut review = Review {
        text,
        faults: Vec::new(),
    };
    match document.get_key_value(name) {
        Some((key, value)) => review.value(name, shape, value, key.span().start),
        None => review.report(None, format!("the file lacks [{name}]")),
    }
    review.faults.sort_by_key(|fault| fault.at);
    review.faults
}

struct Review<'t> {
    text: &'t str,
    faults: Vec<Fault>,
}

impl Review<'_> {
    fn report(&mut self, at: Option<usize>, message: String) {
        self.faults.push(Fault { at, message });
    }

    /// `at` is where the table begins.
    fn table(&mut self, path: &str, shape: Shape, table: &DeTable<'_>, at: Option<usize>) {
        let others = |key: &str| path.is_empty() && OTHERS.iter().any(|other| other.name == key);
        for (key, value) in table.iter().filter(|(key, _)| !others(key.get_ref())) {
            let inner = join(path, key.get_ref());
            match shape.setting(key.get_ref()) {
                Some(child) => self.value(&inner, child, value, key.span().start),
                None => {
                    self.report(Some(key.span().start), unknown(path, shape, key.get_ref()));
                }
            }
        }
        for key in shape.required().filter(|key| table.get(*key).is_none()) {
            self.report(at, missing(path, shape, key));
        }
    }

    fn value(&mut self, path: &str, shape: Shape, value: &Spanned<DeValue<'_>>, at: usize) {
        let allowed = match (shape.kind(), value.get_ref()) {
            (Kind::Table, DeValue::Table(table)) => {
                return self.table(path, shape, table, Some(at));
            }
            (Kind::List, DeValue::Array(list)) => {
                for (index, item) in list.iter().enumerate() {
                    if let Some(shape) = shape.items() {
                        self.value(&format!("{path}.{index}"), shape, item, item.span().start);
                    }
                }
                shape.holds_length(list.len())
            }
            (Kind::List, DeValue::String(word)) => shape.word_instead() == Some(word),
            (Kind::Word, DeValue::String(word)) => shape.words().any(|(known, _)| known == word),
            (Kind::Number, value) => number(value).is_some_and(|value| shape.holds(value)),
            (Kind::Whole, value @ DeValue::Integer(_)) => {
                number(value).is_some_and(|value| shape.holds(value))
            }
            (Kind::Text, DeValue::String(text)) => shape.holds_length(text.len()),
            (Kind::Truth, DeValue::Boolean(_)) => true,
            _ => false,
        };
        if !allowed {
            let written = shown(self.text, value);
            self.report(Some(at), format!("{path} = {written}: must be {shape}"));
        }
    }
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        return key.into();
    }
    format!("{path}.{key}")
}

#[allow(clippy::cast_precision_loss)] // No limit is beyond 2⁵³.
fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(whole) => i64::from_str_radix(whole.as_str(), whole.radix())
            .ok()
            .map(|whole| whole as f64),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}

/// A value as the person wrote it, its first line.
pub(super) fn shown<'t>(text: &'t str, value: &Spanned<DeValue<'_>>) -> &'t str {
    let written = text.get(value.span()).unwrap_or_default();
    written.lines().next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::shape::tests::for_each;
    use super::*;
    use crate::config::Config;

    /// What is said of `key = value` on the first line.
    fn said(key: &str, value: &str) -> String {
        let text = format!("{key} = {value}\n[robot]\nname = \"a\"\nid = 1\n");
        let error = Config::parse(&text, Path::new("robot.toml")).expect_err(&text);
        error.to_string()
    }

    fn must_refuse(key: &str, value: &str, shape: Shape) {
        let expected = format!("robot.toml:1: {key} = {value}: must be {shape}");
        let said = said(key, value);
        assert!(
            said.lines().any(|line| line == expected),
            "{expected}\n{said}"
        );
    }

    /// A key on the first line that is not written twice with `[robot]` below.
    fn can_be_written(path: &str) -> bool {
        !path.is_empty() && !path.starts_with("robot") && !path.split('.').any(|step| step == "0")
    }

    /// In no words but those of the description, and on the setting's own line.
    #[test]
    fn every_setting_refuses_what_it_is_not_and_says_what_it_is() {
        for_each("", Shape::whole(), &mut |path, shape| {
            if can_be_written(path) {
                must_refuse(path, "1979-05-27", shape);
                must_refuse(path, "nan", shape);
            }
        });
    }

    #[test]
    fn every_number_is_held_to_the_limits_that_are_described() {
        for_each("", Shape::whole(), &mut |path, shape| {
            let is_number = matches!(shape.kind(), Kind::Number | Kind::Whole);
            if is_number && can_be_written(path) {
                if !shape.holds(-1.0) {
                    must_refuse(path, "-1", shape);
                }
                must_refuse(path, "99999999999999999999999", shape);
                if !shape.holds(1e12) {
                    must_refuse(path, "1_000_000_000_000", shape);
                }
            }
        });
    }
}
