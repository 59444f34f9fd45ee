//! What a person can do about an error of the system's, where that does not depend on what was tried.
use std::io;

use rustix::io::Errno;

/// Too few descriptors.
pub(crate) const FILES: &str = "allow more open files (ulimit -n; LimitNOFILE= in a unit)";

/// The error, with the advice that there is.
#[must_use]
pub fn advised(error: &io::Error) -> String {
    match Errno::from_io_error(error) {
        Some(Errno::MFILE) => format!("{error}; {FILES}"),
        Some(Errno::FBIG) => {
            format!("{error}; allow larger files (ulimit -f; LimitFSIZE= in a unit)")
        }
        Some(Errno::NFILE) => format!("{error}; {FILES}, in the whole system (sysctl fs.file-max)"),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_has_one_remedy_is_advised() {
        assert!(advised(&Errno::MFILE.into()).ends_with("(ulimit -n; LimitNOFILE= in a unit)"));
        assert!(advised(&Errno::FBIG.into()).ends_with("(ulimit -f; LimitFSIZE= in a unit)"));
        assert!(advised(&Errno::NFILE.into()).contains("fs.file-max"));
        assert!(!advised(&Errno::ACCESS.into()).contains("ulimit"));
    }
}
