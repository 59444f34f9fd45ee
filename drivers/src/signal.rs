//! A signal of a DBC file, compiled once, then decoded without allocation.

use can_dbc::{ByteOrder, MultiplexIndicator, NumericValue, SignalExtendedValueType, ValueType};

/// Where a signal lies in a payload and what its bits mean.
///
/// Intel signals (`@1`) count from the least significant bit upwards; Motorola signals (`@0`) start at the most
/// significant bit and run towards bit 0 of a byte, then on from bit 7 of the next.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SignalDecoder {
    first_byte: usize,
    bytes: usize,
    shift: u32,
    size: u32,
    order: Order,
    number: Number,
    factor: f64,
    offset: f64,
    /// The lowest and the highest physical value, if not everything that the bits can say is one.
    range: Option<[f64; 2]>,
}

#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Order {
    Intel,
    Motorola,
}

#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Number {
    Unsigned,
    Signed,
    Float32,
    Float64,
}

/// Why a signal can't be decoded.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SignalError {
    /// Not 1 to 64 bits, or a float that is not 32 or 64 bits.
    #[error("it has {0} bits; possible are 1 to 64, for floats 32 or 64")]
    Size(u64),
    /// Reaches beyond its message.
    #[error("it ends in byte {last_byte} of a message of {message_bytes} bytes")]
    OutsideMessage {
        /// Last byte that it touches, counted from 0.
        last_byte: u64,
        /// Length of the message.
        message_bytes: u64,
    },
    /// Present in some frames only.
    #[error("it is multiplexed, which is not supported")]
    Multiplexed,
    /// Its factor is zero or next to it, or with its offset makes a number of 64 bits infinite.
    #[error(
        "its factor must not be zero or next to it, and factor and offset so small that every number is finite"
    )]
    Scale,
}

/// 2⁶⁴: more than any number of 64 bits.
const WORD: f64 = 18_446_744_073_709_551_616.0;

impl SignalDecoder {
    /// Compiles the description of a signal in a message of `message_bytes` bytes.
    ///
    /// # Errors
    /// [`SignalError`], with what is wrong about the description.
    pub fn compile(
        signal: &can_dbc::Signal,
        message_bytes: u64,
        extended: Option<&SignalExtendedValueType>,
    ) -> Result<Self, SignalError> {
        if !matches!(
            signal.multiplexer_indicator,
            MultiplexIndicator::Plain | MultiplexIndicator::Multiplexor
        ) {
            return Err(SignalError::Multiplexed);
        }
        let most = signal.factor.abs() * WORD + signal.offset.abs();
        if !most.is_finite() || !signal.factor.is_normal() {
            return Err(SignalError::Scale);
        }
        let number = number(signal, extended)?;
        Self::place(signal, message_bytes.min(64), number)
    }

    fn place(
        signal: &can_dbc::Signal,
        message_bytes: u64,
        number: Number,
    ) -> Result<Self, SignalError> {
        let (order, first_bit) = match signal.byte_order {
            ByteOrder::LittleEndian => (Order::Intel, signal.start_bit),
            ByteOrder::BigEndian => (Order::Motorola, signal.start_bit ^ 7),
        };
        let last_byte = first_bit.saturating_add(signal.size - 1) / 8;
        if last_byte >= message_bytes {
            return Err(SignalError::OutsideMessage {
                last_byte,
                message_bytes,
            });
        }
        let (first_byte, skipped, bits) = (first_bit / 8, first_bit % 8, signal.size);
        let bytes = last_byte - first_byte + 1;
        let shift = if order == Order::Intel {
            skipped
        } else {
            bytes * 8 - skipped - bits
        };
        let small = |value: u64| u32::try_from(value).map_err(|_| SignalError::Size(bits));
        Ok(Self {
            first_byte: small(first_byte)? as usize,
            bytes: small(bytes)? as usize,
            shift: small(shift)?,
            size: small(bits)?,
            order,
            number,
            factor: signal.factor,
            offset: signal.offset,
            range: range(signal),
        })
    }

    /// The bits as they are; `None` if the payload is too short.
    #[must_use]
    pub fn raw(&self, data: &[u8]) -> Option<u64> {
        let bytes = data.get(self.first_byte..)?.get(..self.bytes)?;
        let append = |word: u128, byte: &u8| word << 8 | u128::from(*byte);
        let word = match self.order {
            Order::Intel => bytes.iter().rev().fold(0, append),
            Order::Motorola => bytes.iter().fold(0, append),
        };
        let mask = u64::MAX >> (64 - self.size);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "masked to the signal's at most 64 bits"
        )]
        Some((word >> self.shift) as u64 & mask)
    }

    /// The physical value, raw · factor + offset; `None` if the payload is too short.
    ///
    /// Finite unless the signal is a float and its sender wrote otherwise.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "physical values are f64")]
    pub fn physical(&self, data: &[u8]) -> Option<f64> {
        let raw = self.raw(data)?;
        let value = match self.number {
            Number::Unsigned => raw as f64,
            Number::Signed => sign_extend(raw, self.size) as f64,
            Number::Float32 => f64::from(f32::from_bits(u32::try_from(raw).ok()?)),
            Number::Float64 => f64::from_bits(raw),
        };
        Some(value * self.factor + self.offset)
    }

    /// Width \[bits\].
    #[must_use]
    pub fn size(&self) -> u32 {
        self.size
    }

    /// What one step of the raw value is worth.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// The physical value of raw zero.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Whether a physical value lies in the range of the DBC file, to half a step. Codes for "not available" do not.
    ///
    /// Not-a-number does: it is wrong for another reason.
    #[must_use]
    pub fn allows(&self, physical: f64) -> bool {
        let Some([lowest, highest]) = self.range else {
            return true;
        };
        let half_step = if self.is_integer() {
            self.factor.abs() / 2.0
        } else {
            1e-6 * lowest.abs().max(highest.abs())
        };
        !(physical < lowest - half_step || physical > highest + half_step)
    }

    /// The range of the DBC file \[physical\], if it gives one.
    #[must_use]
    pub fn range(&self) -> Option<[f64; 2]> {
        self.range
    }

    /// The lowest and the highest raw value that the range of an integer signal allows, if that is not all of them.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the cast saturates, and is clamped"
    )]
    pub fn raw_range(&self) -> Option<(i128, i128)> {
        let [a, b] = self
            .range?
            .map(|physical| ((physical - self.offset) / self.factor).round() as i128);
        let (lowest, highest) = self.raw_limits();
        let allowed = (
            a.min(b).clamp(lowest, highest),
            a.max(b).clamp(lowest, highest),
        );
        (allowed != (lowest, highest)).then_some(allowed)
    }

    /// Without the raw values that stand for "no value", where these are the last that the bits can say; of two's complement,
    /// the first as well.
    pub(crate) fn without(mut self, codes: &[i128]) -> Self {
        let (first, last) = self.raw_limits();
        let number = 1_i128 << self.size;
        let is_code = |raw: i128| {
            codes.contains(&raw) || (self.is_signed() && codes.contains(&(raw.rem_euclid(number))))
        };
        let most = i128::try_from(codes.len()).unwrap_or(i128::MAX);
        let above = (0..most).take_while(|back| is_code(last - back)).count();
        let below = (0..most)
            .take_while(|on| self.is_signed() && is_code(first + on))
            .count();
        if (above, below) == (0, 0) || !self.is_integer() {
            return self;
        }
        let (lowest, highest) = self.raw_range().unwrap_or((first, last));
        let [above, below] = [above, below].map(|count| i128::try_from(count).unwrap_or(0));
        let ends =
            [lowest.max(first + below), highest.min(last - above)].map(|raw| self.of_raw(raw));
        self.range = Some([ends[0].min(ends[1]), ends[0].max(ends[1])]);
        self
    }

    #[expect(clippy::cast_precision_loss, reason = "physical values are f64")]
    fn of_raw(&self, raw: i128) -> f64 {
        raw as f64 * self.factor + self.offset
    }

    /// What the bits can say.
    fn raw_limits(&self) -> (i128, i128) {
        let number = 1_i128 << self.size;
        if self.number == Number::Signed {
            (-number / 2, number / 2 - 1)
        } else {
            (0, number - 1)
        }
    }

    /// Whether the raw value is two's complement.
    #[must_use]
    pub fn is_signed(&self) -> bool {
        self.number == Number::Signed
    }

    /// Whether the two share a bit of the payload.
    #[must_use]
    pub fn overlaps(&self, other: &Self) -> bool {
        let bits = |signal: &Self| {
            let bytes = signal.bytes.min(9);
            let mask = (u128::from(u64::MAX >> (64 - signal.size))) << signal.shift;
            (0..bytes)
                .map(move |byte| {
                    let place = if signal.order == Order::Intel {
                        byte
                    } else {
                        bytes - 1 - byte
                    };
                    (signal.first_byte + byte, (mask >> (8 * place)) & 0xFF)
                })
                .collect::<Vec<_>>()
        };
        bits(self).iter().any(|&(byte, mask)| {
            bits(other)
                .iter()
                .any(|&(other_byte, other_mask)| byte == other_byte && mask & other_mask != 0)
        })
    }

    /// Whether the raw value is an integer.
    #[must_use]
    pub fn is_integer(&self) -> bool {
        matches!(self.number, Number::Unsigned | Number::Signed)
    }

    /// The last byte of the payload that it has a bit of.
    #[must_use]
    pub fn last_byte(&self) -> usize {
        self.first_byte + self.bytes - 1
    }

    /// The byte that the signal fills, if it fills exactly one.
    #[must_use]
    pub fn whole_byte(&self) -> Option<usize> {
        (self.size == 8 && self.shift == 0 && self.bytes == 1).then_some(self.first_byte)
    }
}

/// Reads the lowest `size` bits as a two's complement number; `size` is 1 to 64.
pub(crate) fn sign_extend(raw: u64, size: u32) -> i64 {
    let unused = 64 - size;
    (raw << unused).cast_signed() >> unused
}

/// `[0|0]`, and what is upside down, mean that nobody said.
fn range(signal: &can_dbc::Signal) -> Option<[f64; 2]> {
    let range @ [lowest, highest] = [value(signal.min), value(signal.max)];
    (lowest < highest).then_some(range)
}

#[expect(clippy::cast_precision_loss, reason = "physical values are f64")]
fn value(number: NumericValue) -> f64 {
    match number {
        NumericValue::Uint(value) => value as f64,
        NumericValue::Int(value) => value as f64,
        NumericValue::Double(value) => value,
    }
}

fn number(
    signal: &can_dbc::Signal,
    extended: Option<&SignalExtendedValueType>,
) -> Result<Number, SignalError> {
    match (extended, signal.size, signal.value_type) {
        (Some(SignalExtendedValueType::IEEEfloat32Bit), 32, _) => Ok(Number::Float32),
        (Some(SignalExtendedValueType::IEEEdouble64bit), 64, _) => Ok(Number::Float64),
        (
            None | Some(SignalExtendedValueType::SignedOrUnsignedInteger),
            1..=64,
            ValueType::Signed,
        ) => Ok(Number::Signed),
        (
            None | Some(SignalExtendedValueType::SignedOrUnsignedInteger),
            1..=64,
            ValueType::Unsigned,
        ) => Ok(Number::Unsigned),
        (_, size, _) => Err(SignalError::Size(size)),
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these results are exact")]
mod tests {
    use super::*;
    use can_dbc::Dbc;
    use proptest::prelude::*;

    fn compile(signal: &str) -> Result<SignalDecoder, SignalError> {
        compile_within(signal, "[0|0]")
    }

    fn compile_within(signal: &str, range: &str) -> Result<SignalDecoder, SignalError> {
        let text = format!(
            "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\nBO_ 1 M: 8 A\n SG_ {signal} {range} \"\" A\n"
        );
        let dbc = Dbc::try_from(text.as_str()).unwrap();
        let message = &dbc.messages[0];
        SignalDecoder::compile(&message.signals[0], message.size, None)
    }

    fn decode(signal: &str, data: [u8; 8]) -> f64 {
        compile(signal).unwrap().physical(&data).unwrap()
    }

    const COUNTING: [u8; 8] = [0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF];

    #[test]
    fn a_range_is_of_physical_values() {
        let raw_range = |signal, range| compile_within(signal, range).unwrap().raw_range();
        assert_eq!(raw_range("S : 0|8@1+ (2,10)", "[10|100]"), Some((0, 45)));
        assert_eq!(raw_range("S : 0|8@1- (-1,5)", "[0|10]"), Some((-5, 5)));
        assert_eq!(raw_range("S : 0|8@1+ (2,10)", "[10|520]"), None);
    }

    #[test]
    fn both_byte_orders() {
        assert_eq!(decode("S : 0|16@1+ (1,0)", COUNTING), f64::from(0x2301));
        assert_eq!(decode("S : 7|16@0+ (1,0)", COUNTING), f64::from(0x0123));
        assert_eq!(decode("S : 4|8@1+ (1,0)", COUNTING), f64::from(0x30));
        assert_eq!(decode("S : 3|8@0+ (1,0)", COUNTING), f64::from(0x12));
        assert_eq!(
            compile("S : 0|64@1+ (1,0)").unwrap().raw(&COUNTING),
            Some(u64::from_le_bytes(COUNTING))
        );
        assert_eq!(
            compile("S : 7|64@0+ (1,0)").unwrap().raw(&COUNTING),
            Some(u64::from_be_bytes(COUNTING))
        );
    }

    #[test]
    fn sign_factor_and_offset() {
        assert_eq!(
            decode("S : 0|8@1- (0.5,1)", [0xFF, 0, 0, 0, 0, 0, 0, 0]),
            0.5
        );
        assert_eq!(
            decode("S : 6|15@0+ (0.01,-67.67)", [0x1A, 0x6F, 0, 0, 0, 0, 0, 0]),
            6767.0 * 0.01 - 67.67
        );
    }

    #[test]
    fn a_payload_that_ends_too_early_has_no_value() {
        let decoder = compile("S : 8|16@1+ (1,0)").unwrap();
        assert_eq!(decoder.raw(&[0; 2]), None);
        assert_eq!(decoder.raw(&[0; 3]), Some(0));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert_eq!(
            compile("S : 60|8@1+ (1,0)"),
            Err(SignalError::OutsideMessage {
                last_byte: 8,
                message_bytes: 8
            })
        );
        assert_eq!(compile("S : 0|0@1+ (1,0)"), Err(SignalError::Size(0)));
        assert_eq!(compile("S : 0|8@1+ (0,0)"), Err(SignalError::Scale));
        assert_eq!(compile("S : 0|8@1+ (1e-320,0)"), Err(SignalError::Scale));
        assert_eq!(compile("S : 0|8@1+ (1e308,0)"), Err(SignalError::Scale));
        assert_eq!(
            compile("S m1 : 0|8@1+ (1,0)"),
            Err(SignalError::Multiplexed)
        );
    }

    proptest! {
        #[test]
        fn any_signal_reads_its_bits_one_by_one(
            start in 0_u64..64, size in 1_u64..=64, intel: bool, data in any::<[u8; 8]>(), signed: bool,
        ) {
            let text = format!("S : {start}|{size}@{}{} (1,0)", u8::from(intel), if signed { '-' } else { '+' });
            let Ok(decoder) = compile(&text) else { return Ok(()) };
            let bit = |index: u64| u64::from(data[(index / 8) as usize] >> (index % 8) & 1);
            let expected = if intel {
                (0..size).fold(0, |value, i| value | bit(start + i) << i)
            } else {
                (0..size).fold(0, |value, i| value << 1 | bit(((start ^ 7) + i) ^ 7))
            };
            prop_assert_eq!(decoder.raw(&data), Some(expected));
            prop_assert!(decoder.physical(&data).unwrap().is_finite());
        }
    }
}
