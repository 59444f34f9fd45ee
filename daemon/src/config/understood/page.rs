//! Lines with their subject before them.

use super::super::shape::Shape;

/// So wide is a subject \[characters\].
const SUBJECT: usize = 13;

/// What was written so far.
#[derive(Debug, Default)]
pub(super) struct Page(String);

impl Page {
    /// A line; with an empty `subject` it goes on with the one before.
    pub(super) fn line(&mut self, subject: &str, text: impl AsRef<str>) {
        let line = format!("{subject:<SUBJECT$} {}\n", text.as_ref());
        self.0.push_str(&line);
    }

    /// The same for each of `texts`.
    pub(super) fn lines(&mut self, subject: &str, texts: impl IntoIterator<Item = String>) {
        let mut subject = subject;
        for text in texts {
            self.line(subject, text);
            subject = "";
        }
    }

    pub(super) fn text(&self) -> &str {
        &self.0
    }
}

/// A word that was chosen, with what the description of `key` says that it means.
pub(super) fn chosen(key: &str, value: impl serde::Serialize) -> String {
    let word = serde_json::to_value(value).unwrap_or_default();
    let word = word.as_str().unwrap_or_default();
    let setting = key.split('.').try_fold(Shape::whole(), Shape::setting);
    let meaning = setting.and_then(|setting| {
        let mut words = setting.words();
        words.find(|(known, _)| *known == word)
    });
    let meaning = meaning.map(|(_, meaning)| meaning.trim_end_matches('.'));
    meaning.map_or_else(
        || word.to_owned(),
        |meaning| format!("{word}: {}", plain(meaning)),
    )
}

/// Without the marks of Markdown, on one line.
fn plain(text: &str) -> String {
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    words.replace('`', "")
}
