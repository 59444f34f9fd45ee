//! Where log lines go, and how events read.

use std::fs::OpenOptions;
use std::io;
use std::sync::Mutex;

use tracing::{debug, info, level_filters::LevelFilter, warn};
use tracing_subscriber::fmt::writer::BoxMakeWriter;

use crate::config::{self, LogLevel};
use crate::event::Event;
use coloc_shm_types::Health;

/// Opens the log for the whole process.
///
/// # Errors
/// If the file cannot be opened.
pub fn open_log(config: &config::Telemetry) -> io::Result<()> {
    let to_file = !config.log_file.as_os_str().is_empty();
    let writer = if to_file {
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&config.log_file)?;
        BoxMakeWriter::new(Mutex::new(file))
    } else {
        BoxMakeWriter::new(io::stderr)
    };
    let subscriber = tracing_subscriber::fmt()
        .with_max_level(level(config.log))
        .with_target(false)
        .with_ansi(false)
        .with_writer(writer);
    // A program that has a log already (a test, a tool that runs daemons as threads) keeps it.
    let _ = subscriber.try_init();
    Ok(())
}

fn level(level: LogLevel) -> LevelFilter {
    match level {
        LogLevel::Error => LevelFilter::ERROR,
        LogLevel::Warn => LevelFilter::WARN,
        LogLevel::Info => LevelFilter::INFO,
        LogLevel::Debug => LevelFilter::DEBUG,
        LogLevel::Trace => LevelFilter::TRACE,
    }
}

/// One line for an event that is a line by itself.
pub(super) fn log(event: &Event) {
    match event {
        Event::Health {
            input,
            from,
            to: to @ Health::Ok,
            tick,
        } => info!(tick, "{input}: {from} -> {to}"),
        Event::Health {
            input,
            from,
            to,
            tick,
        } => warn!(tick, "{input}: {from} -> {to}"),
        Event::Bus { from, to } => warn!("can: {from} -> {to}"),
        Event::Missed {
            deadlines,
            lateness_ns,
        } => warn!(deadlines, lateness_ns, "deadline missed"),
        Event::ClockStepped { shift_ns: 0 } => warn!(
            "the clock of the frame stamps was stepped; frames of this tick are stamped by their read"
        ),
        Event::ClockStepped { shift_ns } => warn!(
            shift_ns,
            "the clock was stepped; the belief goes on, the history was dropped"
        ),
        Event::NoRoom {
            overflowed,
            folded_early,
        } => {
            warn!(
                overflowed,
                folded_early, "the estimator ran out of room: raise history.capacity"
            );
        }
        other => debug!("{other:?}"),
    }
}
