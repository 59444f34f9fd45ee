//! A setting that names a signal, and what the DBC file says of that.

use crate::can::Id;
use crate::config_error::ConfigError;
use crate::database::{Database, DbcMessage};
use crate::signal::SignalDecoder;

use super::super::description;
use super::super::unit::{Meaning, Unit};

/// A setting and the signal that it names.
pub(super) struct Source<'a> {
    pub(super) setting: &'a str,
    pub(super) bus: u8,
    pub(super) message: &'a str,
    pub(super) signal: &'a str,
}

/// What the DBC file says of that signal.
pub(super) struct Found<'d> {
    pub(super) message: &'d DbcMessage,
    pub(super) id: Id,
    pub(super) decoder: SignalDecoder,
    /// Where it is and what its bits mean, in words.
    pub(super) place: String,
    /// As the DBC file has it.
    pub(super) unit: String,
}

impl<'d> Found<'d> {
    /// Looks `source` up; there are so many `buses`.
    pub(super) fn look_up(
        source: &Source,
        database: &'d Database,
        buses: usize,
    ) -> Result<Self, ConfigError> {
        check_bus(source, buses)?;
        let message = database.message(source.message)?;
        let (id, signal) = (message.id()?, message.signal(source.signal)?);
        let decoder = database.signal(message, source.signal)?;
        let place = description::place((source.message, id, source.bus), signal, &decoder);
        Ok(Self {
            message,
            id,
            decoder,
            place,
            unit: signal.unit.clone(),
        })
    }

    /// A unit of which it is not known whether it contradicts what the signal is taken for.
    pub(super) fn unknown_unit(
        &self,
        source: &Source,
        key: &str,
        meaning: impl Meaning,
    ) -> Option<String> {
        let unit = self.unit.trim();
        let says_nothing = ["", "-", "1", "#", "none", "unitless", "bit", "raw"];
        let is_said = !says_nothing.contains(&unit.to_lowercase().as_str());
        (is_said && Unit::of(unit).is_none()).then(|| {
            format!(
                "{}.{key}: the DBC file gives the unit '{unit}', which is not known here: is it {}?",
                source.setting,
                meaning.word()
            )
        })
    }

    /// The DBC file must not contradict what the signal is taken for by the setting `key`.
    pub(super) fn agree(
        &self,
        source: &Source,
        key: &str,
        meaning: impl Meaning,
    ) -> Result<(), ConfigError> {
        if Unit::of(&self.unit).is_none_or(|unit| meaning.allows(unit)) {
            return Ok(());
        }
        let problem = format!(
            "is {}, but the DBC file gives signal {} of message {} the unit '{}': one of the two is wrong",
            meaning.word(),
            source.signal,
            source.message,
            self.unit
        );
        let setting = format!("{}.{key}", source.setting);
        Err(ConfigError::setting(setting, problem))
    }
}

fn check_bus(source: &Source, buses: usize) -> Result<(), ConfigError> {
    if usize::from(source.bus) < buses {
        return Ok(());
    }
    let problem = format!(
        "there is no bus {}; 'buses' has {buses}, counted from 0",
        source.bus
    );
    Err(ConfigError::setting(
        format!("{}.bus", source.setting),
        problem,
    ))
}
