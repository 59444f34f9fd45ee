//! Why the program ends, on standard error.

use std::io::{self, Write};
use std::sync::mpsc::channel;
use std::thread::Builder;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// How long whoever reads standard error may take.
const PATIENCE: Duration = Duration::from_millis(100);

/// On a thread of its own: a pipe that nobody reads must not keep the process.
pub(crate) fn say(words: String) {
    let (said, heard) = channel::<()>();
    let shared = std::sync::Arc::new(words);
    let words = std::sync::Arc::clone(&shared);
    let say = move || {
        let _said = said;
        write(&words);
    };
    match Builder::new().spawn(say) {
        // The other end is dropped when it is said.
        Ok(_) => drop(heard.recv_timeout(PATIENCE)),
        // There is no memory for a thread; that much is written at once, or not at all.
        Err(_) if takes_some() => write(&shared),
        Err(_) => {}
    }
}

fn write(words: &str) {
    // If this fails there is nowhere left to say so.
    let _ = io::stderr().write_all(words.as_bytes());
}

fn takes_some() -> bool {
    let stderr = io::stderr();
    let mut asked = [PollFd::new(&stderr, PollFlags::OUT)];
    let patience = Timespec::try_from(PATIENCE).ok();
    poll(&mut asked, patience.as_ref()).is_ok_and(|ready| ready > 0)
}
