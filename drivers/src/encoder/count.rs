//! A count of a tick counter, and how far it is from one to another.

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
            let bits = if cfg!(coloc_break = "wrap") {
                u64::BITS
            } else {
                self.bits
            };
            return sign_extend(to.wrapping_sub(from), bits) as f64;
        };
        let modulus = i128::from(modulus);
        let ahead = (self.value(to) - self.value(from)).rem_euclid(modulus);
        if 2 * ahead > modulus {
            (ahead - modulus) as f64
        } else {
            ahead as f64
        }
    }
}
