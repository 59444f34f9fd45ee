//! A DBC file: which messages and signals there are.

mod code;
mod message;

use std::path::Path;

use can_dbc::{ExtendedMultiplex, SignalExtendedValueTypeList};
use can_dbc_pest::{DbcParser, Pair, Parser, Rule};

use self::code::{Code, codes};
use self::message::EXTENDED;
use crate::config_error::ConfigError;
use crate::dbc_text;
use crate::signal::{SignalDecoder, SignalError};

pub use self::message::DbcMessage;

/// Describes coloc's own encoder frames.
pub const COLOC_DBC: &str = include_str!("../coloc.dbc");

/// A DBC file, parsed.
#[derive(Debug)]
pub struct Database {
    messages: Vec<DbcMessage>,
    value_types: Vec<Addressed<SignalExtendedValueTypeList>>,
    multiplexing: Vec<Addressed<ExtendedMultiplex>>,
    codes: Vec<Code>,
}

/// Something that the file says about a signal of another line.
#[derive(Debug)]
struct Addressed<T> {
    what: T,
    /// The message's identifier, as written.
    written: u64,
    line: usize,
}

/// What says something about a signal.
trait Addresses: PartialEq {
    const KEYWORD: &str;
    fn signal(&self) -> &str;
}

impl Addresses for SignalExtendedValueTypeList {
    const KEYWORD: &str = "SIG_VALTYPE_";
    fn signal(&self) -> &str {
        &self.signal_name
    }
}

impl Addresses for ExtendedMultiplex {
    const KEYWORD: &str = "SG_MUL_VAL_";
    fn signal(&self) -> &str {
        &self.signal_name
    }
}

impl Database {
    /// The file at `path`, or coloc's own.
    ///
    /// # Errors
    /// [`ConfigError::ReadDbc`] and [`ConfigError::ParseDbc`].
    pub fn load(path: Option<&Path>) -> Result<Self, ConfigError> {
        let Some(path) = path else {
            return Self::parse(COLOC_DBC.as_bytes(), "coloc.dbc".as_ref());
        };
        let bytes = std::fs::read(path).map_err(|error| ConfigError::ReadDbc {
            path: path.to_owned(),
            error,
        })?;
        Self::parse(&bytes, path)
    }

    fn parse(bytes: &[u8], path: &Path) -> Result<Self, ConfigError> {
        let refused = |problem: String| ConfigError::ParseDbc {
            path: path.to_owned(),
            problem,
        };
        let text = dbc_text::text(bytes).map_err(|error| refused(error.to_string()))?;
        let file =
            DbcParser::parse(Rule::file, &text).map_err(|error| refused(error.to_string()))?;
        let mut database = Self {
            messages: Vec::new(),
            value_types: Vec::new(),
            multiplexing: Vec::new(),
            codes: Vec::new(),
        };
        let mut cycles = Vec::new();
        for statement in file.flat_map(Pair::into_inner) {
            cycles.extend(cycle_time(&statement));
            database.codes.extend(codes(&statement).unwrap_or_default());
            let line = statement.line_col().0;
            database
                .take(statement, line)
                .map_err(|problem| refused(format!("line {line}: {problem}")))?;
        }
        for message in &mut database.messages {
            let own = cycles.iter().find(|(id, _)| *id == message.written);
            message.cycle_ms = own.map(|(_, ms)| *ms);
        }
        Ok(database)
    }

    fn take(&mut self, statement: Pair<'_, Rule>, line: usize) -> Result<(), String> {
        let rule = statement.as_rule();
        if !matches!(
            rule,
            Rule::message | Rule::signal_value_type | Rule::sg_mul_val
        ) {
            return Ok(());
        }
        let written = written_id(&statement)?;
        let problem = |error: can_dbc::DbcError| error.to_string();
        match rule {
            Rule::message => self.messages.push(DbcMessage {
                message: statement.try_into().map_err(problem)?,
                written,
                line,
                cycle_ms: None,
            }),
            Rule::signal_value_type => self.value_types.push(Addressed {
                what: statement.try_into().map_err(problem)?,
                written,
                line,
            }),
            _ => self.multiplexing.push(Addressed {
                what: statement.try_into().map_err(problem)?,
                written,
                line,
            }),
        }
        Ok(())
    }

    /// The message called `name`.
    ///
    /// # Errors
    /// [`ConfigError::UnknownMessage`], listing what there is; [`ConfigError::Identifier`]; [`ConfigError::Ambiguous`] if
    /// its name or identifier stands for something else too.
    pub fn message(&self, name: &str) -> Result<&DbcMessage, ConfigError> {
        let found = self.messages.iter().find(|message| message.name() == name);
        let found = found.ok_or_else(|| ConfigError::UnknownMessage {
            message: name.to_owned(),
            available: listed(self.messages.iter().map(|message| &message.message.name)),
        })?;
        found.id()?;
        let other = self.messages.iter().find(|other| {
            let same = other.name() == name || other.written == found.written;
            same && !other.repeats(found)
        });
        other.map_or(Ok(found), |other| Err(clash(found, other)))
    }

    /// The signal called `name` in `message`, compiled.
    ///
    /// # Errors
    /// [`ConfigError::UnknownSignal`], listing what there is, [`ConfigError::Ambiguous`] and [`ConfigError::Signal`].
    pub fn signal(&self, message: &DbcMessage, name: &str) -> Result<SignalDecoder, ConfigError> {
        let signal = message.signal(name)?;
        let refused = |error| ConfigError::Signal {
            message: message.name().to_owned(),
            signal: name.to_owned(),
            error,
        };
        if self.only(&self.multiplexing, message, name)?.is_some() {
            return Err(refused(SignalError::Multiplexed));
        }
        let value_type = self
            .only(&self.value_types, message, name)?
            .map(|value_type| &value_type.signal_extended_value_type);
        let decoder =
            SignalDecoder::compile(signal, message.message.size, value_type).map_err(refused)?;
        let own = |code: &&Code| code.written == message.written && code.signal == name;
        let codes: Vec<_> = self.codes.iter().filter(own).map(|code| code.raw).collect();
        Ok(decoder.without(&codes))
    }

    /// What one of the lists says about a signal.
    ///
    /// Where a line names a message or signal that does not exist, and may have meant this one, there is no telling.
    fn only<'a, T: Addresses>(
        &self,
        list: &'a [Addressed<T>],
        message: &DbcMessage,
        name: &str,
    ) -> Result<Option<&'a T>, ConfigError> {
        let close = |entry: &&Addressed<T>| {
            let same_message = (entry.written ^ message.written) & !EXTENDED == 0;
            let same_signal = entry.what.signal() == name;
            (same_message || same_signal) && !self.has(entry.written, entry.what.signal())
        };
        if let Some(lost) = list.iter().find(close) {
            return Err(ConfigError::ambiguous(format!(
                "{} in line {} names signal '{}' of the identifier {}, which is not there; is it '{name}' of {}?",
                T::KEYWORD,
                lost.line,
                lost.what.signal(),
                lost.written,
                message.written
            )));
        }
        let mut found = list
            .iter()
            .filter(|entry| entry.written == message.written && entry.what.signal() == name);
        let first = found.next();
        match found.find(|other| first.is_some_and(|first| other.what != first.what)) {
            Some(other) => Err(ConfigError::ambiguous(format!(
                "{} says in line {} about signal '{name}' of {} what another line contradicts",
                T::KEYWORD,
                other.line,
                message.name()
            ))),
            None => Ok(first.map(|entry| &entry.what)),
        }
    }

    fn has(&self, written: u64, signal: &str) -> bool {
        let has_signal = |message: &DbcMessage| {
            let mut names = message.message.signals.iter().map(|signal| &signal.name);
            names.any(|name| name == signal)
        };
        self.messages
            .iter()
            .filter(|message| message.written == written)
            .any(has_signal)
    }
}

/// Identifier and milliseconds of `BA_ "GenMsgCycleTime" BO_ 256 20;`.
fn cycle_time(statement: &Pair<'_, Rule>) -> Option<(u64, f64)> {
    if statement.as_rule() != Rule::attr_value {
        return None;
    }
    let parts = || statement.clone().into_inner().flatten();
    let text = |rule| parts().find(|part| part.as_rule() == rule);
    let name = text(Rule::attribute_name)?;
    let id = text(Rule::message_id)?.as_str().parse().ok()?;
    let value = text(Rule::number)?.as_str().parse().ok()?;
    (name.as_str().trim_matches('"') == "GenMsgCycleTime").then_some((id, value))
}

/// The first number of a statement, with all its digits.
fn written_id(statement: &Pair<'_, Rule>) -> Result<u64, String> {
    let id = statement
        .clone()
        .into_inner()
        .flatten()
        .find(|pair| pair.as_rule() == Rule::message_id)
        .map_or("", |pair| pair.as_str());
    id.parse().map_err(|_| format!("'{id}' is no identifier"))
}

fn clash(found: &DbcMessage, other: &DbcMessage) -> ConfigError {
    let what = |message: &DbcMessage| {
        format!(
            "'{}' with the identifier {} in line {}",
            message.name(),
            message.written,
            message.line
        )
    };
    ConfigError::ambiguous(format!(
        "messages {} and {}: rename or remove one",
        what(found),
        what(other)
    ))
}

fn listed<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<_> = names.map(String::as_str).collect();
    if names.is_empty() {
        return "none".into();
    }
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use socketcan::{ExtendedId, Id, StandardId};

    use super::*;

    #[test]
    fn what_is_missing_is_named_with_what_there_is() {
        let database = Database::load(None).unwrap();
        let message = database.message("WheelMiddle").unwrap_err().to_string();
        assert!(
            message.contains("WheelMiddle") && message.contains("WheelLeft, WheelRight"),
            "{message}"
        );
        let left = database.message("WheelLeft").unwrap();
        let signal = database.signal(left, "Speed").unwrap_err().to_string();
        assert!(
            signal.contains("WheelLeft") && signal.contains("Ticks, Alive, Checksum"),
            "{signal}"
        );
    }

    fn database(body: &str) -> Database {
        let text = format!("VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\n{body}");
        Database::parse(text.as_bytes(), "x.dbc".as_ref()).unwrap()
    }

    const S: &str = " SG_ S : 0|32@1- (1,0) [0|0] \"\" A\n";
    const M: &str =
        " SG_ P M : 40|8@1+ (1,0) [0|0] \"\" A\n SG_ S M : 0|32@1+ (1,0) [0|0] \"\" A\n";

    /// What becomes of signal `S` of message `M`.
    fn outcome(body: &str) -> Result<SignalDecoder, String> {
        let database = database(body);
        let message = database.message("M").map_err(|error| error.to_string())?;
        database
            .signal(message, "S")
            .map_err(|error| error.to_string())
    }

    fn assert_refused(body: &str, expected: &str) {
        let refusal = outcome(body).unwrap_err();
        assert!(
            refusal.contains(expected),
            "{refusal}\nshould say: {expected}"
        );
    }

    #[test]
    fn an_identifier_is_quoted_as_written_and_never_cut() {
        let id = |written: u64| {
            let database = database(&format!("BO_ {written} M: 8 A\n{S}"));
            let id = database.message("M").and_then(DbcMessage::id);
            id.map_err(|error| error.to_string())
        };
        let extended = ExtendedId::new(0x18FF_0100).map(Id::Extended);
        assert_eq!(id(0x98FF_0100).ok(), extended);
        assert_eq!(id(0x7FF).ok(), StandardId::new(0x7FF).map(Id::Standard));
        for (written, expected) in [
            (
                0x18FF_0100,
                "419365120 (0x18FF0100), which is wider than 11 bits and not marked",
            ),
            (0x1_0100, "65792 (0x10100), which is wider than 11 bits"),
            (0x800, "2048 (0x800), which is wider than 11 bits"),
            (
                0xC000_0000,
                "3221225472 (0xC0000000), which is wider than 29 bits",
            ),
            (
                0xFFFF_FFFF,
                "4294967295 (0xFFFFFFFF), which is wider than 29 bits",
            ),
        ] {
            let refusal = id(written).unwrap_err();
            assert!(
                refusal.contains(expected),
                "{refusal}\nshould say: {expected}"
            );
        }
    }

    #[test]
    fn a_foreign_message_with_a_wide_identifier_says_nothing_about_ours() {
        let body =
            format!("BO_ 256 M: 8 A\n{S}\nBO_ 65792 Other: 8 A\n{S}\nSIG_VALTYPE_ 65792 S : 1;\n");
        assert!(outcome(&body).unwrap().is_integer());
    }

    #[test]
    fn a_value_type_that_may_have_meant_ours_is_refused() {
        let message = format!("BO_ 2566844926 M: 8 A\n{S}\n");
        assert!(
            !outcome(&(message.clone() + "SIG_VALTYPE_ 2566844926 S : 1;\n"))
                .unwrap()
                .is_integer()
        );
        for (line, expected) in [
            (
                "SIG_VALTYPE_ 419361278 S : 1;\n",
                "SIG_VALTYPE_ in line 12 names signal 'S' of the identifier 419361278",
            ),
            (
                "SIG_VALTYPE_ 7 S : 1;\n",
                "names signal 'S' of the identifier 7",
            ),
            (
                "SIG_VALTYPE_ 2566844926 Speed : 1;\n",
                "names signal 'Speed'",
            ),
            ("SG_MUL_VAL_ 419361278 S P 1-1;\n", "SG_MUL_VAL_ in line 12"),
        ] {
            assert_refused(&(message.clone() + line), expected);
        }
        assert!(
            outcome(&(message + "SIG_VALTYPE_ 7 Other : 1;\n")).is_ok(),
            "no concern of ours"
        );
    }

    #[test]
    fn a_signal_that_depends_on_another_is_multiplexed_whatever_its_mark() {
        let body = format!("BO_ 256 M: 8 A\n{M}\nSG_MUL_VAL_ 256 S P 1-1;\n");
        assert_refused(&body, "it is multiplexed");
    }

    #[test]
    fn names_and_identifiers_that_stand_for_two_things_are_refused() {
        let other = S.replace("0|32", "32|32");
        assert_refused(
            &format!("BO_ 256 M: 8 A\n{S}\nBO_ 257 M: 8 A\n{S}"),
            "'M' with the identifier 257",
        );
        assert_refused(
            &format!("BO_ 256 M: 8 A\n{S}\nBO_ 256 N: 8 A\n{other}"),
            "'N' with the identifier 256",
        );
        assert_refused(&format!("BO_ 256 M: 8 A\n{S}{other}"), "two signals 'S'");
        assert!(
            outcome(&format!("BO_ 256 M: 8 A\n{S}\nBO_ 256 M: 8 A\n{S}")).is_ok(),
            "said twice"
        );
    }

    #[test]
    fn files_of_other_tools_are_read() {
        let of = |text: &str| Database::parse(text.as_bytes(), "x.dbc".as_ref());
        let file = "\u{FEFF}VERSION \"\"\n\nBU_: A\n\nBO_ 256 M: 8 A\n SG_ S : 0|32@1+ (1.,0.) [0.|1.] \"\" A\n\nEV_ V: 1 [0|1] \"\" 20.5 2 DUMMY_NODE_VECTOR0 A;\n";
        assert!(of(file).unwrap().message("M").is_ok());
        let refusal = of("/* x */").unwrap_err().to_string();
        assert!(
            refusal.contains("line 1 has a comment in /* */"),
            "{refusal}"
        );
    }

    proptest! {
        #[test]
        fn any_text_is_a_database_or_an_error(text in r"(VERSION \PC{0,20}\n)?(BO_ [0-9]{0,11} \w{0,5}: [0-9]{0,3} \w{0,3}\n)?( SG_ \w{0,4} : [0-9|@+-]{0,12} \(1,0\) \PC{0,20})?") {
            if let Ok(database) = Database::parse(text.as_bytes(), "x.dbc".as_ref()) {
                for message in &database.messages {
                    let _ = message.id();
                    for signal in &message.message.signals {
                        if let Ok(decoder) = database.signal(message, &signal.name) {
                            let _ = decoder.physical(&[0xFF; 64]);
                        }
                    }
                }
            }
        }

        #[test]
        fn an_identifier_is_itself_or_refused(written in prop_oneof![0..=0xFFF_u64, any::<u32>().prop_map(u64::from), any::<u64>()]) {
            let text = format!("BU_: A\n\nBO_ {written} M: 8 A\n{S}");
            let Ok(database) = Database::parse(text.as_bytes(), "x.dbc".as_ref()) else {
                prop_assert!(written > u64::from(u32::MAX));
                return Ok(());
            };
            let raw = match database.message("M").and_then(DbcMessage::id) {
                Ok(Id::Standard(id)) => Some(u64::from(id.as_raw())),
                Ok(Id::Extended(id)) => Some(u64::from(id.as_raw()) | EXTENDED),
                Err(_) => None,
            };
            let fits = written < 0x800 || (EXTENDED..EXTENDED + (1 << 29)).contains(&written);
            prop_assert_eq!(raw, fits.then_some(written));
        }
    }
}
