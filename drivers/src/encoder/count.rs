//! A count of a tick counter, and how far it is from one to another.

use crate::is_broken;
use crate::signal::sign_extend;

/// A count and its stamp.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) struct Count {
    pub(super) raw: u64,
    pub(super) stamp_ns: i64,
}

/// Which counts a counter has.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) struct Counts {
    /// Width \[bits\].
    pub(super) bits: u32,
    /// The counts below zero are there too, as two's complement.
    pub(super) signed: bool,
    /// How many different ones there are, if that is not all that the bits can say.
    pub(super) modulus: Option<u64>,
    /// The lowest and the highest that is a count, if not all are.
    pub(super) range: Option<(i128, i128)>,
}

impl Counts {
    /// All that the bits can say.
    #[cfg(test)]
    pub(super) fn all(bits: u32) -> Self {
        Self {
            bits,
            signed: false,
            modulus: None,
            range: None,
        }
    }

    /// How many there are.
    #[expect(clippy::cast_precision_loss, reason = "to compare distances with")]
    pub(super) fn number(self) -> f64 {
        self.modulus
            .map_or_else(|| f64::from(self.bits).exp2(), |modulus| modulus as f64)
    }

    fn value(self, raw: u64) -> i128 {
        if self.signed {
            i128::from(sign_extend(raw, self.bits))
        } else {
            i128::from(raw)
        }
    }

    pub(super) fn contains(self, raw: u64) -> bool {
        self.range
            .is_none_or(|(lowest, highest)| (lowest..=highest).contains(&self.value(raw)))
    }

    /// Signed number of counts between two, the shorter way round.
    #[expect(
        clippy::cast_precision_loss,
        reason = "distances beyond 2^53 ticks are implausible anyway"
    )]
    pub(super) fn between(self, from: u64, to: u64) -> f64 {
        let Some(modulus) = self.modulus else {
            let bits = if is_broken("wrap") {
                u64::BITS
            } else {
                self.bits
            };
            return sign_extend(to.wrapping_sub(from), bits) as f64;
        };
        let ahead = self.ahead(from, to, modulus);
        if ahead > modulus / 2 {
            -((modulus - ahead) as f64)
        } else {
            ahead as f64
        }
    }

    /// How far it is from one to another upwards: below `modulus`.
    fn ahead(self, from: u64, to: u64, modulus: u64) -> u64 {
        let way = self.value(to) - self.value(from);
        let once = if way < 0 {
            way + i128::from(modulus)
        } else {
            way
        };
        match u64::try_from(once) {
            Ok(ahead) if ahead < modulus => ahead,
            // Counts that lie outside of the modulus; division of 128 bits takes some hundred instructions.
            _ => u64::try_from(way.rem_euclid(i128::from(modulus))).unwrap_or(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// As the remainder of a division says, also of counts outside of the modulus, of which a signed counter has some.
        #[test]
        fn it_is_the_shorter_way_round(
            from in any::<i16>(), to in any::<i16>(), modulus in 2_u32..70_000, signed in any::<bool>(),
        ) {
            let counts = Counts { signed, modulus: Some(modulus.into()), ..Counts::all(16) };
            let raw = |value: i16| u64::from(value.cast_unsigned());
            let value = |it: i16| if signed { i32::from(it) } else { i32::from(it.cast_unsigned()) };
            let modulus = modulus.cast_signed();
            let ahead = (value(to) - value(from)).rem_euclid(modulus);
            let shorter = if 2 * ahead > modulus { ahead - modulus } else { ahead };
            prop_assert_eq!(counts.between(raw(from), raw(to)).to_bits(), f64::from(shorter).to_bits());
        }
    }
}
