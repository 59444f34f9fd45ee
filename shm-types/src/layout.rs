//! The layout of a payload, written as a table and held to by the compiler.

/// Asserts size and offset of every field of a `#[repr(C)]` type, and that no byte of it is padding.
///
/// `layout!(Type, size; field: offset, …)` takes the fields in order. Padding is uninitialised memory: it must not
/// travel to another process. The same table says how the type is written to a network ([`Plain`](crate::Plain)).
macro_rules! layout {
    ($type:ty, $size:literal; $($field:ident: $offset:literal),+ $(,)?) => {
        const _: () = {
            assert!(size_of::<$type>() == $size);
            assert!(align_of::<$type>() == 8);
            $(assert!(core::mem::offset_of!($type, $field) == $offset);)+
            let fields = 0 $(+ crate::layout::size_of_field::<$type, _>(|it| &it.$field))+;
            assert!(fields == $size, "implicit padding");
        };

        impl crate::Plain for $type {
            const BYTES: usize = $size;

            fn put<'a>(&self, to: &'a mut [u8]) -> Option<&'a mut [u8]> {
                $(let to = self.$field.put(to)?;)+
                Some(to)
            }

            fn take(from: &[u8]) -> Option<(Self, &[u8])> {
                $(let ($field, from) = crate::Plain::take(from)?;)+
                Some((Self { $($field),+ }, from))
            }
        }
    };
}

pub(crate) use layout;

/// Size of the field that a projection names, without a value of the type.
pub(crate) const fn size_of_field<T, F>(_: fn(&T) -> &F) -> usize {
    size_of::<F>()
}
