//! Standard output, asked before it is written to: a reader that stalls must not keep this from ending, and one that has gone
//! is noticed while there is nothing to say.

use std::io::{ErrorKind, stdout};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::output::note;

/// Whether a line can be written without waiting: a pipe has room for 4096 bytes then.
pub(super) fn is_ready() -> bool {
    ask(PollFlags::OUT, Duration::ZERO).intersects(PollFlags::OUT | PollFlags::ERR)
}

/// Sleeps, but no longer than there is a reader.
pub(super) fn pause(time: Duration) {
    let gone = PollFlags::ERR | PollFlags::HUP;
    if ask(PollFlags::empty(), time).intersects(gone) {
        note(Err(ErrorKind::BrokenPipe.into()));
    }
}

/// Nothing if a signal came between.
fn ask(events: PollFlags, time: Duration) -> PollFlags {
    let out = stdout();
    let mut asked = [PollFd::new(&out, events)];
    let time = Timespec::try_from(time).ok();
    match poll(&mut asked, time.as_ref()) {
        Ok(_) => asked[0].revents(),
        Err(_) => PollFlags::empty(),
    }
}
