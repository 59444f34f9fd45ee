//! Being `colocd`: the same program under another name.

use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::process::ExitCode;

use rustix::process::{Signal, getppid, set_parent_process_death_signal};

use crate::output::complain;

/// Set by a command to its own process number: a process that finds it there ends with that one.
pub(crate) const PARENT_VARIABLE: &str = "COLOC_DEMO_PID";

pub(crate) const NAME: &str = "colocd";
/// The driver of laser scanners, which the demo starts beside it.
pub(crate) const LASER: &str = "coloc-laser";

/// The daemon's arguments, its name first, if this call is meant for the daemon.
pub(crate) fn arguments(args: impl Iterator<Item = OsString>) -> Option<Vec<OsString>> {
    let mut args: Vec<OsString> = args.collect();
    let called =
        args.first().and_then(|name| Path::new(name).file_name()) == Some(OsStr::new(NAME));
    let asked = args.get(1).is_some_and(|first| first == NAME);
    if asked && !called {
        args.remove(0);
    }
    (called || asked).then_some(args)
}

/// The whole daemon.
pub(crate) fn run(args: Vec<OsString>) -> ExitCode {
    if let Err(reason) = end_with_parent() {
        complain(&format!("colocd: {reason}"));
        return ExitCode::FAILURE;
    }
    coloc_daemon::main_from_args(args)
}

/// The daemon with `args` behind its name.
pub(crate) fn run_with(args: Vec<OsString>) -> ExitCode {
    run(std::iter::once(NAME.into()).chain(args).collect())
}

/// The driver of laser scanners, with `args` behind its name.
pub(crate) fn run_laser(args: Vec<OsString>) -> ExitCode {
    if let Err(reason) = end_with_parent() {
        complain(&format!("{LASER}: {reason}"));
        return ExitCode::FAILURE;
    }
    coloc_laser::program::main_from_args(std::iter::once(LASER.into()).chain(args))
}

/// `colocd check`.
pub(crate) fn check(config: &Path, strict: bool) -> ExitCode {
    let mut args = vec![OsStr::new(NAME), OsStr::new("check")];
    args.extend(strict.then_some(OsStr::new("--strict")));
    args.extend([OsStr::new("--"), config.as_os_str()]);
    coloc_daemon::main_from_args(args)
}

/// Has the kernel end this process when the command that started it is gone, even if that was killed.
pub(crate) fn end_with_parent() -> Result<(), String> {
    let Some(parent) = std::env::var_os(PARENT_VARIABLE) else {
        return Ok(());
    };
    set_parent_process_death_signal(Some(Signal::TERM)).map_err(|error| {
        format!("cannot follow the end of the command that started it: {error}")
    })?;
    // It may have ended before the line above; then nobody will send the signal.
    let now = getppid().map(|pid| pid.as_raw_nonzero().to_string());
    if now.as_deref().map(OsStr::new) == Some(&parent) {
        return Ok(());
    }
    Err("the command that started this process has ended".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments_of(args: &[&str]) -> Option<Vec<OsString>> {
        arguments(args.iter().map(OsString::from))
    }

    #[test]
    fn the_daemon_is_called_by_name_or_by_first_argument() {
        let wanted: Option<Vec<OsString>> = Some(vec!["colocd".into(), "run".into(), "a".into()]);
        assert_eq!(
            arguments_of(&["target/coloc", "colocd", "run", "a"]),
            wanted
        );
        let linked = arguments_of(&["/usr/bin/colocd", "run", "a"]).unwrap();
        assert_eq!(linked[1..], ["run", "a"]);
        assert_eq!(arguments_of(&["coloc", "demo"]), None);
        assert_eq!(arguments_of(&["coloc"]), None);
    }
}
