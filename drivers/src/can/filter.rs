//! Which frames are wanted: told to the kernel, so that the rest never wakes anybody.

use socketcan::Id;
use socketcan::id::{CAN_EFF_FLAG, CAN_EFF_MASK, CAN_RTR_FLAG, CAN_SFF_MASK};

use super::frame::{Frame, Kind, raw_id};

/// The frames that a reader wants. Error frames always pass.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Everything.
    #[default]
    All,
    /// Data frames with these identifiers.
    Ids(Vec<Id>),
}

impl Filter {
    /// Data frames with these identifiers, each listed once.
    pub fn ids(ids: impl IntoIterator<Item = Id>) -> Self {
        let mut ids: Vec<Id> = ids.into_iter().collect();
        ids.sort_unstable_by_key(|&id| raw_id(id));
        ids.dedup();
        Self::Ids(ids)
    }

    /// Whether `frame` is wanted.
    #[must_use]
    pub fn accepts(&self, frame: &Frame) -> bool {
        match (self, frame.kind(), frame.id()) {
            (Self::All, ..) | (_, Kind::Error, _) => true,
            (Self::Ids(ids), Kind::Data | Kind::Fd, Some(id)) => ids.contains(&id),
            _ => false,
        }
    }

    /// For `CAN_RAW_FILTER`. An empty list there means: no data frame at all.
    pub(super) fn kernel_filters(&self) -> Vec<libc::can_filter> {
        match self {
            Self::All => vec![libc::can_filter {
                can_id: 0,
                can_mask: 0,
            }],
            Self::Ids(ids) => ids.iter().map(|&id| kernel_filter(id)).collect(),
        }
    }

    /// The same for a socket that carries raw frames but knows nothing of CAN: classic BPF over the first word.
    pub(super) fn bpf_program(&self) -> Option<Vec<libc::sock_filter>> {
        let Self::Ids(ids) = self else { return None };
        let mut program = vec![load_word(0)];
        for &id in ids {
            program.extend([skip_unless_equal(big_endian(raw_id(id))), accept()]);
        }
        program.extend([
            skip_unless_any(big_endian(libc::CAN_ERR_FLAG)),
            accept(),
            reject(),
        ]);
        Some(program)
    }
}

fn kernel_filter(id: Id) -> libc::can_filter {
    let bits = if matches!(id, Id::Extended(_)) {
        CAN_EFF_MASK
    } else {
        CAN_SFF_MASK
    };
    libc::can_filter {
        can_id: raw_id(id),
        can_mask: bits | CAN_EFF_FLAG | CAN_RTR_FLAG,
    }
}

/// BPF loads words in network order; frames hold the identifier in the host's.
fn big_endian(word: u32) -> u32 {
    u32::from_be_bytes(word.to_ne_bytes())
}

fn load_word(offset: u32) -> libc::sock_filter {
    instruction(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, offset, 0)
}

fn skip_unless_equal(word: u32) -> libc::sock_filter {
    instruction(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, word, 1)
}

fn skip_unless_any(bits: u32) -> libc::sock_filter {
    instruction(libc::BPF_JMP | libc::BPF_JSET | libc::BPF_K, bits, 1)
}

fn accept() -> libc::sock_filter {
    instruction(libc::BPF_RET | libc::BPF_K, u32::MAX, 0)
}

fn reject() -> libc::sock_filter {
    instruction(libc::BPF_RET | libc::BPF_K, 0, 0)
}

fn instruction(code: u32, k: u32, jump_if_false: u8) -> libc::sock_filter {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "operation codes are 16 bits, their constants are not"
    )]
    let code = code as u16;
    libc::sock_filter {
        code,
        jt: 0,
        jf: jump_if_false,
        k,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use socketcan::{ExtendedId, StandardId};

    fn standard(id: u16) -> Id {
        StandardId::new(id).unwrap().into()
    }

    #[test]
    fn a_standard_and_an_extended_identifier_of_equal_value_differ() {
        let extended: Id = ExtendedId::new(0x100).unwrap().into();
        let filter = Filter::ids([standard(0x100), standard(0x100)]);
        assert_eq!(filter, Filter::Ids(vec![standard(0x100)]));
        assert!(filter.accepts(&Frame::data_frame(standard(0x100), &[]).unwrap()));
        assert!(filter.accepts(&Frame::fd_frame(standard(0x100), &[]).unwrap()));
        assert!(!filter.accepts(&Frame::data_frame(extended, &[]).unwrap()));
        assert!(!filter.accepts(&Frame::remote_frame(standard(0x100), 8).unwrap()));
        assert!(filter.accepts(&Frame::error_frame(1, [0; 8])));
    }

    #[test]
    fn the_kernels_mask_tells_extended_and_remote_frames_apart() {
        let filter = Filter::ids([standard(0x100)]).kernel_filters()[0];
        let passes = |can_id: u32| can_id & filter.can_mask == filter.can_id & filter.can_mask;
        assert!(passes(0x100));
        assert!(!passes(0x101) && !passes(0x100 | CAN_EFF_FLAG) && !passes(0x100 | CAN_RTR_FLAG));
    }
}
