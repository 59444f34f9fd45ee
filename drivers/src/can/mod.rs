//! CAN: frames, and where they come from.
//!
//! Whatever the source, a [`Bus`] is one descriptor to wait on and hands on [`Received`] frames with the kernel's stamp.

mod backoff;
mod bus;
mod candump;
mod candump_line;
mod controller;
mod error_frame;
mod filter;
mod foreign;
mod frame;
mod health;
mod heard;
mod listen;
mod local;
mod log_report;
mod open_error;
mod peers;
mod playback;
mod received;
mod room;
mod sender;
mod socket_bus;
mod socketcan;
mod spec;
mod sys;
mod timeline;

pub use self::bus::Bus;
pub use self::candump::{Log, LogError, LogFrame};
pub use self::candump_line::LineFault;
pub use self::controller::Controller;
pub use self::error_frame::{ControllerState, ErrorClass, ErrorCounters, ErrorFrame};
pub use self::filter::Filter;
pub use self::frame::{CLASSIC_SIZE, FD_SIZE, Frame, FrameError, Kind, raw_id};
pub use self::health::{BusCounters, BusHealth, BusState};
pub use self::heard::{Heard, identifier};
pub use self::listen::listen;
pub use self::log_report::LogReport;
pub use self::open_error::OpenError;
pub use self::received::{Drained, FRAMES_PER_CALL, Received, StampClock};
pub use self::room::Shortage;
pub use self::sender::{SendCounters, Sender};
pub use self::spec::{BusSpec, BusSpecError};
pub use ::socketcan::errors::ControllerProblems;
pub use ::socketcan::{ExtendedId, Id, StandardId};
pub use rustix::io::Errno;
