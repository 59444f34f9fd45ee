//! A recorded log in the format of `candump -L`, plain or gzip.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use super::candump_line::{self, Line, LineFault, LineFrame};
use super::filter::Filter;
use super::foreign::foreign;
use super::frame::{Frame, raw_id};
use super::heard::{Heard, identifier};
use super::log_report::LogReport;
use super::timeline::Timeline;

/// A frame of a log and when it was recorded.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct LogFrame {
    /// As the log has it \[ns since 1970\], but for jumps of its clock, which are taken out.
    pub stamp_ns: i64,
    /// What was recorded.
    pub frame: Frame,
}

/// The frames of a log in their order, and what else was in it.
///
/// Logs come from machines that lost power. What is there is read: lines that are no frames are skipped and counted, and
/// where the clock jumps, time goes on as if it had not. Only a file without any frame is refused.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Log {
    frames: Vec<LogFrame>,
    report: LogReport,
}

/// Why a log can't be read.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file can't be opened or read.
    #[error("can't read {path}: {error}")]
    Read {
        /// The log.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// Not one line is what `candump -L` writes.
    #[error(
        "{path}, line {line}: {fault}; a line looks like: (1533226488.434433) can0 0AA#1F2A1F2A1F161F29"
    )]
    Line {
        /// The log.
        path: PathBuf,
        /// The first line that looked like one, counted from 1.
        line: usize,
        /// What is wrong with it.
        fault: LineFault,
    },
    /// Two buses in one log, both with what is wanted.
    #[error("{path}: {id} is there on {} and on {}: choose one, as in candump:{path}?interface={}", .interfaces[0], .interfaces[1], .interfaces[0])]
    TwoInterfaces {
        /// The log.
        path: PathBuf,
        /// What is wanted, in words.
        id: String,
        /// Where it is.
        interfaces: [String; 2],
    },
    /// It is a log of another program.
    #[error("{path} is no candump log; it is {what}")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is, and what to do.
        what: &'static str,
    },
    /// Nothing to play.
    #[error("{path} holds no frame that is wanted{}{}; it holds {heard}", interface.as_ref().map(|name| format!(" of interface {name}")).unwrap_or_default(), listed(wanted))]
    Empty {
        /// The log.
        path: PathBuf,
        /// What was asked for.
        wanted: Filter,
        /// The interface that was asked for.
        interface: Option<String>,
        /// What there is of that interface instead.
        heard: Box<Heard>,
    },
}

impl Log {
    /// Reads the frames that `filter` wants, of one interface or of all. Whether the file is compressed its content says.
    ///
    /// # Errors
    /// [`LogError`] if there is no frame to play.
    pub fn read(path: &Path, interface: Option<&str>, filter: &Filter) -> Result<Self, LogError> {
        Self::read_with(path, LogReader::new(interface, filter))
    }

    /// Its first frames, so many at most, whatever they are.
    ///
    /// # Errors
    /// As [`Log::read`].
    pub fn read_beginning(
        path: &Path,
        interface: Option<&str>,
        frames: usize,
    ) -> Result<Self, LogError> {
        let reader = LogReader {
            most: frames,
            ..LogReader::new(interface, &Filter::All)
        };
        Self::read_with(path, reader)
    }

    fn read_with(path: &Path, mut reader: LogReader<'_>) -> Result<Self, LogError> {
        let unreadable = |error| LogError::Read {
            path: path.to_owned(),
            error,
        };
        let mut file = BufReader::new(File::open(path).map_err(unreadable)?);
        let beginning = file.fill_buf().map_err(unreadable)?;
        let (compressed, foreign) = (beginning.starts_with(&GZIP), foreign(beginning));
        if compressed {
            reader.read(BufReader::new(MultiGzDecoder::new(file)))
        } else {
            reader.read(file)
        }
        .map_err(unreadable)?;
        match foreign.filter(|_| reader.known == 0) {
            Some(what) => Err(LogError::Foreign {
                path: path.to_owned(),
                what,
            }),
            None => reader.finish(path),
        }
    }

    /// Every frame in its order, without playing them.
    #[must_use]
    pub fn frames(&self) -> &[LogFrame] {
        &self.frames
    }

    /// What else was in the file.
    #[must_use]
    pub fn report(&self) -> &LogReport {
        &self.report
    }
}

/// What editors put before the first line.
const BYTE_ORDER_MARK: [u8; 3] = [0xEF, 0xBB, 0xBF];

/// The first bytes of a gzip file.
const GZIP: [u8; 2] = [0x1F, 0x8B];

/// No line of a log is nearly as long \[bytes\].
const LONGEST_LINE: u64 = 65_536;

struct LogReader<'a> {
    interface: Option<&'a str>,
    filter: &'a Filter,
    timeline: Timeline,
    /// So many frames are enough.
    most: usize,
    line: usize,
    /// Lines that were frames, of any interface and wanted or not.
    known: u64,
    /// Of the interface, wanted or not.
    heard: Heard,
    /// Where each wanted identifier was first.
    interfaces: HashMap<u32, String>,
    twice: Option<(String, [String; 2])>,
    log: Log,
}

impl<'a> LogReader<'a> {
    fn new(interface: Option<&'a str>, filter: &'a Filter) -> Self {
        Self {
            interface,
            filter,
            timeline: Timeline::default(),
            most: usize::MAX,
            line: 0,
            known: 0,
            heard: Heard::default(),
            interfaces: HashMap::new(),
            twice: None,
            log: Log::default(),
        }
    }

    fn read(&mut self, mut text: impl BufRead) -> io::Result<()> {
        let mut line = Vec::new();
        while self.log.frames.len() < self.most {
            line.clear();
            let end = text
                .by_ref()
                .take(LONGEST_LINE)
                .read_until(b'\n', &mut line);
            if !line.is_empty() {
                self.take_line(&line);
            }
            match end {
                Ok(0) => return Ok(()),
                Ok(_) => {}
                Err(error) if is_cut(&error) => {
                    self.log.report.cut = true;
                    return Ok(());
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn take_line(&mut self, line: &[u8]) {
        self.line += 1;
        let line = match self.line {
            1 => line.strip_prefix(&BYTE_ORDER_MARK).unwrap_or(line),
            _ => line,
        };
        // A page that was never written, and what was logged after the next start behind it.
        let whole = line.rsplit(|&byte| byte == 0).next().unwrap_or(line);
        if whole.len() != line.len() {
            self.log.report.note_damage(self.line, LineFault::Text);
        }
        match candump_line::parse(whole) {
            Ok(Line::Frame(frame)) => self.take_frame(&frame),
            Ok(Line::Foreign { interface }) if self.is_wanted(interface) => {
                self.log.report.foreign += 1;
            }
            Ok(Line::Comment) => self.log.report.foreign += 1,
            Ok(Line::Blank | Line::Foreign { .. }) => {}
            Err(fault) => self.log.report.note_damage(self.line, fault),
        }
    }

    fn is_wanted(&self, interface: &str) -> bool {
        self.interface.is_none_or(|name| name == interface)
    }

    fn take_frame(&mut self, line: &LineFrame) {
        self.known += 1;
        if !self.is_wanted(line.interface) {
            return;
        }
        let frame = line.frame;
        self.heard.note(&frame);
        let (stamp_ns, jump) = self.timeline.place(line.interface, &frame, line.stamp_ns);
        if let Some(jump) = jump {
            self.log.report.note_jump(self.line, jump);
        }
        if self.filter.accepts(&frame) {
            self.note_interface(&frame, line.interface);
            self.log.frames.push(LogFrame { stamp_ns, frame });
            self.log.report.frames += 1;
        }
    }

    /// One wanted identifier on two interfaces is two senders, or one that is heard twice.
    fn note_interface(&mut self, frame: &Frame, interface: &str) {
        let (Filter::Ids(_), Some(id), None) = (self.filter, frame.id(), &self.twice) else {
            return;
        };
        let first = self
            .interfaces
            .entry(raw_id(id))
            .or_insert_with(|| interface.to_owned());
        if first != interface {
            self.twice = Some((identifier(id), [first.clone(), interface.to_owned()]));
        }
    }

    fn finish(self, path: &Path) -> Result<Log, LogError> {
        if let Some((id, interfaces)) = self.twice {
            let path = path.to_owned();
            return Err(LogError::TwoInterfaces {
                path,
                id,
                interfaces,
            });
        }
        if !self.log.frames.is_empty() {
            return Ok(self.log);
        }
        let path = path.to_owned();
        let first_damaged = self.log.report.first_damaged.filter(|_| self.known == 0);
        Err(match first_damaged {
            Some((line, fault)) => LogError::Line { path, line, fault },
            None => LogError::Empty {
                path,
                wanted: self.filter.clone(),
                interface: self.interface.map(str::to_owned),
                heard: self.heard.into(),
            },
        })
    }
}

/// In brackets, if not everything is wanted.
fn listed(wanted: &Filter) -> String {
    match wanted {
        Filter::All => String::new(),
        Filter::Ids(ids) => {
            let ids: Vec<_> = ids.iter().map(|&id| identifier(id)).collect();
            format!(" ({})", ids.join(", "))
        }
    }
}

/// Whether the compressed data ended early or are garbled, as opposed to a disk that can't be read.
fn is_cut(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::UnexpectedEof | io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData
    )
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;
    use proptest::prelude::*;

    use super::super::{ErrorClass, Kind};
    use super::*;

    fn parse(text: &[u8], interface: Option<&str>) -> Result<Log, LogError> {
        let filter = Filter::All;
        let mut reader = LogReader::new(interface, &filter);
        reader.read(text).unwrap();
        reader.finish("x.log".as_ref())
    }

    const EVERY_KIND: &str = "(1735270496.916858) can0 110#00112233\n\
        (1735270496.936508) can0 00000120##500112233445566778899AABB\n\
        (1735270496.948278) can1 110#R4\n\
        (1735270497.242430) can1 20000004#000C000000000000\n";

    #[test]
    fn every_kind_of_frame_is_read() {
        let log = parse(EVERY_KIND.as_bytes(), None).unwrap();
        let frames = log.frames();
        let kinds: Vec<Kind> = frames.iter().map(|log| log.frame.kind()).collect();
        assert_eq!(kinds, [Kind::Data, Kind::Fd, Kind::Remote, Kind::Error]);
        assert_eq!(frames[0].stamp_ns, 1_735_270_496_916_858_000);
        assert_eq!(frames[0].frame.data(), [0, 0x11, 0x22, 0x33]);
        assert_eq!(frames[2].frame.len_field(), 4);
        assert!(frames[3].frame.error().unwrap().has(ErrorClass::Controller));
        assert!(log.report().is_clean());
    }

    #[test]
    fn a_wanted_identifier_on_two_interfaces_is_refused_until_one_is_chosen() {
        let text =
            b"(1.000000) can0 100#01\n(1.000000) can1 101#01\n(1.100000) can1 100#02\n".as_slice();
        let read = |interface: Option<&str>, ids: &[u16]| {
            let ids = ids
                .iter()
                .map(|&id| socketcan::StandardId::new(id).unwrap().into());
            let wanted = Filter::ids(ids);
            let mut reader = LogReader::new(interface, &wanted);
            reader.read(text).unwrap();
            reader
                .finish("x.log".as_ref())
                .map(|log| log.frames().len())
        };
        let refused = read(None, &[0x100, 0x101]).unwrap_err().to_string();
        assert_eq!(
            refused,
            "x.log: 0x100 is there on can0 and on can1: choose one, as in candump:x.log?interface=can0"
        );
        assert_eq!(read(Some("can1"), &[0x100, 0x101]).unwrap(), 2);
        assert_eq!(read(None, &[0x101]).unwrap(), 1);
    }

    #[test]
    fn a_byte_order_mark_costs_no_frame() {
        let marked = [&BYTE_ORDER_MARK, EVERY_KIND.as_bytes()].concat();
        let plain = parse(EVERY_KIND.as_bytes(), None).unwrap();
        assert_eq!(parse(&marked, None).unwrap().frames(), plain.frames());
    }

    #[test]
    fn one_interface_is_picked() {
        let log = parse(EVERY_KIND.as_bytes(), Some("can1")).unwrap();
        assert_eq!((log.frames().len(), log.report().frames), (2, 2));
    }

    #[test]
    fn a_log_of_another_program_is_named() {
        let text = b"date Mon Jan 1\nbase hex  timestamps absolute\n 0.001 1 123 Rx d 1 00\n";
        let error = read_file(text, "x.asc").unwrap_err().to_string();
        assert!(
            error.contains("x.asc is no candump log; it is an ASC log: convert"),
            "{error}"
        );
    }

    #[test]
    fn a_file_without_a_frame_is_refused_by_line() {
        let error = parse(b"; remark\n(oops\n(also\n", None)
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("x.log, line 2: its stamp"), "{error}");
        let error = parse(EVERY_KIND.as_bytes(), Some("can7")).unwrap_err();
        assert!(matches!(error, LogError::Empty { .. }), "{error}");
        let other =
            Filter::ids([0x7A, 0x123].map(|id| socketcan::StandardId::new(id).unwrap().into()));
        let mut reader = LogReader::new(Some("can0"), &other);
        reader.read(EVERY_KIND.as_bytes()).unwrap();
        let error = reader.finish("x.log".as_ref()).unwrap_err().to_string();
        assert_eq!(
            error,
            "x.log holds no frame that is wanted of interface can0 (0x07A, 0x123); it holds 0x110 × 1, 0x00000120 (extended) × 1"
        );
    }

    /// `count` good lines, 20 ms apart.
    fn good_lines(count: usize) -> String {
        let line = |n: usize| {
            let (seconds, microseconds) = (1_700_000_000 + n / 50, n % 50 * 20_000);
            format!("({seconds}.{microseconds:06}) can0 100#{n:08X}\n")
        };
        (0..count).map(line).collect()
    }

    fn damaged(text: &[u8]) -> (usize, u64, Option<usize>) {
        let log = parse(text, None).unwrap();
        let report = log.report();
        let first = report.first_damaged.as_ref().map(|&(line, _)| line);
        (log.frames().len(), report.damaged, first)
    }

    #[test]
    fn damage_costs_its_own_line_and_is_counted() {
        let good = good_lines(10);
        for tail in [
            "(17000000",
            "(1700000001.000000) can0 10",
            "(1700000001.000000) can0 100#001",
            "\0\0\0",
        ] {
            assert_eq!(
                damaged((good.clone() + tail).as_bytes()),
                (10, 1, Some(11)),
                "{tail:?}"
            );
        }
        let across = format!("{good}(1700000000.2\0\0\0\0(1700000000.200000) can0 100#0000000A\n");
        assert_eq!(
            damaged(across.as_bytes()),
            (11, 1, Some(11)),
            "a page of zeros"
        );
        let joined = format!("(1700000000.000000) can0 100#00{good}");
        assert_eq!(
            damaged(joined.as_bytes()),
            (9, 1, Some(1)),
            "no end of line"
        );
        assert_eq!(
            damaged(("\n\n".to_owned() + &good + "\r\n").as_bytes()),
            (10, 0, None)
        );
        let long = good
            .clone()
            .into_bytes()
            .into_iter()
            .chain(vec![0; 200_000]);
        assert_eq!(damaged(&long.collect::<Vec<_>>()).0, 10, "many zeros");
    }

    #[test]
    fn what_is_foreign_is_skipped_and_counted() {
        let text =
            good_lines(5) + "# remark\n(1700000000.100000) can0 00123#80:00:00000000#00112233\n";
        let log = parse(text.as_bytes(), None).unwrap();
        assert_eq!((log.frames().len(), log.report().foreign), (5, 2));
        assert!(log.report().is_clean());
    }

    #[test]
    fn a_log_without_any_jump_keeps_its_stamps() {
        let stamps: Vec<i64> = parse(good_lines(5).as_bytes(), None)
            .unwrap()
            .frames()
            .iter()
            .map(|log| log.stamp_ns % 1_000_000_000)
            .collect();
        assert_eq!(stamps, [0, 20_000_000, 40_000_000, 60_000_000, 80_000_000]);
    }

    #[test]
    fn stamps_that_jump_are_played_on_and_named() {
        let later = good_lines(10).replace("(17000", "(16999")
            + &good_lines(10).replace("(17000", "(20000");
        let log = parse((good_lines(10) + &later).as_bytes(), None).unwrap();
        let (first, last) = (log.frames()[0].stamp_ns, log.frames()[29].stamp_ns);
        assert_eq!(last - first, 29 * 20_000_000);
        assert_eq!(log.report().jumps, 2);
        assert_eq!(log.report().first_jump, Some((11, -100_000_180_000_000)));
    }

    fn compressed(text: &str) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(text.as_bytes()).unwrap();
        encoder.finish().unwrap()
    }

    fn read_file(content: &[u8], name: &str) -> Result<Log, LogError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(name);
        std::fs::write(&path, content).unwrap();
        Log::read(&path, None, &Filter::All)
    }

    #[test]
    fn a_cut_archive_is_played_as_far_as_it_goes() {
        let whole = compressed(&good_lines(2000));
        let log = read_file(&whole[..whole.len() / 2], "x.log.gz").unwrap();
        assert!(
            (100..2000).contains(&log.frames().len()),
            "{}",
            log.frames().len()
        );
        assert!(log.report().cut);
        let log = read_file(&[whole.as_slice(), &[0; 100]].concat(), "x.log.gz").unwrap();
        assert_eq!(
            (log.frames().len(), log.report().cut),
            (2000, true),
            "zeros behind it"
        );
    }

    #[test]
    fn whether_it_is_compressed_the_content_says() {
        assert_eq!(
            read_file(good_lines(5).as_bytes(), "x.log.gz")
                .unwrap()
                .frames()
                .len(),
            5
        );
        assert_eq!(
            read_file(&compressed(&good_lines(5)), "x.log")
                .unwrap()
                .frames()
                .len(),
            5
        );
    }

    proptest! {
        #[test]
        fn any_text_is_a_log_or_an_error(text in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&text, None);
        }

        #[test]
        fn damage_anywhere_invents_no_frame(
            lines in 1_usize..20, at in 0_usize..700, garbage in proptest::collection::vec(any::<u8>(), 0..20), cut in any::<bool>(),
        ) {
            let good = good_lines(lines).into_bytes();
            let at = at.min(good.len());
            let rest = if cut { &[][..] } else { &good[at..] };
            let text = [&good[..at], &[0], &garbage, &[0], rest].concat();
            if let Ok(log) = parse(&text, None) {
                for played in log.frames() {
                    let whole = parse(&good, None).unwrap();
                    let known = |log: &LogFrame| log.frame.data().starts_with(played.frame.data());
                    prop_assert!(whole.frames().iter().any(known), "{played:?}");
                }
            }
        }
    }
}
