//! Raw values that stand for "no value".

use can_dbc_pest::{Pair, Rule};

/// A raw value that stands for "no value", by the text that `VAL_` gives to it.
#[derive(Debug)]
pub(super) struct Code {
    /// The message's identifier, as written.
    pub(super) written: u64,
    pub(super) signal: String,
    pub(super) raw: i128,
}

/// The values of `VAL_ 256 SPEED 255 "SNA" 254 "Error";` that are none.
pub(super) fn codes(statement: &Pair<'_, Rule>) -> Option<Vec<Code>> {
    if statement.as_rule() != Rule::value_table_def {
        return None;
    }
    let parts = || statement.clone().into_inner().flatten();
    let text = |rule| parts().find(|part| part.as_rule() == rule);
    let written = text(Rule::message_id)?.as_str().parse().ok()?;
    let signal = text(Rule::signal_name)?.as_str();
    let values = parts().filter(|part| part.as_rule() == Rule::table_value_description);
    let code = |value: Pair<'_, Rule>| {
        let (raw, text) = value.as_str().split_once('"')?;
        stands_for_none(text).then_some(Code {
            written,
            signal: signal.to_owned(),
            raw: raw.trim().parse().ok()?,
        })
    };
    Some(values.filter_map(code).collect())
}

/// As the many people write it who make DBC files.
fn stands_for_none(text: &str) -> bool {
    let letters = text.chars().filter(|character| character.is_alphanumeric());
    let word: String = letters.flat_map(char::to_lowercase).collect();
    let whole = ["sna", "na", "nan", "none", "init"];
    let parts = [
        "notavail",
        "unavail",
        "notvalid",
        "invalid",
        "novalue",
        "nosignal",
        "nodata",
        "error",
        "fault",
        "failure",
        "defect",
        "reserved",
        "notused",
        "unused",
        "undefined",
        "notdefined",
        "unknown",
        "missing",
        "initiali",
        "ungültig",
        "nichtverf",
        "fehler",
    ];
    whole.contains(&word.as_str())
        || word.starts_with("sna")
        || parts.iter().any(|part| word.contains(part))
}

#[cfg(test)]
mod tests {
    use super::super::Database;

    /// Values at the end of what the bits can say whose text says that they are none: they are out of range then.
    #[test]
    fn a_value_that_is_called_none_is_none() {
        let range = |signal: &str, values: &str| {
            let text = format!(
                "BU_: A\n\nBO_ 256 M: 8 A\n SG_ S : {signal} \"\" A\n\nVAL_ 256 S {values} ;\n"
            );
            let database = Database::parse(text.as_bytes(), "x.dbc".as_ref()).unwrap();
            let message = database.message("M").unwrap();
            database.signal(message, "S").unwrap().raw_range()
        };
        let byte = "0|8@1+ (0.1,0) [0|25.5]";
        for values in [
            "255 \"SNA\"",
            "255 \"Signal not available\" 1 \"Error\"",
            "3 \"three\" 255 \"n/a\"",
            "255 \"INVALID\"",
        ] {
            assert_eq!(range(byte, values), Some((0, 254)), "{values}");
        }
        assert_eq!(range(byte, "254 \"Error\" 255 \"SNA\""), Some((0, 253)));
        assert_eq!(
            range("0|16@1+ (1,0) [0|0]", "65535 \"SNA\""),
            Some((0, 65534))
        );
        assert_eq!(
            range("0|8@1+ (0.1,0) [0|20]", "255 \"SNA\""),
            Some((0, 200))
        );
        for values in ["-128 \"SNA\"", "128 \"SNA\""] {
            assert_eq!(
                range("0|8@1- (1,0) [0|0]", values),
                Some((-127, 127)),
                "{values}"
            );
        }
        for values in ["255 \"fast\"", "7 \"SNA\"", "0 \"Init\""] {
            assert_eq!(range(byte, values), None, "{values}");
        }
    }
}
