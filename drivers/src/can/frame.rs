//! A CAN frame: the kernel's bytes, checked once, then a decoded value.

use socketcan::id::{
    CAN_EFF_FLAG, CAN_EFF_MASK, CAN_ERR_FLAG, CAN_ERR_MASK, CAN_RTR_FLAG, CAN_SFF_MASK,
};
use socketcan::{ExtendedId, Id, StandardId};

use super::error_frame::ErrorFrame;

/// Bytes of a raw classic frame, `sizeof(struct can_frame)`.
pub const CLASSIC_SIZE: usize = libc::CAN_MTU;
/// Bytes of a raw FD frame, `sizeof(struct canfd_frame)`.
pub const FD_SIZE: usize = libc::CANFD_MTU;

const LEN: usize = 4;
const FLAGS: usize = 5;
const DATA: usize = 8;

/// What a frame is.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Classic data frame, up to 8 bytes.
    Data,
    /// CAN FD data frame, up to 64 bytes.
    Fd,
    /// A request for data; carries none, its length is that of the answer.
    Remote,
    /// What the controller has to say about the bus; no node sent it.
    Error,
}

/// One frame, of any [`Kind`].
///
/// On a socket it has the bytes of the kernel's `struct can_frame` (16 bytes) or `struct canfd_frame` (72 bytes);
/// the size tells the two apart.
///
/// | bytes | field | content |
/// | --- | --- | --- |
/// | 0–3 | `can_id` | host byte order. Bits 0–28 identifier, or the error classes; bit 29 error frame, bit 30 remote frame, bit 31 extended (29-bit) identifier |
/// | 4 | `len` | bytes of data: 0–8, FD 0–64 |
/// | 5 | `flags` | FD: bit 0 bit-rate switch, bit 1 error state of the sender, bit 2 FD frame. Classic: padding |
/// | 6–7 | | reserved; `len8_dlc` in byte 7 of a classic frame is not used |
/// | 8–15 / 8–71 | `data` | payload, zero beyond `len` |
#[derive(Copy, Clone, PartialEq, Eq)]
pub struct Frame {
    can_id: u32,
    kind: Kind,
    flags: u8,
    len: u8,
    data: [u8; 64],
}

/// Why bytes are not a frame.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// The size is neither that of a classic frame nor that of an FD frame.
    #[error("{0} bytes are neither a classic CAN frame (16) nor an FD frame (72)")]
    Size(usize),
    /// The length field points beyond the data.
    #[error("the length field says {0} bytes, more than this kind of frame holds")]
    Length(u8),
}

impl Frame {
    /// A classic data frame; `None` if `data` is longer than 8 bytes.
    #[must_use]
    pub fn data_frame(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        Self::filled(raw_id(id.into()), Kind::Data, 0, data, 8)
    }

    /// A classic data frame whose payload is known to fit.
    pub(crate) fn classic<const LEN: usize>(id: Id, payload: [u8; LEN]) -> Self {
        const { assert!(LEN <= 8) };
        let mut data = [0; 64];
        data[..LEN].copy_from_slice(&payload);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "at most 8, by the assertion"
        )]
        let len = LEN as u8;
        Self {
            can_id: raw_id(id),
            kind: Kind::Data,
            flags: 0,
            len,
            data,
        }
    }

    /// A CAN FD data frame; `None` if `data` is longer than 64 bytes.
    #[must_use]
    pub fn fd_frame(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        Self::filled(raw_id(id.into()), Kind::Fd, FD_FLAG, data, 64)
    }

    /// A remote frame asking for `len` bytes; `None` if that is more than 8.
    #[must_use]
    pub fn remote_frame(id: impl Into<Id>, len: u8) -> Option<Self> {
        let can_id = raw_id(id.into()) | CAN_RTR_FLAG;
        (len <= 8).then_some(Self {
            can_id,
            kind: Kind::Remote,
            flags: 0,
            len,
            data: [0; 64],
        })
    }

    /// An error frame with the given class bits, as a controller's driver makes it.
    #[must_use]
    pub fn error_frame(classes: u32, details: [u8; 8]) -> Self {
        let can_id = CAN_ERR_FLAG | (classes & CAN_ERR_MASK);
        let mut data = [0; 64];
        data[..8].copy_from_slice(&details);
        Self {
            can_id,
            kind: Kind::Error,
            flags: 0,
            len: 8,
            data,
        }
    }

    /// Checks and decodes the kernel's bytes.
    ///
    /// # Errors
    /// [`FrameError`] if size or length are not those of a frame.
    #[inline]
    pub fn from_raw(raw: &[u8]) -> Result<Self, FrameError> {
        let capacity = match raw.len() {
            CLASSIC_SIZE => 8,
            FD_SIZE => 64,
            other => return Err(FrameError::Size(other)),
        };
        Self::from_checked(raw, capacity).ok_or(FrameError::Length(raw[LEN]))
    }

    fn from_checked(raw: &[u8], capacity: usize) -> Option<Self> {
        let can_id = u32::from_ne_bytes(raw.first_chunk().copied()?);
        let data = raw.get(DATA..)?.get(..usize::from(raw[LEN]))?;
        let kind = kind_of(can_id, capacity == 64);
        let flags = if kind == Kind::Fd { raw[FLAGS] } else { 0 };
        let mut frame = Self::filled(can_id, kind, flags, data, capacity)?;
        if kind == Kind::Remote {
            frame.data = [0; 64];
        }
        Some(frame)
    }

    fn filled(can_id: u32, kind: Kind, flags: u8, bytes: &[u8], capacity: usize) -> Option<Self> {
        let len = u8::try_from(bytes.len())
            .ok()
            .filter(|&len| usize::from(len) <= capacity)?;
        let mut data = [0; 64];
        data.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(Self {
            can_id,
            kind,
            flags,
            len,
            data,
        })
    }

    /// The kernel's bytes for this frame: the first [`Self::raw_size`] of the array.
    #[must_use]
    pub fn to_raw(&self) -> [u8; FD_SIZE] {
        let mut raw = [0; FD_SIZE];
        raw[..LEN].copy_from_slice(&self.can_id.to_ne_bytes());
        raw[LEN] = self.len;
        raw[FLAGS] = self.flags;
        raw[DATA..].copy_from_slice(&self.data);
        raw
    }

    /// How many bytes the kernel uses for a frame of this kind.
    #[must_use]
    pub fn raw_size(&self) -> usize {
        if self.kind == Kind::Fd {
            FD_SIZE
        } else {
            CLASSIC_SIZE
        }
    }

    /// What this frame is.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Identifier of a data or remote frame; `None` for an error frame.
    #[must_use]
    pub fn id(&self) -> Option<Id> {
        (self.kind != Kind::Error).then(|| typed_id(self.can_id))?
    }

    /// What an error frame says; `None` for any other kind.
    #[must_use]
    pub fn error(&self) -> Option<ErrorFrame> {
        (self.kind == Kind::Error)
            .then(|| ErrorFrame::decode(self.can_id & CAN_ERR_MASK, &self.data))
    }

    /// The payload: empty for a remote frame.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        let len = if self.kind == Kind::Remote {
            0
        } else {
            self.len
        };
        self.data.get(..usize::from(len)).unwrap_or_default()
    }

    /// The length field: bytes of payload, or, in a remote frame, those asked for.
    #[must_use]
    pub fn len_field(&self) -> u8 {
        self.len
    }
}

impl std::fmt::Debug for Frame {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:?} {:03X} [{}] {:02X?}",
            self.kind,
            self.can_id & CAN_ERR_MASK,
            self.len,
            self.data()
        )
    }
}

/// `CANFD_FDF`: marks an FD frame also where size alone would not tell.
const FD_FLAG: u8 = 0x04;

fn kind_of(can_id: u32, fd: bool) -> Kind {
    match (can_id & CAN_ERR_FLAG != 0, can_id & CAN_RTR_FLAG != 0) {
        _ if fd => Kind::Fd,
        (true, _) => Kind::Error,
        (_, true) => Kind::Remote,
        _ => Kind::Data,
    }
}

fn typed_id(can_id: u32) -> Option<Id> {
    if can_id & CAN_EFF_FLAG != 0 {
        return ExtendedId::new(can_id & CAN_EFF_MASK).map(Id::Extended);
    }
    u16::try_from(can_id & CAN_SFF_MASK)
        .ok()
        .and_then(StandardId::new)
        .map(Id::Standard)
}

/// The identifier as the kernel writes it, with the flag of extended ones.
#[must_use]
pub fn raw_id(id: Id) -> u32 {
    match id {
        Id::Standard(id) => u32::from(id.as_raw()),
        Id::Extended(id) => id.as_raw() | CAN_EFF_FLAG,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn standard(id: u16) -> StandardId {
        StandardId::new(id).unwrap()
    }

    #[test]
    fn the_layout_is_the_kernels() {
        let frame = Frame::data_frame(standard(0x123), &[0xDE, 0xAD]).unwrap();
        let raw = frame.to_raw();
        let mut kernel = libc::can_frame::default();
        (kernel.can_id, kernel.can_dlc) = (0x123, 2);
        kernel.data[..2].copy_from_slice(&[0xDE, 0xAD]);
        assert_eq!(raw[..4], kernel.can_id.to_ne_bytes());
        assert_eq!(raw[4], kernel.can_dlc);
        assert_eq!(raw[8..16], kernel.data);
        assert_eq!(core::mem::offset_of!(libc::can_frame, data), DATA);
        assert_eq!(core::mem::offset_of!(libc::canfd_frame, flags), FLAGS);
        assert_eq!(frame.raw_size(), size_of::<libc::can_frame>());
    }

    #[test]
    fn every_kind_comes_back_from_its_bytes() {
        let extended = ExtendedId::new(0x1ABC_DEF0).unwrap();
        let frames = [
            Frame::data_frame(standard(0x7FF), &[1, 2, 3]).unwrap(),
            Frame::data_frame(extended, &[9; 8]).unwrap(),
            Frame::fd_frame(extended, &[7; 64]).unwrap(),
            Frame::remote_frame(standard(1), 4).unwrap(),
            Frame::error_frame(0x40, [1, 2, 3, 4, 5, 6, 7, 8]),
        ];
        for frame in frames {
            assert_eq!(
                Frame::from_raw(&frame.to_raw()[..frame.raw_size()]),
                Ok(frame)
            );
        }
        assert_eq!(frames[1].id(), Some(Id::Extended(extended)));
        assert_eq!((frames[3].data(), frames[3].len_field()), (&[][..], 4));
        assert_eq!(frames[4].id(), None);
    }

    #[test]
    fn too_much_data_is_no_frame() {
        assert_eq!(Frame::data_frame(standard(1), &[0; 9]), None);
        assert_eq!(Frame::fd_frame(standard(1), &[0; 65]), None);
        assert_eq!(Frame::remote_frame(standard(1), 9), None);
        let mut raw = [0; CLASSIC_SIZE];
        raw[LEN] = 9;
        assert_eq!(Frame::from_raw(&raw), Err(FrameError::Length(9)));
        assert_eq!(Frame::from_raw(&raw[..15]), Err(FrameError::Size(15)));
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_frame_or_an_error(raw in proptest::collection::vec(any::<u8>(), 0..100)) {
            if let Ok(frame) = Frame::from_raw(&raw) {
                prop_assert!(frame.data().len() <= 64);
                prop_assert_eq!(Frame::from_raw(&frame.to_raw()[..frame.raw_size()]), Ok(frame));
                prop_assert_eq!(frame.error().is_some(), frame.kind() == Kind::Error);
            }
        }

        #[test]
        fn any_bytes_of_the_right_size_with_a_legal_length_decode(
            mut raw in proptest::collection::vec(any::<u8>(), FD_SIZE), fd: bool, len in 0_u8..=8,
        ) {
            raw.truncate(if fd { FD_SIZE } else { CLASSIC_SIZE });
            raw[LEN] = len;
            let frame = Frame::from_raw(&raw).unwrap();
            prop_assert_eq!(frame.len_field(), len);
            let _ = (frame.id(), format!("{frame:?}"));
        }
    }
}
