//! Standard output and standard error, either of which may be a closed pipe or a full disk. Nothing here panics; what a
//! command was asked for on standard output and could not say shows in its exit status.

use std::io::{self, Write, stderr, stdout};
use std::sync::OnceLock;

use crate::status::Status;

/// Why standard output takes no more.
enum Trouble {
    /// Its reader has seen enough.
    ReaderGone,
    /// Something else, such as a full disk.
    Failed(io::Error),
}

/// There is one standard output; after its first failure nothing more is tried.
static TROUBLE: OnceLock<Trouble> = OnceLock::new();

/// Prints `text` as it is.
pub(crate) fn print(text: &str) {
    if TROUBLE.get().is_none() {
        let mut out = stdout().lock();
        note(out.write_all(text.as_bytes()).and_then(|()| out.flush()));
    }
}

/// Prints a line.
pub(crate) fn print_line(text: &str) {
    print(&format!("{text}\n"));
}

/// Keeps in mind how printing on standard output went.
pub(crate) fn note(result: io::Result<()>) {
    if let Err(error) = result {
        let trouble = match error.kind() {
            io::ErrorKind::BrokenPipe => Trouble::ReaderGone,
            _ => Trouble::Failed(error),
        };
        // The first one stays.
        let _ = TROUBLE.set(trouble);
    }
}

/// Whether nobody will ever see what is printed from here on.
pub(crate) fn takes_no_more() -> bool {
    TROUBLE.get().is_some()
}

/// Prints a line on standard error. Nobody is left to tell if that fails.
pub(crate) fn complain(text: &str) {
    let _ = stderr().write_all(format!("{text}\n").as_bytes());
}

/// The status of a command that ended with `status`, once it is known whether all of its output went out.
pub(crate) fn settle(status: Status) -> Status {
    match (TROUBLE.get(), status) {
        (Some(Trouble::Failed(error)), _) => {
            complain(&format!("coloc: cannot write to standard output: {error}"));
            Status::Failed
        }
        (Some(Trouble::ReaderGone), Status::Done) => Status::ReaderGone,
        _ => status,
    }
}
