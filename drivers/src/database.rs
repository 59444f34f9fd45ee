//! A DBC file: which messages and signals there are.

use std::path::Path;

use can_dbc::{Dbc, Message, MessageId};
use socketcan::{ExtendedId, Id, StandardId};

use crate::encoder::ConfigError;
use crate::signal::SignalDecoder;

/// Describes coloc's own encoder frames.
pub const COLOC_DBC: &str = include_str!("../coloc.dbc");

/// A DBC file, parsed.
#[derive(Debug)]
pub struct Database {
    dbc: Dbc,
}

impl Database {
    /// The file at `path`, or coloc's own.
    ///
    /// # Errors
    /// [`ConfigError::ReadDbc`] and [`ConfigError::ParseDbc`].
    pub fn load(path: Option<&Path>) -> Result<Self, ConfigError> {
        let Some(path) = path else {
            return Self::parse(COLOC_DBC, "coloc.dbc".as_ref());
        };
        let bytes = std::fs::read(path).map_err(|error| ConfigError::ReadDbc {
            path: path.to_owned(),
            error,
        })?;
        // Old files are in some 8-bit code page, which matters in comments only.
        Self::parse(&String::from_utf8_lossy(&bytes), path)
    }

    fn parse(text: &str, path: &Path) -> Result<Self, ConfigError> {
        let dbc = Dbc::try_from(text).map_err(|error| ConfigError::ParseDbc {
            path: path.to_owned(),
            error: Box::new(error),
        })?;
        Ok(Self { dbc })
    }

    /// The message called `name`.
    ///
    /// # Errors
    /// [`ConfigError::UnknownMessage`], listing what there is.
    pub fn message(&self, name: &str) -> Result<&Message, ConfigError> {
        let found = self
            .dbc
            .messages
            .iter()
            .find(|message| message.name == name);
        found.ok_or_else(|| ConfigError::UnknownMessage {
            message: name.to_owned(),
            available: listed(self.dbc.messages.iter().map(|message| &message.name)),
        })
    }

    /// The signal called `name` in `message`, compiled.
    ///
    /// # Errors
    /// [`ConfigError::UnknownSignal`], listing what there is, and [`ConfigError::Signal`].
    pub fn signal(&self, message: &Message, name: &str) -> Result<SignalDecoder, ConfigError> {
        let found = message.signals.iter().find(|signal| signal.name == name);
        let signal = found.ok_or_else(|| ConfigError::UnknownSignal {
            message: message.name.clone(),
            signal: name.to_owned(),
            available: listed(message.signals.iter().map(|signal| &signal.name)),
        })?;
        let extended = self.dbc.extended_value_type_for_signal(message.id, name);
        SignalDecoder::compile(signal, message.size, extended).map_err(|error| {
            ConfigError::Signal {
                message: message.name.clone(),
                signal: name.to_owned(),
                error,
            }
        })
    }
}

/// The identifier of `message` as frames carry it.
///
/// # Errors
/// [`ConfigError::Identifier`] if it is wider than CAN's 11 or 29 bits.
pub(crate) fn id_of(message: &Message) -> Result<Id, ConfigError> {
    let id = match message.id {
        MessageId::Standard(id) => StandardId::new(id).map(Id::Standard),
        MessageId::Extended(id) => ExtendedId::new(id).map(Id::Extended),
    };
    id.ok_or_else(|| ConfigError::Identifier {
        message: message.name.clone(),
        id: message.id.raw(),
    })
}

fn listed<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names.map(String::as_str).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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

    proptest! {
        #[test]
        fn any_text_is_a_database_or_an_error(text in r"(VERSION \PC{0,20}\n)?(BO_ [0-9]{0,11} \w{0,5}: [0-9]{0,3} \w{0,3}\n)?( SG_ \w{0,4} : [0-9|@+-]{0,12} \(1,0\) \PC{0,20})?") {
            if let Ok(database) = Database::parse(&text, "x.dbc".as_ref()) {
                for message in &database.dbc.messages {
                    let _ = id_of(message);
                    for signal in &message.signals {
                        if let Ok(decoder) = database.signal(message, &signal.name) {
                            let _ = decoder.physical(&[0xFF; 64]);
                        }
                    }
                }
            }
        }
    }
}
