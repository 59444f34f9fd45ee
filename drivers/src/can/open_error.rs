//! Why a bus can't be opened.

use std::io;

use coloc_shm_types::advice::advised;
use rustix::io::Errno;

use super::candump::LogError;
use super::spec::BusSpec;

/// Why a bus can't be opened; trying again will not help.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The kernel was built without CAN, or its modules are not loaded.
    #[error(
        "this kernel offers no CAN sockets: load the modules can and can_raw, or use a local: bus"
    )]
    NoCan,
    /// The interface exists and is something else.
    #[error(
        "{0} names an interface that carries no CAN: 'ip -details link show' tells which ones do"
    )]
    NotCan(BusSpec),
    /// A log is read only.
    #[error("{0} is a recorded log: nothing can be sent there")]
    ReadOnly(BusSpec),
    /// The log can't be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Anything else that the system refused.
    #[error("can't open {bus}: {}", advised(.error))]
    System {
        /// The bus.
        bus: BusSpec,
        /// What the system said.
        error: io::Error,
    },
}

impl OpenError {
    pub(super) fn system(bus: &BusSpec, error: impl Into<io::Error>) -> Self {
        Self::System {
            bus: bus.clone(),
            error: error.into(),
        }
    }

    pub(super) fn interface(bus: &BusSpec, error: Errno) -> Self {
        match error {
            Errno::AFNOSUPPORT | Errno::PROTONOSUPPORT => Self::NoCan,
            Errno::OPNOTSUPP => Self::NotCan(bus.clone()),
            error => Self::system(bus, error),
        }
    }
}
