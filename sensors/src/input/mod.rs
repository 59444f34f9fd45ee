//! Where bytes come from, opened again when it was lost.

mod serial;
mod spec;
mod tcp;
mod unzip;

use std::fs::File;
use std::io::{self, Read};
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags};

use crate::backoff::Backoff;
use crate::stop::{Stop, Woken};
use serial::open_serial;
use tcp::{Attempt, greeting};
use unzip::Unzip;

pub use spec::InputSpec;

/// As much as is read at once: out of gzip it is at most a thousand times that.
const PIECE: usize = 4096;

/// Where bytes come from.
#[derive(Debug)]
pub struct Input {
    spec: InputSpec,
    /// A device or server that is silent for so long is opened again.
    silence: Duration,
    state: State,
    backoff: Backoff,
    heard: Instant,
    bytes: Vec<u8>,
}

#[derive(Debug)]
enum State {
    Closed,
    Connecting(Attempt),
    Open(Device),
    AtEnd,
}

#[derive(Debug)]
enum Device {
    Serial(OwnedFd),
    Tcp(TcpStream),
    File(File, Unzip),
    Stdin(OwnedFd, Unzip),
}

/// What came of waiting.
#[derive(Debug)]
pub enum Step {
    /// There are [`Input::bytes`].
    Bytes,
    /// Nothing came.
    Quiet,
    /// It was opened.
    Opened,
    /// It could not be opened, or was lost: why. It is tried again.
    Lost(String),
    /// A file is at its end.
    End,
    /// The program was asked to end.
    Stop,
    /// A file cannot be read, and trying again would not help.
    Unreadable(String),
}

impl Input {
    /// Nothing is opened yet.
    #[must_use]
    pub fn new(spec: InputSpec, silence: Duration) -> Self {
        Self {
            spec,
            silence,
            state: State::Closed,
            backoff: Backoff::default(),
            heard: Instant::now(),
            bytes: Vec::with_capacity(PIECE),
        }
    }

    /// Where it is, as a person wrote it.
    #[must_use]
    pub fn spec(&self) -> &InputSpec {
        &self.spec
    }

    /// Whether it is open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        matches!(self.state, State::Open(_))
    }

    /// What the last [`Step::Bytes`] has brought.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Waits until something comes, but no longer than `patience`.
    ///
    /// # Errors
    /// If the system cannot wait.
    pub fn step(&mut self, stop: &Stop, patience: Duration) -> io::Result<Step> {
        match &self.state {
            State::AtEnd => Ok(Step::End),
            State::Closed => self.try_open(stop, patience),
            State::Connecting(attempt) => match stop.wait(Some(attempt.over.as_fd()), patience)? {
                Woken::Stop => Ok(Step::Stop),
                Woken::Timeout => Ok(Step::Quiet),
                Woken::Ready => {
                    let result = attempt.result();
                    Ok(self.opened(result.map(Device::Tcp)))
                }
            },
            State::Open(device) => match stop.wait(Some(device.as_fd()), patience)? {
                Woken::Stop => Ok(Step::Stop),
                Woken::Timeout => Ok(self.quiet()),
                Woken::Ready => Ok(self.read()),
            },
        }
    }

    fn try_open(&mut self, stop: &Stop, patience: Duration) -> io::Result<Step> {
        let left = self.backoff.left(Instant::now());
        if !left.is_zero() {
            return Ok(match stop.wait(None, left.min(patience))? {
                Woken::Stop => Step::Stop,
                _ => Step::Quiet,
            });
        }
        let opened = match &self.spec {
            InputSpec::Serial { path, baud } => open_serial(path, *baud).map(Device::Serial),
            InputSpec::File { path, .. } => {
                open_file(path).map(|file| Device::File(file, Unzip::default()))
            }
            InputSpec::Stdin { .. } => (io::stdin().as_fd().try_clone_to_owned())
                .map(|stdin| Device::Stdin(stdin, Unzip::default())),
            InputSpec::Tcp { address } | InputSpec::Gpsd { address, .. } => {
                match Attempt::begin(address, greeting(&self.spec)) {
                    Ok(attempt) => {
                        self.state = State::Connecting(attempt);
                        return Ok(Step::Quiet);
                    }
                    Err(error) => Err(error),
                }
            }
        };
        Ok(self.opened(opened))
    }

    fn opened(&mut self, device: io::Result<Device>) -> Step {
        match device {
            Ok(device) => {
                self.heard = Instant::now();
                self.state = State::Open(device);
                Step::Opened
            }
            Err(error) => self.lost(&error),
        }
    }

    fn lost(&mut self, why: &io::Error) -> Step {
        self.state = State::Closed;
        let said = format!("{}: {}", self.spec, coloc_shm_types::advice::advised(why));
        if matches!(self.spec, InputSpec::File { .. } | InputSpec::Stdin { .. }) {
            return Step::Unreadable(said);
        }
        self.backoff.failed(Instant::now());
        Step::Lost(said)
    }

    /// A connection whose other side lost its power never says so.
    fn quiet(&mut self) -> Step {
        let ends = matches!(self.spec, InputSpec::File { .. } | InputSpec::Stdin { .. });
        if ends || self.heard.elapsed() < self.silence {
            return Step::Quiet;
        }
        let silence = self.silence.as_secs_f64();
        self.lost(&io::Error::other(format!("silent for {silence} s")))
    }

    fn read(&mut self) -> Step {
        let State::Open(device) = &mut self.state else {
            return Step::Quiet;
        };
        self.bytes.clear();
        match device.read(&mut self.bytes) {
            Ok(Came::Some) => {
                self.heard = Instant::now();
                // What opens and is lost at once has not worked.
                self.backoff.worked();
                Step::Bytes
            }
            Ok(Came::Later) => Step::Quiet,
            Ok(Came::End) => match device {
                Device::Serial(_) => self.lost(&io::Error::other("the device is gone")),
                Device::Tcp(_) => self.lost(&io::Error::other("the other side has ended it")),
                Device::File(..) | Device::Stdin(..) => {
                    self.state = State::AtEnd;
                    Step::Bytes
                }
            },
            Err(error) => self.lost(&error),
        }
    }
}

/// What reading found.
enum Came {
    Some,
    Later,
    End,
}

impl Device {
    fn read(&mut self, out: &mut Vec<u8>) -> io::Result<Came> {
        let mut piece = [0; PIECE];
        let read = match self {
            Self::Serial(device) => rustix::io::read(&*device, &mut piece).map_err(Into::into),
            Self::Stdin(stdin, _) => rustix::io::read(&*stdin, &mut piece).map_err(Into::into),
            Self::Tcp(stream) => stream.read(&mut piece),
            Self::File(file, _) => file.read(&mut piece),
        };
        let read = match read {
            Err(error) if is_for_later(&error) => return Ok(Came::Later),
            read => read?,
        };
        match self {
            Self::Serial(_) | Self::Tcp(_) => out.extend_from_slice(&piece[..read]),
            Self::File(_, unzip) | Self::Stdin(_, unzip) if read == 0 => match unzip.end(out) {
                // What it has comes first; that it was cut is said when it is read again.
                Err(_) if !out.is_empty() => return Ok(Came::Some),
                ended => ended?,
            },
            Self::File(_, unzip) | Self::Stdin(_, unzip) => unzip.take(&piece[..read], out)?,
        }
        Ok(if read == 0 { Came::End } else { Came::Some })
    }
}

/// A pipe that nobody writes to would hold who opens it.
fn open_file(path: &Path) -> io::Result<File> {
    let flags = OFlags::RDONLY | OFlags::CLOEXEC | OFlags::NONBLOCK;
    Ok(rustix::fs::open(path, flags, Mode::empty())?.into())
}

fn is_for_later(error: &io::Error) -> bool {
    let kinds = [io::ErrorKind::WouldBlock, io::ErrorKind::Interrupted];
    kinds.contains(&error.kind())
}

impl AsFd for Device {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match self {
            Self::Serial(device) | Self::Stdin(device, _) => device.as_fd(),
            Self::Tcp(stream) => stream.as_fd(),
            Self::File(file, _) => file.as_fd(),
        }
    }
}
