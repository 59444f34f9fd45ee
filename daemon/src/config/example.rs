//! Values as one writes them in TOML.

use serde_json::Value;

use super::shape::{Kind, Shape};

/// An example of `key` in `section`, on lines of its own.
pub(super) fn of(section: &str, key: &str, shape: Shape) -> String {
    match (shape.kind(), shape.example()) {
        (_, None) => format!("    {key} = …"),
        (Kind::Table, Some(example)) if section.is_empty() => {
            let settings = shape.settings().filter_map(|(inner, _)| {
                Some(format!("\n    {inner} = {}", literal(example.get(inner)?)))
            });
            format!("    [{key}]{}", settings.collect::<String>())
        }
        (_, Some(example)) => format!("    {key} = {}", literal(&brief(example, shape))),
    }
}

/// `example` without what it has by default.
pub(super) fn brief(example: &Value, shape: Shape) -> Value {
    let Value::Object(settings) = example else {
        return example.clone();
    };
    let differs =
        |key: &str, value: &Value| shape.setting(key).and_then(Shape::default) != Some(value);
    let kept = settings.iter().filter(|(key, value)| differs(key, value));
    Value::Object(
        kept.map(|(key, value)| (key.clone(), value.clone()))
            .collect(),
    )
}

/// A value in TOML.
pub(super) fn literal(value: &Value) -> String {
    match value {
        Value::Array(items) => {
            let items: Vec<_> = items.iter().map(literal).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Object(settings) => {
            let settings: Vec<_> = settings
                .iter()
                .map(|(key, value)| format!("{key} = {}", literal(value)))
                .collect();
            format!("{{ {} }}", settings.join(", "))
        }
        Value::String(text) => toml::Value::from(text.as_str()).to_string(),
        plain => plain.to_string(),
    }
}
