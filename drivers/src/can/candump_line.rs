//! One line of a log: stamp, interface, frame.

use socketcan::id::{CAN_ERR_FLAG, CAN_ERR_MASK};
use socketcan::{ExtendedId, Id, StandardId};

use super::frame::Frame;

/// What a line of a log says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Line<'a> {
    /// A frame that an interface carried.
    Frame(LineFrame<'a>),
    /// A frame of a kind that coloc does not read: CAN XL.
    Foreign {
        /// Which interface carried it.
        interface: &'a str,
    },
    /// Anything that does not begin with a stamp, as `canplayer` has it.
    Comment,
    /// Nothing.
    Blank,
}

/// A frame as the line has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LineFrame<'a> {
    /// As written \[ns\].
    pub(super) stamp_ns: i64,
    /// Which interface carried it.
    pub(super) interface: &'a str,
    /// What it carried.
    pub(super) frame: Frame,
}

/// Why a line that begins like a frame of a log is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineFault {
    /// Bytes that are no text: zeros after a power loss, or no log at all.
    #[error("it holds bytes that are no text")]
    Text,
    /// Not as `candump -L` writes stamps.
    #[error("its stamp is not (seconds.microseconds) or (seconds.nanoseconds)")]
    Stamp,
    /// The end is missing.
    #[error("it ends too early")]
    Short,
    /// An identifier that its digits have no room for; as written.
    #[error(
        "identifier {0}: three digits hold 11 bits (up to 7FF), eight hold 29 (up to 1FFFFFFF)"
    )]
    Identifier(String),
    /// Neither data, nor a remote frame, nor an FD frame.
    #[error("its frame is cut or garbled")]
    Frame,
    /// Something other than a direction follows the frame.
    #[error("its frame is followed by something other than R or T")]
    Tail,
}

/// Reads a line. Nothing is guessed: a frame that is written as no tool writes it is a fault.
pub(super) fn parse(line: &[u8]) -> Result<Line<'_>, LineFault> {
    let line = line.trim_ascii();
    match line.first() {
        None => return Ok(Line::Blank),
        Some(b'(') => {}
        Some(_) if line.contains(&0) => return Err(LineFault::Text),
        Some(_) => return Ok(Line::Comment),
    }
    let text = str::from_utf8(line).map_err(|_| LineFault::Text)?;
    if text.contains('\0') {
        return Err(LineFault::Text);
    }
    let mut fields = text.split_ascii_whitespace();
    let stamp_ns = fields.next().and_then(stamp_ns).ok_or(LineFault::Stamp)?;
    let interface = fields.next().ok_or(LineFault::Short)?;
    let body = fields.next().ok_or(LineFault::Short)?;
    let tail = (fields.next(), fields.next());
    if !matches!(tail, (None | Some("R" | "T" | "r" | "t"), None)) {
        return Err(LineFault::Tail);
    }
    Ok(match frame(body)? {
        Some(frame) => Line::Frame(LineFrame {
            stamp_ns,
            interface,
            frame,
        }),
        None => Line::Foreign { interface },
    })
}

/// `(1533226488.434433)`, or with nine decimals as `candump -N` writes them. Other counts of decimals mean different
/// things to different tools.
fn stamp_ns(field: &str) -> Option<i64> {
    let (seconds, decimals) = field
        .strip_prefix('(')?
        .strip_suffix(')')?
        .split_once('.')?;
    let unit_ns = match decimals.len() {
        6 => 1000,
        9 => 1,
        _ => return None,
    };
    number(seconds)?
        .checked_mul(1_000_000_000)?
        .checked_add(number(decimals)? * unit_ns)
}

/// Digits alone: `parse` would take a sign.
fn number(digits: &str) -> Option<i64> {
    digits
        .bytes()
        .all(|byte| byte.is_ascii_digit())
        .then(|| digits.parse().ok())?
}

/// `ID#DATA`, `ID#R[LENGTH]`, `ID##FLAGS DATA`; `None` for CAN XL, whose five digits are a priority and a network.
fn frame(body: &str) -> Result<Option<Frame>, LineFault> {
    let (id, content) = body.split_once('#').ok_or(LineFault::Frame)?;
    let raw = u32::from_str_radix(hex_digits(id).ok_or(LineFault::Frame)?, 16)
        .map_err(|_| LineFault::Identifier(id.to_owned()))?;
    match id.len() {
        5 => return Ok(None),
        8 if raw & CAN_ERR_FLAG != 0 => return error(raw, content).map(Some),
        3 | 8 => {}
        _ => return Err(LineFault::Frame),
    }
    let id = typed(id.len(), raw).ok_or_else(|| LineFault::Identifier(id.to_owned()))?;
    content_of(id, content).ok_or(LineFault::Frame).map(Some)
}

fn typed(digits: usize, raw: u32) -> Option<Id> {
    if digits == 8 {
        return ExtendedId::new(raw).map(Id::Extended);
    }
    let raw = u16::try_from(raw).ok()?;
    StandardId::new(raw).map(Id::Standard)
}

fn content_of(id: Id, content: &str) -> Option<Frame> {
    if let Some(fd) = content.strip_prefix('#') {
        let (_flags, data) = fd.split_at_checked(1)?;
        hex_digits(fd)?;
        return Frame::fd_frame(id, &bytes(data).filter(|data| is_fd_length(data.len()))?);
    }
    if let Some(length) = content.strip_prefix(['R', 'r']) {
        return Frame::remote_frame(id, remote_length(length)?);
    }
    Frame::data_frame(id, &bytes(without_dlc(content))?)
}

fn error(raw: u32, content: &str) -> Result<Frame, LineFault> {
    let mut details = [0; 8];
    let data = bytes(content).ok_or(LineFault::Frame)?;
    details
        .get_mut(..data.len())
        .ok_or(LineFault::Frame)?
        .copy_from_slice(&data);
    Ok(Frame::error_frame(raw & CAN_ERR_MASK, details))
}

/// A frame that is cut within its data must not pass for one filled up with zeros.
fn is_fd_length(len: usize) -> bool {
    matches!(len, 0..=8 | 12 | 16 | 20 | 24 | 32 | 48 | 64)
}

fn remote_length(digits: &str) -> Option<u8> {
    match without_dlc(digits).as_bytes() {
        [] => Some(0),
        [digit @ b'0'..=b'8'] => Some(digit - b'0'),
        _ => None,
    }
}

/// Without the `_E` with which `candump -8` says that a frame of eight bytes had the length code 14.
fn without_dlc(content: &str) -> &str {
    match content.rsplit_once('_') {
        Some((full, dlc))
            if matches!(full.len(), 1 | 16)
                && matches!(dlc.as_bytes(), [b'9' | b'A'..=b'F' | b'a'..=b'f']) =>
        {
            full
        }
        _ => content,
    }
}

fn bytes(hex: &str) -> Option<Vec<u8>> {
    let digits = hex_digits(hex)?;
    let byte = |at: usize| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    (0..digits.len()).step_by(2).map(byte).collect()
}

/// Hexadecimal digits alone: `from_str_radix` would take a sign.
fn hex_digits(text: &str) -> Option<&str> {
    text.bytes()
        .all(|byte| byte.is_ascii_hexdigit())
        .then_some(text)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use socketcan::dump::Reader;
    use socketcan::{CanAnyFrame, EmbeddedFrame};

    use super::super::{Kind, raw_id};
    use super::*;

    fn frame_of(body: &str) -> Result<Frame, LineFault> {
        match parse(format!("(1.000000) can0 {body}\n").as_bytes())? {
            Line::Frame(line) => Ok(line.frame),
            other => panic!("{body} is {other:?}"),
        }
    }

    fn stamp_of(stamp: &str) -> Result<i64, LineFault> {
        match parse(format!("({stamp}) can0 1AA#").as_bytes())? {
            Line::Frame(line) => Ok(line.stamp_ns),
            other => panic!("{stamp} is {other:?}"),
        }
    }

    #[test]
    fn stamps_have_six_or_nine_decimals() {
        assert_eq!(stamp_of("1.000001"), Ok(1_000_001_000));
        assert_eq!(
            stamp_of("1700000000.123456789"),
            Ok(1_700_000_000_123_456_789)
        );
        for odd in [
            "1.5",
            "1.",
            "1",
            "-1.000000",
            "+1.000000",
            "1.00000+1",
            "9223372037.000000",
        ] {
            assert_eq!(stamp_of(odd), Err(LineFault::Stamp), "{odd}");
        }
    }

    #[test]
    fn an_identifier_is_never_cut() {
        for (id, fits) in [("7FF", true), ("800", false), ("FFF", false)] {
            let refused = LineFault::Identifier(id.to_owned());
            assert_eq!(
                frame_of(&format!("{id}#00")).err(),
                (!fits).then_some(refused)
            );
        }
        assert!(frame_of("1FFFFFFF#00").is_ok());
        for wide in ["98FF0100", "40000123", "FFFFFFFF"] {
            let outcome = frame_of(&format!("{wide}#00"));
            let is_error = matches!(&outcome, Ok(frame) if frame.kind() == Kind::Error);
            let refused = outcome == Err(LineFault::Identifier(wide.to_owned()));
            assert!(is_error || refused, "{wide}: {outcome:?}");
        }
    }

    #[test]
    fn a_length_code_beyond_eight_is_eight_bytes() {
        let frame = frame_of("123#1122334455667788_E").unwrap();
        assert_eq!(frame, frame_of("123#1122334455667788").unwrap());
        assert_eq!(frame_of("123#R8_F").unwrap().len_field(), 8);
        for odd in [
            "123#11_E",
            "123#1122334455667788_8",
            "123#1122334455667788_",
        ] {
            assert_eq!(frame_of(odd), Err(LineFault::Frame), "{odd}");
        }
    }

    #[test]
    fn frames_that_are_cut_or_signed_are_none() {
        for odd in [
            "123",
            "123#1",
            "12#00",
            "+12#00",
            "123#+1",
            "123#R+4",
            "123#R9",
            "123##",
            "123##0+1",
            "123##0001",
            "123#001122334455667788",
            "123##é",
            "é#00",
        ] {
            assert_eq!(frame_of(odd), Err(LineFault::Frame), "{odd}");
        }
        assert_eq!(
            frame_of(&format!("123##0{}", "00".repeat(9))),
            Err(LineFault::Frame),
            "no FD frame has nine bytes"
        );
    }

    #[test]
    fn what_is_no_frame_is_told_apart() {
        let line = |text: &'static str| parse(text.as_bytes());
        assert_eq!(line(" \r\n"), Ok(Line::Blank));
        assert_eq!(line("; a remark\n"), Ok(Line::Comment));
        let xl = "(1.000000) can0 00123#80:00:00000000#0011223344\n";
        assert_eq!(line(xl), Ok(Line::Foreign { interface: "can0" }));
        assert_eq!(line("\0\0\0"), Err(LineFault::Text));
        assert_eq!(line("(1.0000"), Err(LineFault::Stamp));
        assert_eq!(line("(1.000000) can0"), Err(LineFault::Short));
        assert_eq!(line("(1.000000) can0 123#00 x"), Err(LineFault::Tail));
        assert_eq!(line("(1.000000) can0 123#00 R R"), Err(LineFault::Tail));
        let joined = "(1.000000) can0 123#00(2.000000) can0 123#0011";
        assert_eq!(line(joined), Err(LineFault::Tail));
    }

    /// What another reader of the same format makes of a line.
    fn other(line: &str) -> Option<(i64, Option<u32>, Vec<u8>)> {
        let record = Reader::from_reader(line.as_bytes()).next()?.ok()?;
        let (id, data) = match record.frame {
            CanAnyFrame::Normal(frame) => (Some(frame.id()), frame.data().to_vec()),
            CanAnyFrame::Fd(frame) => (Some(frame.id()), frame.data().to_vec()),
            CanAnyFrame::Remote(frame) => (Some(frame.id()), Vec::new()),
            CanAnyFrame::Error(_) => (None, Vec::new()),
        };
        let stamp_ns = i64::try_from(record.t_us).ok()?.checked_mul(1000)?;
        Some((stamp_ns, id.map(raw_id), data))
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_line_or_a_fault(line in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&line);
        }

        #[test]
        fn what_is_read_is_what_another_reader_reads(
            line in r"\([0-9]{1,11}\.[0-9]{6}\) [a-z0-9]{1,4} ([0-7][0-9A-F]{2}|[01][0-9A-F]{7}|[0-9A-F]{8})#{1,2}R?[0-9A-F]{0,18}( R| T)?",
        ) {
            if let Ok(Line::Frame(ours)) = parse(line.as_bytes()) {
                let (stamp_ns, id, data) = other(&line).expect("the other reader refuses it");
                prop_assert_eq!(ours.stamp_ns, stamp_ns);
                prop_assert_eq!(ours.frame.id().map(raw_id), id);
                if ours.frame.kind() != Kind::Error {
                    prop_assert_eq!(ours.frame.data(), data);
                }
            }
        }

        #[test]
        fn a_cut_line_never_says_anything_else(
            id in 0_u16..0x800, data in proptest::collection::vec(any::<u8>(), 0..=8), cut in 0_usize..60,
        ) {
            let hex = data.iter().fold(String::new(), |hex, byte| hex + &format!("{byte:02X}"));
            let whole = format!("(1700000000.123456) can0 {id:03X}#{hex}");
            let cut = whole.get(..cut).unwrap_or(&whole);
            if let Ok(Line::Frame(line)) = parse(cut.as_bytes()) {
                prop_assert_eq!(line.stamp_ns, 1_700_000_000_123_456_000);
                prop_assert_eq!(line.frame.id().map(raw_id), Some(u32::from(id)));
                prop_assert!(data.starts_with(line.frame.data()));
            }
        }
    }
}
