//! `robot.toml` with every setting and what there is to say about it.

use serde_json::Value;

use super::super::example::{brief, literal};
use super::super::shape::{Kind, Shape, first_of_its_kind};

const WIDTH: usize = 118;

const HEAD: &str = "\
# A robot's configuration, made from its description in daemon/src/config. Leave out what you do not change: every value
# is the default, except in [robot] and [odometry], which are yours. A setting behind a # without a space has no default.
# `colocd check robot.toml` says what it understood; `colocd run robot.toml` starts.
";

/// A whole `robot.toml`: the defaults, and an example of what has none.
#[must_use]
pub fn robot_toml() -> String {
    let mut page = Page(HEAD.into());
    for (name, shape) in Shape::whole().settings() {
        page.section(name, shape, shape.default().or(shape.example()));
    }
    page.0
}

struct Page(String);

impl Page {
    /// `value` is what it is here; without one the section is commented out.
    fn section(&mut self, path: &str, shape: Shape, value: Option<&Value>) {
        let is_list = shape.kind() == Kind::List;
        let value = value.filter(|_| !is_list);
        self.0.push('\n');
        self.comment("", &shape.text());
        let heading = if is_list {
            format!("[[{path}]]")
        } else {
            format!("[{path}]")
        };
        self.line(value.is_some(), &heading);
        let table = shape.items().unwrap_or(shape);
        let mut before = None;
        for (key, setting) in table
            .settings()
            .filter(|(_, setting)| !setting.is_section())
        {
            self.setting(key, setting, value, before);
            before = first_of_its_kind(before, (key, setting));
        }
        for (key, setting) in table.settings().filter(|(_, setting)| setting.is_section()) {
            let inner = value.and_then(|value| value.get(key));
            self.section(&format!("{path}.{key}"), setting, inner);
        }
    }

    fn setting(
        &mut self,
        key: &str,
        shape: Shape,
        section: Option<&Value>,
        before: Option<(&str, Shape)>,
    ) {
        self.comment("", &[shape.text(), allowed(shape)].concat());
        for (word, meaning) in shape.words() {
            self.comment("  ", &format!("\"{word}\": {meaning}"));
        }
        match before {
            Some((other, before)) if shape.same_settings(before) => {
                self.comment("  ", &format!("With the settings of `{other}`."));
            }
            _ => self.inner_settings(shape),
        }
        let default = shape.default().cloned();
        let value = default.or_else(|| Some(brief(section?.get(key)?, shape)));
        let active = section.is_some() && value.is_some();
        let example = || shape.example().map(|example| brief(example, shape));
        let written = value.or_else(example).as_ref().map(literal);
        self.line(active, &format!("{key} = {}", written.unwrap_or_default()));
    }

    /// What can stand between the braces of a table on one line.
    fn inner_settings(&mut self, shape: Shape) {
        for (key, inner) in shape.settings() {
            let default = inner
                .default()
                .map(|value| format!(" Default: {}.", literal(value)));
            let allowed = match inner.kind() {
                Kind::Word => format!(" Allowed: {inner}."),
                _ => allowed(inner),
            };
            let text = format!(
                "{key}: {}{allowed}{}",
                inner.text(),
                default.unwrap_or_default()
            );
            self.comment("  ", &text);
        }
    }

    fn line(&mut self, active: bool, line: &str) {
        let mark = if active { "" } else { "#" };
        self.0.extend([mark, line, "\n"]);
    }

    fn comment(&mut self, indent: &str, text: &str) {
        let mut line = format!("#{indent}");
        for word in text.split(' ') {
            if line.chars().count() + 1 + word.chars().count() > WIDTH {
                self.0.push_str(&line);
                line = format!("\n#{indent}{indent}");
            }
            line.push(' ');
            line.push_str(word);
        }
        self.0.push_str(&line);
        self.0.push('\n');
    }
}

/// What is allowed, where the value itself does not show it.
fn allowed(shape: Shape) -> String {
    match shape.kind() {
        Kind::Number | Kind::Whole | Kind::List => format!(" Allowed: {shape}."),
        Kind::Text if shape.has_lengths() => format!(" Allowed: {shape}."),
        _ => String::new(),
    }
}
