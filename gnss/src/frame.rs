//! Cuts a stream into NMEA lines and UBX frames, whatever lies between them.
//!
//! A line ends where its line does, and also where another one begins in the middle of it or a byte comes that no line has: its checksum
//! says whether it was whole.

/// Longest line that is believed to be one. The standard says 82; real receivers need 102.
const LONGEST_LINE: usize = 256;
/// Longest payload of a UBX frame that is waited for.
const LONGEST_PAYLOAD: usize = 2048;
/// So much is looked at in one go.
const PIECE: usize = 4096;

const SYNC: [u8; 2] = [0xb5, 0x62];
const HEADER: usize = 6;
const CHECKSUM: usize = 2;

/// Something that looks whole.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Frame<'a> {
    /// From `$` or `!` to the end of its line, without that. Not checked yet.
    Line(&'a [u8]),
    /// A UBX message whose checksum is right.
    Ubx {
        /// Its class.
        class: u8,
        /// Its number in the class.
        id: u8,
        /// What it says.
        payload: &'a [u8],
    },
}

/// Takes in bytes in pieces of any size. It holds no more than one frame and a piece.
#[derive(Debug, Default)]
pub struct Splitter {
    held: Vec<u8>,
    /// UBX frames whose checksum was wrong, or that were too long to be one.
    pub broken: u64,
    /// Bytes that belong to nothing that is known here.
    pub foreign: u64,
}

enum Next<'a> {
    Frame(usize, Frame<'a>),
    /// So many bytes are no frame.
    Foreign(usize),
    Broken(usize),
    /// It is not at its end.
    More,
}

impl Splitter {
    /// Gives `each` frame that is complete now.
    pub fn take(&mut self, bytes: &[u8], mut each: impl FnMut(Frame<'_>)) {
        for piece in bytes.chunks(PIECE) {
            self.held.extend_from_slice(piece);
            self.give(&mut each, false);
        }
    }

    /// What is held is at its end: nothing more of it will come.
    pub fn cut(&mut self, mut each: impl FnMut(Frame<'_>)) {
        self.give(&mut each, true);
    }

    fn give(&mut self, each: &mut impl FnMut(Frame<'_>), at_end: bool) {
        let mut done = 0;
        while done < self.held.len() {
            let rest = &self.held[done..];
            done += match next(rest) {
                Next::Frame(length, frame) => {
                    each(frame);
                    length
                }
                Next::Foreign(length) => {
                    let ends = |byte: &&u8| !matches!(**byte, b'\r' | b'\n');
                    self.foreign += rest[..length].iter().filter(ends).count() as u64;
                    length
                }
                Next::Broken(length) => {
                    self.broken += 1;
                    length
                }
                Next::More if !at_end => break,
                Next::More if is_line(rest[0]) => {
                    each(Frame::Line(rest));
                    rest.len()
                }
                Next::More => {
                    self.broken += 1;
                    1
                }
            };
        }
        self.held.drain(..done);
    }
}

fn is_line(first: u8) -> bool {
    matches!(first, b'$' | b'!')
}

/// What `bytes`, of which there is one at least, begin with.
fn next(bytes: &[u8]) -> Next<'_> {
    match bytes {
        [first, ..] if is_line(*first) => line(bytes),
        [first, second, ..] if [*first, *second] == SYNC => ubx(bytes),
        [first] if *first == SYNC[0] => Next::More,
        _ => {
            let begins = |byte: &u8| is_line(*byte) || *byte == SYNC[0];
            let length = bytes.iter().skip(1).position(begins);
            Next::Foreign(length.map_or(bytes.len(), |length| length + 1))
        }
    }
}

fn line(bytes: &[u8]) -> Next<'_> {
    let ends = |byte: &u8| *byte == b'$' || !(b' '..=b'~').contains(byte);
    match bytes.iter().skip(1).position(ends) {
        Some(length) if length < LONGEST_LINE => {
            Next::Frame(length + 1, Frame::Line(&bytes[..=length]))
        }
        None if bytes.len() <= LONGEST_LINE => Next::More,
        _ => Next::Broken(1),
    }
}

fn ubx(bytes: &[u8]) -> Next<'_> {
    let Some([class, id, low, high]) = bytes.get(2..HEADER).and_then(|it| it.first_chunk()) else {
        return Next::More;
    };
    let length = usize::from(u16::from_le_bytes([*low, *high]));
    if length > LONGEST_PAYLOAD {
        return Next::Broken(1);
    }
    let whole = HEADER + length + CHECKSUM;
    let Some(frame) = bytes.get(..whole) else {
        return Next::More;
    };
    let (said, checksum) = frame[2..].split_at(whole - 2 - CHECKSUM);
    if fletcher(said) != checksum {
        return Next::Broken(1);
    }
    let (class, id, payload) = (*class, *id, &frame[HEADER..HEADER + length]);
    Next::Frame(whole, Frame::Ubx { class, id, payload })
}

fn fletcher(bytes: &[u8]) -> [u8; 2] {
    bytes.iter().fold([0, 0], |[a, b], byte| {
        let a: u8 = byte.wrapping_add(a);
        [a, a.wrapping_add(b)]
    })
}

/// The frame of a message, for who plays a receiver.
///
/// # Panics
/// If the payload is longer than a frame can say.
#[must_use]
pub fn ubx_frame(class: u8, id: u8, payload: &[u8]) -> Vec<u8> {
    let length = u16::try_from(payload.len()).expect("a payload is short");
    let mut said = vec![class, id];
    said.extend(length.to_le_bytes());
    said.extend(payload);
    let checksum = fletcher(&said);
    [&SYNC[..], &said, &checksum].concat()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Frames as text, so that they can outlive the splitter.
    fn split(pieces: &[&[u8]]) -> (Vec<String>, Splitter) {
        let (mut splitter, mut frames) = (Splitter::default(), Vec::new());
        let mut note = |frame: Frame<'_>| {
            frames.push(match frame {
                Frame::Line(line) => String::from_utf8_lossy(line).into_owned(),
                Frame::Ubx { class, id, payload } => format!("{class} {id} {payload:?}"),
            });
        };
        for piece in pieces {
            splitter.take(piece, &mut note);
        }
        splitter.cut(&mut note);
        (frames, splitter)
    }

    #[test]
    fn lines_and_frames_come_out_of_a_mixed_stream() {
        let ubx = ubx_frame(1, 7, &[1, 2, 3]);
        let stream = [b"\r\n$A,1*00\r\n", &ubx[..], b"!B*11\n{\"class\":1}\r\n$C"].concat();
        let (frames, splitter) = split(&[&stream]);
        assert_eq!(frames, ["$A,1*00", "1 7 [1, 2, 3]", "!B*11", "$C"]);
        assert_eq!((splitter.broken, splitter.foreign), (0, 11));
    }

    #[test]
    fn a_line_in_which_another_begins_ends_there() {
        let (frames, _) = split(&[b"$GPG$GPRMC,1*22\n$GP\xff\xb5$X\n"]);
        assert_eq!(frames, ["$GPG", "$GPRMC,1*22", "$GP", "$X"]);
    }

    #[test]
    fn a_frame_that_is_broken_hides_nothing_behind_it() {
        let mut ubx = ubx_frame(1, 7, &[1, 2, 3]);
        ubx[7] ^= 1;
        let (frames, splitter) = split(&[&ubx, b"$A*00\n"]);
        assert_eq!((frames, splitter.broken), (vec!["$A*00".into()], 1));
        let long = [0xb5, 0x62, 1, 7, 0xff, 0xff];
        let (frames, splitter) = split(&[&long, b"$A*00\n"]);
        assert_eq!((frames, splitter.broken), (vec!["$A*00".into()], 1));
    }

    #[test]
    fn little_is_held_whatever_comes() {
        let mut splitter = Splitter::default();
        for junk in [&[b'$'; 9000][..], &[b'x'; 9000], &[0xb5; 9000], b"$aaaa"] {
            for _ in 0..100 {
                splitter.take(junk, |_| {});
                assert!(splitter.held.len() <= PIECE + LONGEST_PAYLOAD);
                assert!(splitter.held.capacity() <= 4 * PIECE);
            }
        }
    }

    proptest! {
        #[test]
        fn how_a_stream_is_cut_changes_nothing(
            parts in proptest::collection::vec(
                prop_oneof![
                    "\\$[A-Z,0-9]{0,40}\r\n".prop_map(String::into_bytes),
                    proptest::collection::vec(any::<u8>(), 0..60),
                    proptest::collection::vec(any::<u8>(), 0..60).prop_map(|payload| ubx_frame(1, 7, &payload)),
                ],
                0..20,
            ),
            size in 1_usize..50,
        ) {
            let stream = parts.concat();
            let (whole, counted) = split(&[&stream]);
            let pieces: Vec<_> = stream.chunks(size).collect();
            let (cut, counted_cut) = split(&pieces);
            prop_assert_eq!(whole, cut);
            prop_assert_eq!((counted.broken, counted.foreign), (counted_cut.broken, counted_cut.foreign));
        }
    }
}
