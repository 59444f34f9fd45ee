//! Whether the process may have as much memory as it takes.

use rustix::process::{Resource, getrlimit};

use crate::start::StartError;

/// What a limit is called, and where it is set.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum MemoryLimit {
    /// Of addresses.
    Addresses,
    /// Of memory that can be written.
    Data,
}

impl MemoryLimit {
    /// As in a sentence.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Addresses => "an address space",
            Self::Data => "a data segment",
        }
    }

    /// Who raises it.
    pub(crate) fn setting(self) -> &'static str {
        match self {
            Self::Addresses => "ulimit -v; LimitAS= in a unit",
            Self::Data => "ulimit -d; LimitDATA= in a unit",
        }
    }

    fn resource(self) -> Resource {
        match self {
            Self::Addresses => Resource::As,
            Self::Data => Resource::Data,
        }
    }

    /// A daemon with all its threads takes up to 471 MiB of addresses, of which 22 are used: the C library sets 64 MiB aside for each
    /// thread that allocates, and twice that for a moment. Where it cannot, it tries again in every allocation, which makes them slow;
    /// and where even what is used is missing, the process dies without a word.
    fn needed_mib(self) -> u64 {
        match self {
            Self::Addresses => 512,
            Self::Data => 32,
        }
    }

    fn check(self) -> Result<(), StartError> {
        let needed_mib = self.needed_mib();
        match getrlimit(self.resource()).current.map(|limit| limit >> 20) {
            Some(limit_mib) if limit_mib < needed_mib => Err(StartError::Memory {
                limit: self,
                limit_mib,
                needed_mib,
            }),
            _ => Ok(()),
        }
    }
}

/// # Errors
/// If there is a limit, and it is lower than that.
pub(crate) fn check() -> Result<(), StartError> {
    MemoryLimit::Addresses.check()?;
    MemoryLimit::Data.check()
}
