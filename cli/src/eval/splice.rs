//! Tables in a document that people have written the rest of.

use std::path::Path;

use super::EvalCommandError;

const END: &str = "<!-- end -->";

/// Writes `body` into `file`: between the marks of `name` if there are any, else as the whole file.
pub(crate) fn write(file: &Path, name: &str, body: &str) -> Result<(), EvalCommandError> {
    let before = match std::fs::read_to_string(file) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(error) => return Err(EvalCommandError::files(file, &error)),
    };
    let text =
        splice(&before, name, body).map_err(|reason| EvalCommandError::files(file, &reason))?;
    std::fs::write(file, text).map_err(|error| EvalCommandError::files(file, &error))
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
