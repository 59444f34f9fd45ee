//! Finding the daemons that somebody else has started for the demo's robots.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

/// The process that runs the robot described in `file`. The file's path is unique to this demo, so its name on a command
/// line is proof enough.
pub(crate) fn running(file: &Path) -> Option<u32> {
    let processes = std::fs::read_dir("/proc").ok()?.flatten();
    let numbers = processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    numbers
        .filter(|pid| command_line(*pid).is_some_and(|line| runs(&line, file.as_os_str())))
        .max()
}

/// Nothing for a process that is gone, or dead and not yet waited for.
fn command_line(pid: u32) -> Option<Vec<u8>> {
    std::fs::read(format!("/proc/{pid}/cmdline")).ok()
}

/// `… run FILE`, each word ended by a zero.
fn runs(command_line: &[u8], file: &OsStr) -> bool {
    let mut words = command_line
        .strip_suffix(b"\0")
        .unwrap_or(command_line)
        .rsplit(|byte| *byte == 0);
    words.next() == Some(file.as_bytes()) && words.next() == Some(b"run")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_who_runs_that_very_file_is_found() {
        let file = OsStr::new("/tmp/demo/robot1.toml");
        assert!(runs(b"coloc\0colocd\0run\0/tmp/demo/robot1.toml\0", file));
        assert!(!runs(
            b"coloc\0colocd\0check\0/tmp/demo/robot1.toml\0",
            file
        ));
        assert!(!runs(b"coloc\0colocd\0run\0/tmp/demo/robot2.toml\0", file));
        assert!(!runs(b"", file));
        assert_eq!(running(Path::new("/nonexistent/robot1.toml")), None);
    }
}
