//! Arbitrary bytes, read as values. Where they end, all is zero.

/// What is left of them.
#[derive(Copy, Clone, Debug)]
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

/// What arithmetic stumbles over.
const SPECIAL: [f64; 16] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    5e-324,
    -0.0,
    1e60,
    -1e60,
    1e-60,
    1e154,
    1e30,
    std::f64::consts::PI,
    -std::f64::consts::PI,
    1e-8,
];

impl Bytes<'_> {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut array = [0; N];
        let (taken, rest) = self.0.split_at(N.min(self.0.len()));
        array[..taken.len()].copy_from_slice(taken);
        self.0 = rest;
        array
    }

    pub(super) fn byte(&mut self) -> u8 {
        self.array::<1>()[0]
    }

    pub(super) fn short(&mut self) -> i16 {
        i16::from_le_bytes(self.array())
    }

    pub(super) fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    pub(super) fn long(&mut self) -> i64 {
        i64::from_le_bytes(self.array())
    }

    /// Near the small ones, the usual ones, anything, or one of a kind.
    pub(super) fn number(&mut self) -> f64 {
        let kind = self.byte();
        match kind % 8 {
            0..5 => f64::from(self.short()) / 1024.0,
            5 => 10_f64.powi(i32::from(self.byte().cast_signed())),
            6 => f64::from_bits(self.long().cast_unsigned()),
            _ => SPECIAL[usize::from(kind / 8) % SPECIAL.len()],
        }
    }

    pub(super) fn numbers<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.number())
    }

    /// Mostly one that can be, A Aᵀ; row-major, `N` = n².
    pub(super) fn covariance<const N: usize>(&mut self) -> [f64; N] {
        let n = N.isqrt();
        if self.byte().is_multiple_of(8) {
            return self.numbers();
        }
        let a: [f64; N] = self.numbers();
        let dot = |i, j| (0..n).map(|k: usize| a[i * n + k] * a[j * n + k]).sum();
        std::array::from_fn(|place| dot(place / n, place % n))
    }
}
