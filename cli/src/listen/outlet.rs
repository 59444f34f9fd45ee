//! Standard output, asked before it is written to: a reader that stalls must not keep this from ending, and one that has gone
//! is noticed while there is nothing to say.

use std::io::{ErrorKind, stdout};
use std::os::fd::BorrowedFd;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::output::note;

/// Whether a line can be written without waiting: a pipe has room for 4096 bytes then.
pub(super) fn is_ready() -> bool {
    ask(PollFlags::OUT, Duration::ZERO).intersects(PollFlags::OUT | PollFlags::ERR)
}

/// Sleeps, but no longer than there is a reader.
pub(super) fn pause(time: Duration) {
    look_after(ask(PollFlags::empty(), time));
}

/// The same, but no longer than until `bell` rings.
pub(super) fn pause_until(bell: BorrowedFd<'_>, time: Duration) {
    let out = stdout();
    let mut asked = [
        PollFd::new(&out, PollFlags::empty()),
        PollFd::from_borrowed_fd(bell, PollFlags::IN),
    ];
    look_after(poll_for(&mut asked, time));
}

fn look_after(found: PollFlags) {
    if found.intersects(PollFlags::ERR | PollFlags::HUP) {
        note(Err(ErrorKind::BrokenPipe.into()));
    }
}

fn ask(events: PollFlags, time: Duration) -> PollFlags {
    let out = stdout();
    poll_for(&mut [PollFd::new(&out, events)], time)
}

/// What there is of the first. Nothing if a signal came between.
fn poll_for(asked: &mut [PollFd<'_>], time: Duration) -> PollFlags {
    let time = Timespec::try_from(time).ok();
    match (poll(asked, time.as_ref()), asked.first()) {
        (Ok(_), Some(first)) => first.revents(),
        _ => PollFlags::empty(),
    }
}
