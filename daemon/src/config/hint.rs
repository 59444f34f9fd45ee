//! What a person who wrote a key that is none, or left one out, meant in all likelihood.

use super::example;
use super::shape::{Shape, choice};

/// From here on two words are taken for the same, one misspelt (Jaro-Winkler similarity).
const ALIKE: f64 = 0.8;

/// `key` is nothing that `section` knows: where it belongs, how it is spelt, or what there is.
pub(super) fn unknown(section: &str, shape: Shape, key: &str) -> String {
    let homes = homes(key);
    if !homes.is_empty() {
        return format!(
            "{key} belongs in {}",
            choice(homes.iter().map(|home| heading(home)))
        );
    }
    let place = heading(section);
    if let Some(known) = nearest(shape, key) {
        return format!("{place} has no {key}; did you mean {known}?");
    }
    let known: Vec<_> = shape.settings().map(|(known, _)| known).collect();
    format!("{place} has no {key}; it has {}", known.join(", "))
}

/// `key` must be written in `section`, and is not.
pub(super) fn missing(section: &str, shape: Shape, key: &str) -> String {
    let example = shape
        .setting(key)
        .map(|setting| example::of(section, key, setting))
        .unwrap_or_default();
    format!(
        "{} lacks {key}; write, for example:\n{example}",
        heading(section)
    )
}

fn nearest(shape: Shape, key: &str) -> Option<&'static str> {
    shape
        .settings()
        .map(|(known, _)| (strsim::jaro_winkler(known, key), known))
        .filter(|(alike, _)| *alike >= ALIKE)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, known)| known)
}

/// The sections that know `key`.
fn homes(key: &str) -> Vec<String> {
    let mut found = Vec::new();
    look_for(key, "", Shape::whole(), &mut found);
    found
}

fn look_for(key: &str, path: &str, shape: Shape, found: &mut Vec<String>) {
    if shape.setting(key).is_some() {
        found.push(path.into());
    }
    for (name, child) in shape.settings() {
        let inner = if path.is_empty() {
            name.into()
        } else {
            format!("{path}.{name}")
        };
        match child.items() {
            Some(items) => look_for(key, &format!("{inner}.0"), items, found),
            None => look_for(key, &inner, child, found),
        }
    }
}

/// `[tick]`, `[[team]]`: how a person calls a section.
fn heading(section: &str) -> String {
    let steps = || section.split('.');
    let is_number = |step: &&str| step.parse::<usize>().is_ok();
    let name = steps()
        .filter(|step| !is_number(step))
        .collect::<Vec<_>>()
        .join(".");
    match steps().next_back() {
        Some("") => "the file".into(),
        Some(last) if is_number(&last) => format!("[[{name}]]"),
        _ => format!("[{name}]"),
    }
}
