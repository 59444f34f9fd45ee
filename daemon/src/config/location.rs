//! Where in the file something is written.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::finding::Finding;

/// The byte at which a person should look.
pub(super) fn of_finding(finding: &Finding, document: &DeTable<'_>) -> Option<usize> {
    if let Some(word) = &finding.word {
        let found = of_word(word, document.get(finding.key.as_str())?);
        return found.or_else(|| nearest(&finding.key, document));
    }
    written(&finding.key, document)
        .or_else(|| finding.or.iter().find_map(|key| written(key, document)))
        .or_else(|| nearest(&finding.key, document))
}

/// Where exactly this key stands.
fn written(key: &str, document: &DeTable<'_>) -> Option<usize> {
    let (outer, last) = key.rsplit_once('.').unwrap_or(("", key));
    let table = outer.split('.').filter(|step| !step.is_empty()).try_fold(
        None,
        |value: Option<&DeValue<'_>>, step| {
            Some(Some(match value {
                None => document.get(step)?.get_ref(),
                Some(value) => child(value, step)?.get_ref(),
            }))
        },
    )?;
    match table {
        None => Some(document.get_key_value(last)?.0.span().start),
        Some(DeValue::Table(table)) => Some(table.get_key_value(last)?.0.span().start),
        Some(list) => Some(child(list, last)?.span().start),
    }
}

/// Where the key stands, or the closest table around it.
fn nearest(key: &str, document: &DeTable<'_>) -> Option<usize> {
    let outer = key.rsplit_once('.').map(|(outer, _)| outer);
    written(key, document).or_else(|| nearest(outer?, document))
}

fn child<'t, 'i>(value: &'t DeValue<'i>, step: &str) -> Option<&'t Spanned<DeValue<'i>>> {
    match step.parse::<usize>() {
        Ok(index) => value.get(index),
        Err(_) => value.get(step),
    }
}

/// Where this text stands as a value.
fn of_word(word: &str, value: &Spanned<DeValue<'_>>) -> Option<usize> {
    match value.get_ref() {
        DeValue::String(text) if text == word => Some(value.span().start),
        DeValue::Table(table) => table.values().find_map(|value| of_word(word, value)),
        DeValue::Array(list) => list.iter().find_map(|value| of_word(word, value)),
        _ => None,
    }
}

/// The dotted key whose value is written at `byte`.
pub(super) fn key_at(byte: usize, document: &DeTable<'_>) -> Option<String> {
    document
        .iter()
        .find_map(|(key, value)| key_within(byte, key.get_ref().to_string(), value))
}

fn key_within(byte: usize, path: String, value: &Spanned<DeValue<'_>>) -> Option<String> {
    let inner = match value.get_ref() {
        DeValue::Table(table) => table
            .iter()
            .find_map(|(key, value)| key_within(byte, format!("{path}.{}", key.get_ref()), value)),
        DeValue::Array(list) => list
            .iter()
            .enumerate()
            .find_map(|(index, value)| key_within(byte, format!("{path}.{index}"), value)),
        _ => None,
    };
    inner.or_else(|| value.span().contains(&byte).then_some(path))
}
