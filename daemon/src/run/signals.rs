//! What the outside asks for by signals, and when there is nothing left to wait for.

use std::io;

use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
use signal_hook::iterator::{Handle, Signals};
use signal_hook::low_level::signal_name;

use crate::config::Config;

/// Something that was asked for.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Call {
    /// To open the log again.
    Hangup,
    /// To end, by the signal of this name.
    End(&'static str),
}

/// Signals, one after the other.
pub(super) struct Calls {
    signals: Signals,
    hangup_reopens: bool,
}

impl Calls {
    /// Handles them from now on.
    ///
    /// A hangup means "open the log again" where there is a file to open. Else it means that the terminal went away, and
    /// ends the daemon, unless it was started to outlive its terminal (`nohup` has the signal ignored).
    pub(super) fn listen(config: &Config) -> io::Result<Self> {
        let hangup_reopens = !config.telemetry.log_file.as_os_str().is_empty();
        let mut wanted = vec![SIGTERM, SIGINT, SIGQUIT];
        if hangup_reopens || !hangup_is_ignored() {
            wanted.push(SIGHUP);
        }
        Ok(Self {
            signals: Signals::new(wanted)?,
            hangup_reopens,
        })
    }

    /// The next one; `None` once [`Self::closer`]'s function was called.
    pub(super) fn next(&mut self) -> Option<Call> {
        let signal = self.signals.forever().next()?;
        Some(if signal == SIGHUP && self.hangup_reopens {
            Call::Hangup
        } else {
            Call::End(signal_name(signal).unwrap_or("a signal"))
        })
    }

    /// Ends the waiting.
    pub(super) fn closer(&self) -> impl FnOnce() + Send + use<> {
        let handle: Handle = self.signals.handle();
        move || handle.close()
    }
}

fn hangup_is_ignored() -> bool {
    std::fs::read_to_string("/proc/self/status").is_ok_and(|status| ignores(&status, SIGHUP))
}

/// Bit n − 1 of the mask is signal n.
fn ignores(status: &str, signal: i32) -> bool {
    status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_from_the_mask() {
        let status =
            "Name:\tcolocd\nSigBlk:\t0000000000000000\nSigIgn:\t0000000000001001\nSigCgt:\t0\n";
        assert!(ignores(status, SIGHUP) && !ignores(status, SIGTERM));
        assert!(!ignores("", SIGHUP));
    }
}
