//! Standard output of this workspace's own programs: it may be a closed pipe or a full disk, and nothing panics for that;
//! nor where no directory can be made for them.

use std::io::{self, Write, stderr, stdout};
use std::process::ExitCode;
use std::sync::OnceLock;

/// There is one standard output; after its first failure nothing more is tried.
static TROUBLE: OnceLock<io::Error> = OnceLock::new();

/// What a shell says of a program that was ended because its reader had gone.
const READER_GONE: u8 = 141;

/// Prints a line on standard output.
pub fn print_line(text: &str) {
    if TROUBLE.get().is_none()
        && let Err(error) = stdout().write_all(format!("{text}\n").as_bytes())
    {
        // It is the first.
        let _ = TROUBLE.set(error);
    }
}

/// Prints a line on standard error. Nobody is left to tell if that fails.
pub fn complain(text: &str) {
    let _ = stderr().write_all(format!("{text}\n").as_bytes());
}

/// Whether programs can have directories of their own, for as long as they run.
///
/// # Errors
/// Why not, and what to do about it.
pub fn check_place() -> Result<(), String> {
    let trouble = |error| {
        let place = std::env::temp_dir();
        let place = place.display();
        format!("no directory can be made in {place} ({error}): choose another place with TMPDIR")
    };
    tempfile::tempdir().map(drop).map_err(trouble)
}

/// How `program` ends: as its `result` says if all of its output went out.
pub fn end(program: &str, result: Result<ExitCode, Box<dyn std::error::Error>>) -> ExitCode {
    match (result, TROUBLE.get()) {
        (Err(error), _) => {
            complain(&format!("{program}: {error}"));
            ExitCode::FAILURE
        }
        (Ok(_), Some(error)) if error.kind() == io::ErrorKind::BrokenPipe => {
            ExitCode::from(READER_GONE)
        }
        (Ok(_), Some(error)) => {
            complain(&format!(
                "{program}: cannot write to standard output: {error}"
            ));
            ExitCode::FAILURE
        }
        (Ok(status), None) => status,
    }
}
