//! The habits that all drivers of coloc share, so that each has only its sensor to understand.
//!
//! * **Where bytes come from** ([`input`]): a serial device that is pulled out and comes back, a TCP server or gpsd, a file or standard
//!   input, plain or gzip. What is lost is opened again, with a pause that grows ([`backoff`]).
//! * **A program that behaves** ([`program`]): it reads its section of `robot.toml`, is the only one of its kind ([`voice`]), takes in bytes
//!   ([`run`]) or what is said on channels ([`listen`]), ends at once when it is asked to ([`stop`]), with a status that says why ([`end`]), says
//!   at most one line a second ([`teller`]), and publishes how it is doing ([`status`]); asked, it prints that, and what its configuration
//!   means ([`page`]).
//! * **What is told on channels** is checked, known again if it was here before, and counted ([`hearing`]).
//! * **Nothing that comes in ends it.** A driver is given bytes, whole or not, and counts what it cannot use.

pub mod backoff;
pub mod end;
pub mod health;
pub mod hearing;
pub mod input;
pub mod listen;
pub mod moment;
pub mod pace;
pub mod page;
pub mod program;
pub mod run;
pub mod status;
pub mod stop;
pub mod teller;
pub mod voice;

pub use end::EndError;
pub use hearing::{Hearing, Refuses};
pub use input::{Input, InputSpec};
pub use moment::Moment;
pub use run::{Driver, Report};
pub use stop::Stop;
pub use voice::Voice;
