//! Which identifiers are on a bus, and how often.

use std::fmt;

use ::socketcan::Id;

use super::frame::{Frame, Kind};

/// What was heard.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// Data and remote frames.
    pub frames: u64,
    /// The first identifiers that were heard, and how often each.
    pub ids: [Option<(Id, u64)>; IDS],
    /// Frames of further identifiers.
    pub others: u64,
    /// Error frames.
    pub errors: u64,
}

/// So many identifiers are told apart: more do not fit into a line that is to be read.
const IDS: usize = 8;

impl Heard {
    /// One more frame.
    pub fn note(&mut self, frame: &Frame) {
        let Some(id) = frame.id().filter(|_| frame.kind() != Kind::Error) else {
            self.errors += 1;
            return;
        };
        self.frames += 1;
        let is_own = |slot: &&mut Option<(Id, u64)>| slot.is_none_or(|(known, _)| known == id);
        match self.ids.iter_mut().find(is_own) {
            Some(slot) => *slot = Some((id, slot.map_or(0, |(_, count)| count) + 1)),
            None => self.others += 1,
        }
    }

    /// How often frames with this identifier were heard, as far as it is told apart.
    #[must_use]
    pub fn of(&self, id: Id) -> u64 {
        let known = self.ids.iter().flatten().find(|(known, _)| *known == id);
        known.map_or(0, |(_, count)| *count)
    }
}

/// `0x100 × 10, 0x18FEF10B (extended) × 3 and 5 frames of others`.
impl fmt::Display for Heard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = |(id, count): &(Id, u64)| format!("{} × {count}", identifier(*id));
        let known: Vec<_> = self.ids.iter().flatten().map(one).collect();
        match (known.as_slice(), self.others) {
            ([], _) => write!(f, "no frame"),
            (known, 0) => write!(f, "{}", known.join(", ")),
            (known, others) => write!(f, "{} and {others} frames of others", known.join(", ")),
        }
    }
}

/// An identifier as people write it.
#[must_use]
pub fn identifier(id: Id) -> String {
    match id {
        Id::Standard(id) => format!("0x{:03X}", id.as_raw()),
        Id::Extended(id) => format!("0x{:08X} (extended)", id.as_raw()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::StandardId;
    use super::*;

    fn frame(id: u16) -> Frame {
        Frame::data_frame(StandardId::new(id).unwrap(), &[]).unwrap()
    }

    fn id(raw: u16) -> Id {
        StandardId::new(raw).unwrap().into()
    }

    #[test]
    fn identifiers_are_counted_and_the_ninth_is_one_of_the_others() {
        let mut heard = Heard::default();
        for raw in (0..9).chain(3..5) {
            heard.note(&frame(raw));
        }
        heard.note(&Frame::error_frame(1, [0; 8]));
        assert_eq!((heard.frames, heard.others, heard.errors), (11, 1, 1));
        assert_eq!([0, 3, 4, 8].map(|raw| heard.of(id(raw))), [1, 2, 2, 0]);
        assert_eq!(
            heard.to_string(),
            "0x000 × 1, 0x001 × 1, 0x002 × 1, 0x003 × 2, 0x004 × 2, 0x005 × 1, 0x006 × 1, 0x007 × 1 and 1 frames of others"
        );
        assert_eq!(Heard::default().to_string(), "no frame");
    }
}
