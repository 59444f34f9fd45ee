//! Payloads as bytes for a network: field by field, little-endian, without a look at the memory that they lie in.

/// A value that is as many bytes everywhere: its fields in the order of its layout, each little-endian.
///
/// On a little-endian computer these are the bytes that lie in shared memory, because no payload has padding. Nothing is assumed
/// of them: every bit pattern of every field is a value, and whether it makes sense is asked of `validate` afterwards.
pub trait Plain: Sized {
    /// How many bytes.
    const BYTES: usize;

    /// Writes it to the first [`Self::BYTES`] of `to`, and gives back what is behind them; `None` if there are fewer.
    #[must_use]
    fn put<'a>(&self, to: &'a mut [u8]) -> Option<&'a mut [u8]>;

    /// The value of the first [`Self::BYTES`] of `from`, and what is behind them; `None` if there are fewer.
    #[must_use]
    fn take(from: &[u8]) -> Option<(Self, &[u8])>;

    /// The value of exactly these bytes.
    #[must_use]
    fn from_plain(bytes: &[u8]) -> Option<Self> {
        Self::take(bytes).and_then(|(value, behind)| behind.is_empty().then_some(value))
    }
}

macro_rules! number {
    ($($type:ty)*) => {
        $(impl Plain for $type {
            const BYTES: usize = size_of::<$type>();

            #[inline]
            fn put<'a>(&self, to: &'a mut [u8]) -> Option<&'a mut [u8]> {
                let (own, behind) = to.split_first_chunk_mut()?;
                *own = self.to_le_bytes();
                Some(behind)
            }

            #[inline]
            fn take(from: &[u8]) -> Option<(Self, &[u8])> {
                let (own, behind) = from.split_first_chunk()?;
                Some((Self::from_le_bytes(*own), behind))
            }
        })*
    };
}

number!(u8 u16 u32 u64 i8 i16 i32 i64 f32 f64);

impl<T: Plain + Copy + Default, const N: usize> Plain for [T; N] {
    const BYTES: usize = N * T::BYTES;

    fn put<'a>(&self, to: &'a mut [u8]) -> Option<&'a mut [u8]> {
        self.iter().try_fold(to, |to, each| each.put(to))
    }

    fn take(mut from: &[u8]) -> Option<(Self, &[u8])> {
        let mut all = [T::default(); N];
        for each in &mut all {
            (*each, from) = T::take(from)?;
        }
        Some((all, from))
    }
}
