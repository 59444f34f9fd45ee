//! A recorded log in the format of `candump -L`, plain or gzip.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;
use socketcan::dump::{CanDumpRecord, ParseError, Reader};
use socketcan::{CanAnyFrame, EmbeddedFrame};

use super::filter::Filter;
use super::frame::Frame;

/// A frame of a log and when it was recorded.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct LogFrame {
    /// As the log has it \[ns since 1970\].
    pub stamp_ns: i64,
    /// What was recorded.
    pub frame: Frame,
}

/// The frames of a log in their order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Log {
    frames: Vec<LogFrame>,
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
    /// A line is not what `candump -L` writes.
    #[error(
        "{path}, line {line}: {error}; a line looks like: (1533226488.434433) can0 0AA#1F2A1F2A1F161F29"
    )]
    Line {
        /// The log.
        path: PathBuf,
        /// Counts from 1.
        line: usize,
        /// What is wrong with it.
        error: ParseError,
    },
    /// Nothing to play.
    #[error("{path} holds no frame that is wanted{}", interface.as_ref().map(|name| format!(" of interface {name}")).unwrap_or_default())]
    Empty {
        /// The log.
        path: PathBuf,
        /// The interface that was asked for.
        interface: Option<String>,
    },
}

impl Log {
    /// Reads the frames that `filter` wants, of one interface or of all.
    ///
    /// # Errors
    /// [`LogError`], with the line where it is one line's fault.
    pub fn read(path: &Path, interface: Option<&str>, filter: &Filter) -> Result<Self, LogError> {
        let unreadable = |error| LogError::Read {
            path: path.to_owned(),
            error,
        };
        let file = File::open(path).map_err(unreadable)?;
        let frames = if path.extension().is_some_and(|extension| extension == "gz") {
            frames(
                path,
                MultiGzDecoder::new(BufReader::new(file)),
                interface,
                filter,
            )
        } else {
            frames(path, file, interface, filter)
        }?;
        if frames.is_empty() {
            return Err(LogError::Empty {
                path: path.to_owned(),
                interface: interface.map(str::to_owned),
            });
        }
        Ok(Self { frames })
    }

    /// Every frame in its order, without playing them.
    #[must_use]
    pub fn frames(&self) -> &[LogFrame] {
        &self.frames
    }
}

fn frames(
    path: &Path,
    text: impl Read,
    interface: Option<&str>,
    filter: &Filter,
) -> Result<Vec<LogFrame>, LogError> {
    let mut frames = Vec::new();
    for (index, record) in Reader::from_reader(text).enumerate() {
        let record = record.map_err(|error| line_error(path, index + 1, error))?;
        if interface.is_none_or(|name| name == record.device) {
            frames.extend(log_frame(&record).filter(|log| filter.accepts(&log.frame)));
        }
    }
    Ok(frames)
}

fn line_error(path: &Path, line: usize, error: ParseError) -> LogError {
    let path = path.to_owned();
    match error {
        ParseError::Io(error) => LogError::Read { path, error },
        error => LogError::Line { path, line, error },
    }
}

fn log_frame(record: &CanDumpRecord) -> Option<LogFrame> {
    let stamp_ns = i64::try_from(record.t_us).ok()?.checked_mul(1000)?;
    Some(LogFrame {
        stamp_ns,
        frame: convert(&record.frame)?,
    })
}

fn convert(frame: &CanAnyFrame) -> Option<Frame> {
    match frame {
        CanAnyFrame::Normal(frame) => Frame::data_frame(frame.id(), frame.data()),
        CanAnyFrame::Fd(frame) => Frame::fd_frame(frame.id(), frame.data()),
        CanAnyFrame::Remote(frame) => {
            Frame::remote_frame(frame.id(), u8::try_from(frame.dlc()).ok()?)
        }
        CanAnyFrame::Error(frame) => Some(Frame::error_frame(
            frame.error_bits(),
            details(frame.data()),
        )),
    }
}

fn details(data: &[u8]) -> [u8; 8] {
    let mut details = [0; 8];
    for (to, from) in details.iter_mut().zip(data) {
        *to = *from;
    }
    details
}

#[cfg(test)]
mod tests {
    use super::super::{ErrorClass, Kind};
    use super::*;
    use proptest::prelude::*;

    fn parse(text: &[u8], interface: Option<&str>) -> Result<Vec<LogFrame>, LogError> {
        frames(Path::new("x.log"), text, interface, &Filter::All)
    }

    const EVERY_KIND: &str = "(1735270496.916858) can0 110#00112233\n\
        (1735270588.936508) can0 00000120##500112233445566778899AABB\n\
        (1735279049.348278) can1 110#R4\n\
        (1785099856.242430) can1 20000004#000C000000000000\n";

    #[test]
    fn every_kind_of_frame_is_read() {
        let log = parse(EVERY_KIND.as_bytes(), None).unwrap();
        let kinds: Vec<Kind> = log.iter().map(|log| log.frame.kind()).collect();
        assert_eq!(kinds, [Kind::Data, Kind::Fd, Kind::Remote, Kind::Error]);
        assert_eq!(log[0].stamp_ns, 1_735_270_496_916_858_000);
        assert_eq!(log[0].frame.data(), [0, 0x11, 0x22, 0x33]);
        assert_eq!(log[2].frame.len_field(), 4);
        assert!(log[3].frame.error().unwrap().has(ErrorClass::Controller));
    }

    #[test]
    fn one_interface_is_picked() {
        assert_eq!(parse(EVERY_KIND.as_bytes(), Some("can1")).unwrap().len(), 2);
    }

    #[test]
    fn a_broken_line_is_named() {
        let error = parse(b"(1735270496.916858) can0 110#00\n(oops\n", None)
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("x.log, line 2:"), "{error}");
    }

    proptest! {
        #[test]
        fn any_text_is_a_log_or_an_error(text in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&text, None);
        }

        #[test]
        fn any_nearly_right_line_is_a_frame_or_an_error(
            line in r"\([0-9]{0,12}\.[0-9]{0,8}\) [a-z0-9]{0,4} [0-9A-F]{0,9}#{0,2}R?[0-9A-F]{0,140}( R| T)?",
        ) {
            let _ = parse(line.as_bytes(), None);
        }
    }
}
