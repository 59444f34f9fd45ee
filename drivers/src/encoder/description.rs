//! What was understood of a configuration and its DBC file, in words.

use can_dbc::{ByteOrder, Signal, ValueType};

use crate::can::Id;
use crate::signal::SignalDecoder;

use super::config::{ConfigError, OdometryConfig};
use super::plan;

/// What will be read, for the person who configured it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Description {
    /// One line a signal: where it is, and what its bits mean.
    pub signals: Vec<String>,
    /// One line for each thing that is possible and unlikely.
    pub warnings: Vec<String>,
}

impl Description {
    /// Two wheels in one message are no reason to say something twice.
    pub(super) fn warn(&mut self, warning: String) {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }
}

/// Says what a decoder of this configuration will read.
///
/// # Errors
/// [`ConfigError`], as [`super::OdometryDecoder::new`].
pub fn describe(config: &OdometryConfig) -> Result<Description, ConfigError> {
    plan::plan(config).map(|plan| plan.description)
}

/// A signal as it will be read, after the setting that names it.
pub(super) fn line(
    setting: &str,
    place: (&str, Id, u8),
    signal: &Signal,
    decoder: &SignalDecoder,
    meaning: &str,
) -> String {
    let (message, id, bus) = place;
    let order = match signal.byte_order {
        ByteOrder::LittleEndian => "Intel (little-endian)",
        ByteOrder::BigEndian => "Motorola (big-endian)",
    };
    let number = match (decoder.is_integer(), signal.value_type) {
        (false, _) => "float",
        (true, ValueType::Signed) => "signed",
        (true, ValueType::Unsigned) => "unsigned",
    };
    let range = decoder
        .range()
        .map_or("no range".to_owned(), |[lowest, highest]| {
            format!("{lowest} to {highest}")
        });
    format!(
        "{setting}: {} of {message}, identifier {} on bus {bus}: {} bits from bit {}, {order}, {number}, times {} plus {}, {range}{}; {meaning}",
        signal.name,
        identifier(id),
        signal.size,
        signal.start_bit,
        signal.factor,
        signal.offset,
        if signal.unit.is_empty() {
            String::new()
        } else {
            format!(" {}", signal.unit)
        },
    )
}

fn identifier(id: Id) -> String {
    match id {
        Id::Standard(id) => format!("0x{:03X}", id.as_raw()),
        Id::Extended(id) => format!("0x{:08X} (extended)", id.as_raw()),
    }
}
