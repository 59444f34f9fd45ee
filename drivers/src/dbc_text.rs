//! The text of a DBC file, as its parser wants it.

use std::borrow::Cow;

/// Why bytes are no text of a DBC file.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum TextError {
    /// Two bytes a character.
    #[error("it is UTF-16 text: save it as UTF-8")]
    Utf16,
    /// `/* … */`, which is no comment in a DBC file.
    #[error(
        "line {0} has a comment in /* */; in a DBC file comments begin with // and end with the line"
    )]
    BlockComment(usize),
}

/// Text that means the same and that the parser reads: without a byte order mark and environment variables, which it
/// knows in one form only, and with a digit behind every decimal point. Lines keep their numbers.
///
/// # Errors
/// [`TextError`].
pub(crate) fn text(bytes: &[u8]) -> Result<String, TextError> {
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        return Err(TextError::Utf16);
    }
    let bytes = bytes.strip_prefix(&[0xEF, 0xBB, 0xBF]).unwrap_or(bytes);
    plain(&decode(bytes))
}

/// Old files are in the code page of Western Windows.
fn decode(bytes: &[u8]) -> Cow<'_, str> {
    str::from_utf8(bytes)
        .map(Cow::Borrowed)
        .ok()
        .or_else(|| can_dbc::decode_cp1252(bytes))
        .unwrap_or_else(|| String::from_utf8_lossy(bytes))
}

fn plain(mut rest: &str) -> Result<String, TextError> {
    let mut plain = String::with_capacity(rest.len());
    while let Some(first) = rest.chars().next() {
        let (length, keeps) = match first {
            '"' => (string(rest), true),
            '/' if rest.starts_with("//") => (line(rest), true),
            '/' if rest.starts_with("/*") => {
                return Err(TextError::BlockComment(plain.matches('\n').count() + 1));
            }
            'E' if rest.starts_with("EV_ ") && begins_line(&plain) => (statement(rest), false),
            other => (other.len_utf8(), true),
        };
        let (token, after) = rest.split_at(length);
        if keeps {
            plain.push_str(token);
        } else {
            plain.extend(token.chars().filter(|&character| character == '\n'));
        }
        if token == "." && ends_number(&plain) && !after.starts_with(|c: char| c.is_ascii_digit()) {
            plain.push('0');
        }
        rest = after;
    }
    Ok(plain)
}

/// Length of the string that `text` begins with; `\"` does not end it.
fn string(text: &str) -> usize {
    let closes = |&(at, character): &(usize, char)| {
        character == '"' && at > 0 && !text.get(..at).is_some_and(|before| before.ends_with('\\'))
    };
    text.char_indices()
        .find(closes)
        .map_or(text.len(), |(at, _)| at + 1)
}

fn line(text: &str) -> usize {
    text.find('\n').unwrap_or(text.len())
}

/// Length of the statement that `text` begins with, its semicolon included.
fn statement(text: &str) -> usize {
    let mut quoted = false;
    let ends = |&(_, character): &(usize, char)| {
        quoted ^= character == '"';
        character == ';' && !quoted
    };
    text.char_indices()
        .find(ends)
        .map_or(text.len(), |(at, _)| at + 1)
}

fn begins_line(before: &str) -> bool {
    before
        .trim_end_matches([' ', '\t'])
        .chars()
        .next_back()
        .is_none_or(|last| last == '\n' || last == '\r')
}

/// Whether the decimal point that `text` ends with belongs to a number.
fn ends_number(text: &str) -> bool {
    text.strip_suffix('.')
        .is_some_and(|number| number.ends_with(|c: char| c.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn of(source: &str) -> String {
        text(source.as_bytes()).unwrap()
    }

    #[test]
    fn what_stands_for_the_same_is_made_the_same() {
        assert_eq!(of("\u{FEFF}VERSION"), "VERSION");
        assert_eq!(of("(1.,-0.) [0.|1.e3] 1.5"), "(1.0,-0.0) [0.0|1.0e3] 1.5");
        assert_eq!(
            of("a \"1. EV_ \\\" // /* \" 1."),
            "a \"1. EV_ \\\" // /* \" 1.0"
        );
        assert_eq!(of("// 1. /* \n1."), "// 1. /* \n1.0");
        let variable = "x\nEV_ Speed: 1 [0|1] \";\" 20.5\n 2 Node;\ny";
        assert_eq!(of(variable), "x\n\n\ny");
        assert_eq!(text(b"\"\xB0/s\"").unwrap(), "\"°/s\"");
    }

    #[test]
    fn what_is_no_text_of_a_dbc_file_is_refused() {
        assert_eq!(text(&[0xFF, 0xFE, b'V', 0]), Err(TextError::Utf16));
        assert_eq!(text(b"x\n\n/* */"), Err(TextError::BlockComment(3)));
    }

    proptest! {
        #[test]
        fn lines_keep_their_numbers(source in r#"([EV_ ;"1.\n]|EV_ |//|\\"){0,30}"#) {
            prop_assert_eq!(of(&source).matches('\n').count(), source.matches('\n').count());
        }

        #[test]
        fn any_bytes_are_text_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..100)) {
            let _ = text(&bytes);
        }
    }
}
