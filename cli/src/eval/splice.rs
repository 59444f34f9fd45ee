//! Tables in a document that people have written the rest of.

use std::path::{Path, PathBuf};

use crate::result_file::{ResultFile, WriteError};

const END: &str = "<!-- end -->";

/// A document that has a place for the tables, or is to be made.
#[derive(Debug)]
pub(crate) struct Splice {
    path: PathBuf,
    name: String,
    file: ResultFile,
}

impl Splice {
    /// Tries whether tables called `name` can be written there.
    pub(crate) fn prepare(path: &Path, name: String) -> Result<Self, WriteError> {
        splice(&read(path)?, &name, "").map_err(|reason| WriteError::new(path, &reason))?;
        Ok(Self {
            path: path.to_owned(),
            name,
            file: ResultFile::prepare(path)?,
        })
    }

    /// The document.
    pub(super) fn file(&self) -> &ResultFile {
        &self.file
    }

    /// Writes `body` between the marks of the name if there are any, else as the whole file.
    pub(crate) fn write(&self, body: &str) -> Result<(), WriteError> {
        // What people wrote meanwhile stays.
        let text = splice(&read(&self.path)?, &self.name, body);
        let text = text.map_err(|reason| WriteError::new(&self.path, &reason))?;
        self.file.write(text.as_bytes())
    }
}

/// Nothing where there is no file yet, or what cannot be read back, such as a pipe.
fn read(path: &Path) -> Result<String, WriteError> {
    if std::fs::metadata(path).is_ok_and(|there| there.is_file()) {
        return std::fs::read_to_string(path).map_err(|error| WriteError::new(path, &error));
    }
    Ok(String::new())
}

fn splice(document: &str, name: &str, body: &str) -> Result<String, String> {
    let begin = format!("<!-- coloc eval: {name} -->");
    let whole = format!("{begin}\n{}\n{END}\n", body.trim_end());
    if document.trim().is_empty() {
        return Ok(whole);
    }
    let parts = document
        .split_once(&begin)
        .and_then(|(head, rest)| rest.split_once(END).map(|(_, tail)| (head, tail)));
    let (head, tail) =
        parts.ok_or_else(|| format!("it has no lines `{begin}` and `{END}` to write between"))?;
    Ok(format!("{head}{}{tail}", whole.trim_end()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_between_the_marks_is_replaced() {
        let document = "Words.\n<!-- coloc eval: a -->\nold\n<!-- end -->\nMore.\n<!-- coloc eval: b -->\nB\n<!-- end -->\n";
        let new = splice(document, "a", "new\n\n").unwrap();
        assert_eq!(new, document.replace("old", "new"));
        assert_eq!(splice(&new, "a", "new").unwrap(), new, "twice is once");
    }

    #[test]
    fn a_new_file_is_its_own_document_and_a_stranger_is_left_alone() {
        let new = splice("", "a", "body").unwrap();
        assert_eq!(new, "<!-- coloc eval: a -->\nbody\n<!-- end -->\n");
        assert!(
            splice("somebody's text", "a", "body")
                .unwrap_err()
                .contains("<!-- coloc eval: a -->")
        );
    }
}
