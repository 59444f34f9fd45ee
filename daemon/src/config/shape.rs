//! The description of `robot.toml`: a JSON Schema, derived from the comments, types, ranges and defaults of the sections.

use std::fmt;
use std::sync::LazyLock;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value;

use super::Config;

static WHOLE: LazyLock<Value> = LazyLock::new(describe::<Config>);

fn describe<T: JsonSchema>() -> Value {
    let settings =
        SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let schema = settings.into_generator().into_root_schema_for::<T>();
    let mut whole = schema.to_value();
    hand_examples_down(&mut whole);
    join_lines(&mut whole);
    whole
}

/// A word's meaning is one line, however many its comment has.
fn join_lines(shape: &mut Value) {
    match shape {
        Value::Object(settings) => {
            if let (Some(_), Some(Value::String(text))) = (
                settings.get("const").cloned(),
                settings.get_mut("description"),
            ) {
                *text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            }
            settings.values_mut().for_each(join_lines);
        }
        Value::Array(items) => items.iter_mut().for_each(join_lines),
        _ => {}
    }
}

/// A section's example is also the example of each setting in it.
fn hand_examples_down(shape: &mut Value) {
    let example = shape.pointer("/examples/0").cloned().unwrap_or_default();
    if let Some(settings) = shape.get_mut("properties").and_then(Value::as_object_mut) {
        for (key, setting) in settings {
            give(setting, example.get(key));
        }
    }
    if let Some(items) = shape.get_mut("items") {
        give(items, example.get(0));
    }
}

fn give(shape: &mut Value, example: Option<&Value>) {
    if let (Some(example), true) = (example, shape["examples"].is_null()) {
        shape["examples"] = [example.clone()].into();
    }
    hand_examples_down(shape);
}

/// What one value of the file may be, and what it means.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Shape(&'static Value);

/// Kinds of values, as a person tells them apart.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Table,
    List,
    /// One of a few words.
    Word,
    Number,
    Whole,
    Truth,
    Text,
}

impl Shape {
    /// The whole file.
    pub(super) fn whole() -> Self {
        Self(&WHOLE)
    }

    /// Another program's section. A program has one or two, and reads them once: they are kept for good.
    pub(super) fn of<T: JsonSchema>() -> Self {
        Self(Box::leak(Box::new(describe::<T>())))
    }

    pub(super) fn kind(self) -> Kind {
        if self.0.get("oneOf").is_some() {
            return Kind::Word;
        }
        // What may be left out is `[KIND, "null"]`.
        let kind = &self.0["type"];
        match kind.as_str().or_else(|| kind[0].as_str()) {
            Some("object") => Kind::Table,
            Some("array") => Kind::List,
            Some("number") => Kind::Number,
            Some("integer") => Kind::Whole,
            Some("boolean") => Kind::Truth,
            _ => Kind::Text,
        }
    }

    /// A section of its own, rather than one line of a section.
    pub(super) fn is_section(self) -> bool {
        match self.kind() {
            Kind::Table => self
                .settings()
                .any(|(_, child)| child.kind() == Kind::Table || child.is_section()),
            Kind::List => self
                .items()
                .is_some_and(|items| items.kind() == Kind::Table),
            _ => false,
        }
    }

    /// The settings of a table, in the order of the source.
    pub(super) fn settings(self) -> impl Iterator<Item = (&'static str, Self)> {
        let properties = self.0["properties"].as_object();
        properties
            .into_iter()
            .flatten()
            .map(|(key, child)| (key.as_str(), Self(child)))
    }

    pub(super) fn setting(self, key: &str) -> Option<Self> {
        self.0["properties"].get(key).map(Self)
    }

    pub(super) fn items(self) -> Option<Self> {
        self.0.get("items").map(Self)
    }

    pub(super) fn required(self) -> impl Iterator<Item = &'static str> {
        let keys = self.0["required"].as_array();
        keys.into_iter().flatten().filter_map(Value::as_str)
    }

    /// The words that can be chosen, and what each means.
    pub(super) fn words(self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let words = self.0["oneOf"].as_array();
        words
            .into_iter()
            .flatten()
            .filter_map(|word| Some((word["const"].as_str()?, word["description"].as_str()?)))
    }

    pub(super) fn default(self) -> Option<&'static Value> {
        self.0.get("default").filter(|value| !value.is_null())
    }

    pub(super) fn example(self) -> Option<&'static Value> {
        self.0["examples"].get(0)
    }

    /// What it means; the unit at its end is left to [`Self::unit`].
    pub(super) fn text(self) -> String {
        let text = self.0["description"].as_str().unwrap_or_default();
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        match text.rsplit_once(" \\[") {
            Some((before, _)) => format!("{before}."),
            None => text,
        }
    }

    /// The unit in brackets at the end of the description.
    pub(super) fn unit(self) -> Option<&'static str> {
        let (_, end) = self.0["description"].as_str()?.rsplit_once("\\[")?;
        end.strip_suffix("\\].")
    }

    /// The word that may be there instead.
    pub(super) fn word_instead(self) -> Option<&'static str> {
        self.0["x-word"].as_str()
    }

    fn limit(self, which: &str) -> Option<f64> {
        self.0[which].as_f64()
    }

    /// Whether a number is within the limits; NaN never is.
    pub(super) fn holds(self, value: f64) -> bool {
        !value.is_nan()
            && self.limit("minimum").is_none_or(|least| value >= least)
            && self
                .limit("exclusiveMinimum")
                .is_none_or(|limit| value > limit)
            && self.limit("maximum").is_none_or(|most| value <= most)
    }

    /// Whether a text or a list may be that long.
    pub(super) fn holds_length(self, length: usize) -> bool {
        let (least, most) = self.lengths();
        let length = length as u64;
        least.is_none_or(|least| length >= least) && most.is_none_or(|most| length <= most)
    }

    fn lengths(self) -> (Option<u64>, Option<u64>) {
        let (least, most) = match self.kind() {
            Kind::List => ("minItems", "maxItems"),
            _ => ("minLength", "maxLength"),
        };
        (self.0[least].as_u64(), self.0[most].as_u64())
    }

    pub(super) fn has_lengths(self) -> bool {
        self.lengths() != (None, None)
    }

    /// Whether both are tables of the same settings.
    pub(super) fn same_settings(self, other: Self) -> bool {
        let keys = |shape: Self| shape.settings().map(|(key, _)| key).collect::<Vec<_>>();
        self.kind() == Kind::Table && keys(self) == keys(other)
    }
}

/// Of settings in a row that are the same inside, the first, which is described.
pub(super) fn first_of_its_kind<'k>(
    before: Option<(&'k str, Shape)>,
    next: (&'k str, Shape),
) -> Option<(&'k str, Shape)> {
    before
        .filter(|(_, before)| next.1.same_settings(*before))
        .or(Some(next))
}

/// What is allowed, in words: `a number, 1 to 1000 Hz`.
impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind() {
            Kind::Table => write!(f, "a table, {{ … }}"),
            Kind::List => self.write_list(f),
            Kind::Word => write!(
                f,
                "{}",
                choice(self.words().map(|(word, _)| format!("\"{word}\"")))
            ),
            Kind::Number => write!(f, "a number{}{}", self.range(), self.in_unit()),
            Kind::Whole => write!(f, "a whole number{}{}", self.range(), self.in_unit()),
            Kind::Truth => write!(f, "true or false"),
            Kind::Text => match self.lengths() {
                (Some(least), Some(most)) => {
                    write!(f, "a text in quotes, {least} to {most} characters")
                }
                (None, Some(most)) => write!(f, "a text in quotes, at most {most} characters"),
                _ => write!(f, "a text in quotes"),
            },
        }
    }
}

impl Shape {
    fn write_list(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.lengths() {
            (Some(least), Some(most)) if least == most => write!(f, "a list of {least}")?,
            (Some(least), _) => write!(f, "a list of {least} or more")?,
            _ => write!(f, "a list")?,
        }
        if let Some(items) = self.items() {
            write!(f, ", each {items}")?;
        }
        if let Some(unit) = self.unit() {
            write!(f, " [{unit}]")?;
        }
        self.word_instead()
            .map_or(Ok(()), |word| write!(f, ", or \"{word}\""))
    }

    fn in_unit(self) -> String {
        self.unit()
            .map(|unit| format!(" {unit}"))
            .unwrap_or_default()
    }

    fn range(self) -> String {
        let limit = |which| self.limit(which).map(plain);
        let most = limit("maximum");
        match (limit("minimum"), limit("exclusiveMinimum"), most) {
            (Some(least), _, Some(most)) => format!(", {least} to {most}"),
            (Some(least), _, None) => format!(", {least} or more"),
            (None, Some(above), Some(most)) => format!(" above {above}, at most {most}"),
            (None, Some(above), None) => format!(" above {above}"),
            (None, None, Some(most)) => format!(", at most {most}"),
            (None, None, None) => String::new(),
        }
    }
}

/// Long rows of zeros are hard to read: `1e9`.
fn plain(limit: f64) -> String {
    let is_long = limit.abs() >= 1e6 && limit % 1e6 == 0.0;
    if is_long {
        format!("{limit:e}")
    } else {
        limit.to_string()
    }
}

/// `a`, `a or b`, `a, b or c`.
pub(super) fn choice(words: impl Iterator<Item = String>) -> String {
    let words: Vec<_> = words.collect();
    match words.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        words => words.concat(),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use serde_json::{Map, Value};

    use super::*;

    /// Every setting at once, each with its default or an example.
    fn everything(shape: Shape) -> Value {
        let filled = |(key, setting): (&str, Shape)| (key.to_owned(), everything(setting));
        match (shape.kind(), shape.items()) {
            (Kind::Table, _) => Value::Object(shape.settings().map(filled).collect::<Map<_, _>>()),
            (Kind::List, Some(items)) if items.kind() == Kind::Table => [everything(items)].into(),
            _ => shape.default().or(shape.example()).unwrap().clone(),
        }
    }

    #[test]
    fn what_is_described_is_what_a_configuration_has() {
        let described = everything(Shape::whole());
        let config: Config = serde_json::from_value(described.clone()).unwrap();
        assert_eq!(serde_json::to_value(config).unwrap(), described);
    }

    /// Every setting, with its dotted key.
    pub(crate) fn for_each(path: &str, shape: Shape, look: &mut impl FnMut(&str, Shape)) {
        look(path, shape);
        for (key, setting) in shape.settings() {
            let inner = format!("{path}.{key}");
            for_each(inner.trim_start_matches('.'), setting, look);
        }
        if let Some(items) = shape.items() {
            for_each(&format!("{path}.0"), items, look);
        }
    }

    #[test]
    fn every_setting_has_a_sentence_and_numbers_have_limits() {
        let mut settings = 0;
        for_each("", Shape::whole(), &mut |path, shape| {
            settings += 1;
            let is_item = path.ends_with(".0");
            assert!(
                is_item || shape.text().ends_with(['.', ')']),
                "{path}: {}",
                shape.text()
            );
            let limited = shape.limit("minimum").or(shape.limit("exclusiveMinimum"));
            let (least, most) = (limited.is_some(), shape.limit("maximum").is_some());
            let is_enough = match shape.kind() {
                Kind::Whole => least && most,
                Kind::Number => least,
                Kind::Word => shape.words().all(|(_, meaning)| meaning.ends_with('.')),
                _ => true,
            };
            assert!(is_enough, "{path}: {shape}");
        });
        assert!(settings > 60, "{settings}");
    }
}
