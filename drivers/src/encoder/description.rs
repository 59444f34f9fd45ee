//! What was understood of a configuration and its DBC file, in words.

use std::fmt;

use can_dbc::{ByteOrder, Signal, ValueType};

use crate::can::{Id, identifier};
use crate::signal::SignalDecoder;

/// What will be read, for the person who configured it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Description {
    /// The signals, in the order of the configuration.
    pub signals: Vec<SignalDescription>,
    /// What their velocities make.
    pub geometry: String,
    /// The messages that must come.
    pub expected: Vec<Expected>,
    /// One line for each thing that is possible and unlikely, which begins with the setting.
    pub warnings: Vec<String>,
}

/// A signal, as it will be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignalDescription {
    /// The setting that names it: `wheels.left`.
    pub setting: String,
    /// Where it is, and what its bits mean.
    pub place: String,
    /// What its value is worth.
    pub meaning: String,
    /// When its frames come.
    pub rhythm: String,
    /// What shows that a frame is new and whole.
    pub proof: String,
}

/// A message without which there is no odometry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expected {
    /// Position of its bus.
    pub bus: u8,
    /// Its identifier.
    pub id: Id,
    /// Its name in the DBC file.
    pub message: String,
    /// How often it should come \[µs\].
    pub period_us: u64,
}

impl Description {
    /// Two wheels in one message are no reason to say something twice.
    pub(super) fn warn(&mut self, warnings: impl IntoIterator<Item = String>) {
        for warning in warnings {
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
    }
}

/// `identifier 0x100 (WheelLeft)`.
impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", identifier(self.id), self.message)
    }
}

/// Where a signal is, and what its bits mean.
pub(super) fn place(place: (&str, Id, u8), signal: &Signal, decoder: &SignalDecoder) -> String {
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
        "{} of {message}, identifier {} on bus {bus}: {} bits from bit {}, {order}, {number}, times {} plus {}, {range}{}",
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
