//! What leaders knew of an event, in 32 bits: who knew something else comes to something else.

/// FNV-1a of 64 bits, folded.
#[derive(Copy, Clone, Debug)]
pub(super) struct Digest(u64);

impl Digest {
    pub(super) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub(super) fn add(&mut self, number: u64) {
        for byte in number.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Never 0, which says that there is none.
    #[allow(clippy::cast_possible_truncation)] // It is folded.
    pub(super) fn end(self) -> u32 {
        ((self.0 ^ self.0 >> 32) as u32).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_fnv_1a_and_the_order_matters() {
        let of = |numbers: [u64; 2]| {
            let mut digest = Digest::new();
            for number in numbers {
                digest.add(number);
            }
            digest.end()
        };
        assert_ne!(of([1, 2]), of([2, 1]));
        // "foobar" and two bytes of zero, by the authors' test vectors continued.
        let mut digest = Digest(0x8594_4171_f739_67e8);
        assert_eq!(digest.end(), 0x8594_4171 ^ 0xf739_67e8);
        digest.add(0);
        assert_ne!(digest.end(), 0);
    }
}
