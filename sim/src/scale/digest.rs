//! A run in sixteen digits.

use coloc_estimator::Belief;

/// Fowler, Noll and Vo's hash (1a, 64 bit) over numbers, bit by bit.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) struct Digest(u64);

impl Digest {
    pub(super) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub(super) fn whole(&mut self, number: u64) {
        for byte in number.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    pub(super) fn real(&mut self, number: f64) {
        self.whole(number.to_bits());
    }

    pub(super) fn belief(&mut self, belief: &Belief) {
        let pose = [belief.pose.x, belief.pose.y, belief.pose.phi];
        let covariance = belief.total().to_row_major();
        pose.into_iter()
            .chain(covariance)
            .for_each(|it| self.real(it));
    }

    pub(super) fn value(self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_makes_another_digest() {
        let of = |number: f64| {
            let mut digest = Digest::new();
            digest.real(number);
            digest.value()
        };
        assert_eq!(of(1.0), of(1.0));
        assert_ne!(of(1.0), of(1.0 + f64::EPSILON));
        assert_ne!(of(0.0), of(-0.0));
    }
}
