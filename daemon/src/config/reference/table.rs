//! `docs/configuration.md`: a table of each section.

use super::super::Section;
use super::super::example::{brief, literal};
use super::super::shape::{Kind, Shape, first_of_its_kind};

const HEAD: &str = "\
# Configuration

Every setting of `robot.toml`, made from the same description that `colocd` checks a file against. Only `[robot]` must be
written. [`daemon/robot.toml`](../daemon/robot.toml) has the same as a file to start from; `colocd check robot.toml` says what
it understood of yours. Texts stand in quotes. A number without an upper end may be `inf`.
";

const HEADER: &str = "\n| setting | default | allowed | meaning |\n| --- | --- | --- | --- |\n";

/// The whole reference, in Markdown.
#[must_use]
pub fn configuration_md() -> String {
    let sections = Shape::whole().settings();
    let sections = sections.map(|(name, shape)| section(name, shape));
    HEAD.to_owned() + &sections.collect::<String>()
}

/// The same of the section of another program.
#[must_use]
pub fn section_md<S: Section>() -> String {
    section(S::NAME, Shape::of::<S>())
}

fn section(path: &str, shape: Shape) -> String {
    let is_list = shape.kind() == Kind::List;
    let heading = if is_list {
        format!("[[{path}]]")
    } else {
        format!("[{path}]")
    };
    let table = shape.items().unwrap_or(shape);
    let (sections, settings): (Vec<_>, Vec<_>) = table
        .settings()
        .partition(|(_, setting)| setting.is_section());
    let header = if settings.is_empty() { "" } else { HEADER };
    let inner = |(key, setting): (&str, Shape)| section(&format!("{path}.{key}"), setting);
    format!(
        "\n## `{heading}`\n\n{}\n{header}{}{}",
        shape.text(),
        rows("", table, &settings),
        sections.into_iter().map(inner).collect::<String>()
    )
}

fn rows(path: &str, table: Shape, settings: &[(&str, Shape)]) -> String {
    let mut rows = String::new();
    let mut before: Option<(&str, Shape)> = None;
    for &(key, setting) in settings {
        let path = format!("{path}{key}");
        rows += &row(
            &path,
            setting,
            table.required().any(|required| required == key),
        );
        match before {
            Some((other, before)) if setting.same_settings(before) => {
                rows.extend(["| `", &path, ".…` | | | The settings of `", other, "`. |\n"]);
            }
            _ => {
                let inner: Vec<_> = setting.settings().collect();
                rows += &self::rows(&format!("{path}."), setting, &inner);
            }
        }
        before = first_of_its_kind(before, (key, setting));
    }
    rows
}

fn row(path: &str, shape: Shape, required: bool) -> String {
    let words = shape
        .words()
        .map(|(word, meaning)| format!(" `\"{word}\"`: {meaning}"));
    let meaning = shape.text() + &words.collect::<String>();
    let code = |value: &_| format!("`{}`", literal(value));
    let example = shape.example().map(|example| code(&brief(example, shape)));
    let default = match (shape.default(), example) {
        (Some(default), _) => code(default),
        (None, Some(example)) if required => format!("must be written, as in {example}"),
        (None, Some(example)) => format!("none; for example {example}"),
        (None, None) if required => "must be written".into(),
        (None, None) => "none".into(),
    };
    format!("| `{path}` | {default} | {shape} | {meaning} |\n")
}
