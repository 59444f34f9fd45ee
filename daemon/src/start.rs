//! Why a daemon did not start.

use coloc_drivers::can;
use coloc_shm_types::advice::advised;
use coloc_shm_types::{NoGroup, OpenError, PortError};
use rustix::io::Errno;

use crate::config::ConfigError;
use crate::memory_limits::MemoryLimit;

/// Nothing was published yet; whatever was opened is closed again.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The configuration was refused.
    #[error("{0}")]
    Config(#[from] ConfigError),
    /// The shared memory cannot be entered, or the robot is run already.
    #[error("{0}")]
    Space(#[from] OpenError),
    /// `shm.group`.
    #[error("shm.group: {0}")]
    Group(#[from] NoGroup),
    /// A port cannot be opened.
    #[error("{0}")]
    Port(#[from] PortError),
    /// A bus cannot be opened.
    #[error("{0}")]
    Bus(#[from] can::OpenError),
    /// The wheels' signals cannot be decoded.
    #[error("odometry: {0}")]
    Odometry(#[from] coloc_drivers::encoder::ConfigError),
    /// The kernel refused a descriptor.
    #[error("the tick's timer cannot be set up: {}", advised(&(*.0).into()))]
    Wait(#[from] Errno),
    /// The process would not have the memory that it takes.
    #[error(
        "{} of {limit_mib} MiB is too small, colocd takes up to {needed_mib} MiB: raise the limit ({})",
        .limit.name(), .limit.setting()
    )]
    Memory {
        /// Which.
        limit: MemoryLimit,
        /// The limit \[MiB\].
        limit_mib: u64,
        /// What it should be at least \[MiB\].
        needed_mib: u64,
    },
    /// `realtime.required`, and not granted.
    #[error("realtime.required = true, but {0}")]
    Realtime(String),
    /// A thread cannot be had.
    #[error(
        "a thread cannot be started: {0}; allow more processes (ulimit -u; LimitNPROC=, TasksMax= in a unit)"
    )]
    Thread(std::io::Error),
    /// A signal handler or a descriptor.
    #[error("{what}: {}", advised(.error))]
    System {
        /// What was tried.
        what: &'static str,
        /// What the system said.
        error: std::io::Error,
    },
}
