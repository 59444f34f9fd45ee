//! A message of a DBC file.

use can_dbc::{Message, Signal};
use socketcan::{ExtendedId, Id, StandardId};

use super::listed;
use crate::config_error::ConfigError;

/// A message of a DBC file, with its identifier as written: the parser cuts it to the bits that fit.
#[derive(Debug)]
pub struct DbcMessage {
    pub(super) message: Message,
    pub(super) written: u64,
    pub(super) line: usize,
    /// What `GenMsgCycleTime` says of it \[ms\].
    pub(super) cycle_ms: Option<f64>,
}

/// Marks an extended identifier in a DBC file.
pub(super) const EXTENDED: u64 = 1 << 31;

impl DbcMessage {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.message.name
    }

    /// The identifier as frames carry it.
    ///
    /// # Errors
    /// [`ConfigError::Identifier`] if it is wider than CAN's 11 or 29 bits.
    pub fn id(&self) -> Result<Id, ConfigError> {
        let id = if self.written & EXTENDED == 0 {
            u16::try_from(self.written)
                .ok()
                .and_then(StandardId::new)
                .map(Id::Standard)
        } else {
            u32::try_from(self.written ^ EXTENDED)
                .ok()
                .and_then(ExtendedId::new)
                .map(Id::Extended)
        };
        id.ok_or_else(|| ConfigError::Identifier {
            message: self.message.name.clone(),
            id: self.written,
            line: self.line,
        })
    }

    /// How often it is sent \[s\], if the file says so of this very message: the attribute `GenMsgCycleTime`, which most tools
    /// write. Zero is a way to say that it has no cycle.
    pub(crate) fn cycle_s(&self) -> Option<f64> {
        self.cycle_ms.map(|ms| ms * 1e-3)
    }

    /// The signal called `name`.
    ///
    /// # Errors
    /// [`ConfigError::UnknownSignal`], listing what there is, and [`ConfigError::Ambiguous`].
    pub(crate) fn signal(&self, name: &str) -> Result<&Signal, ConfigError> {
        let mut found = self
            .message
            .signals
            .iter()
            .filter(|signal| signal.name == name);
        let signal = found.next().ok_or_else(|| ConfigError::UnknownSignal {
            message: self.message.name.clone(),
            signal: name.to_owned(),
            available: listed(self.message.signals.iter().map(|signal| &signal.name)),
        })?;
        if found.any(|other| other != signal) {
            let what = format!("message {} in line {}", self.message.name, self.line);
            return Err(ConfigError::ambiguous(format!(
                "{what} has two signals '{name}'"
            )));
        }
        Ok(signal)
    }

    /// Whether it says the same as `other`, as where two files were joined.
    pub(super) fn repeats(&self, other: &Self) -> bool {
        self.written == other.written && self.message == other.message
    }
}
