//! How a command ends.

use std::process::ExitCode;

/// The exit statuses of `coloc`. `coloc colocd …` ends with those of the daemon.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    /// Done, and every bar was met.
    Done,
    /// It could not be done, a bar or promise was missed, or a result could not be written.
    Failed,
    /// The arguments make no sense.
    NotUnderstood,
    /// A person, or the system, ended it early by this signal; what was seen until then was said.
    Interrupted(i32),
    /// Whoever read standard output had seen enough; everything else was done.
    ReaderGone,
}

/// A shell's word for a process that a signal ended, to which the signal's number is added.
const BY_SIGNAL: u8 = 128;

impl Status {
    fn number(self) -> u8 {
        let by = |signal| BY_SIGNAL.saturating_add(u8::try_from(signal).unwrap_or(0));
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::NotUnderstood => 2,
            Self::Interrupted(signal) => by(signal),
            Self::ReaderGone => by(signal_hook::consts::SIGPIPE),
        }
    }
}

impl From<Status> for ExitCode {
    fn from(status: Status) -> Self {
        Self::from(status.number())
    }
}

#[cfg(test)]
mod tests {
    use super::Status;

    #[test]
    fn signals_end_a_command_as_a_shell_would_say_it() {
        assert_eq!(Status::Interrupted(2).number(), 130);
        assert_eq!(Status::ReaderGone.number(), 141);
        assert_eq!(Status::Interrupted(-1).number(), 128);
    }
}
