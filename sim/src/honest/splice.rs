//! Tables in a document that people have written the rest of.

use std::path::Path;

const END: &str = "<!-- end -->";

/// `document` with `body` between its marks, of which the first bears `name`.
///
/// # Errors
/// Which marks it lacks.
pub fn splice(document: &str, name: &str, body: &str) -> Result<String, String> {
    let begin = format!("<!-- {name} -->");
    let parts = document
        .split_once(&begin)
        .and_then(|(head, rest)| rest.split_once(END).map(|(_, tail)| (head, tail)));
    let (head, tail) =
        parts.ok_or_else(|| format!("it has no lines `{begin}` and `{END}` to write between"))?;
    Ok(format!("{head}{begin}\n{}\n{END}{tail}", body.trim_end()))
}

/// The document at `path` as [`splice`] makes it; what people wrote meanwhile stays.
///
/// # Errors
/// That it cannot be read, or which marks it lacks.
pub fn spliced(path: &Path, name: &str, body: &str) -> Result<String, String> {
    let trouble = |reason: String| format!("{}: {reason}", path.display());
    let document = std::fs::read_to_string(path).map_err(|error| trouble(error.to_string()))?;
    splice(&document, name, body).map_err(trouble)
}

/// Writes it back.
///
/// # Errors
/// As [`spliced`], or that it cannot be written.
pub fn write(path: &Path, name: &str, body: &str) -> Result<(), String> {
    let new = spliced(path, name, body)?;
    std::fs::write(path, new).map_err(|error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_between_the_marks_is_replaced() {
        let document = "Words.\n<!-- honest -->\nold\n<!-- end -->\nMore.\n";
        let new = splice(document, "honest", "new\n\n").expect("marks");
        assert_eq!(new, document.replace("old", "new"));
        assert_eq!(
            splice(&new, "honest", "new").as_deref(),
            Ok(new.as_str()),
            "twice is once"
        );
        assert!(splice("somebody's text", "honest", "a").is_err());
    }
}
