//! Who is let in to prove a key, and who has to wait.
//!
//! A stranger costs the robot what it has to compute before the stranger has proved anything: a key exchange and a signature, a third of
//! a millisecond. So who knocks must first show that packets reach it, which costs us no memory and little more than its own packet; and
//! of those who did, only so many are heard at once. Handshakes never wait for one another.
use std::cell::Cell;
use std::net::IpAddr;
use std::rc::Rc;
use std::time::Duration;

use quinn::Incoming;

use super::{CallError, Line, PATIENCE};

/// So many prove their keys at once.
const AT_ONCE: usize = 192;
/// From so many on, who knocks must first show that packets reach it.
const BUSY: usize = 4;
/// And from so many on, it has this long to prove its key: a hundred a second who then say nothing more leave room for others.
const CROWDED: usize = 16;
const HURRIED: Duration = Duration::from_millis(1500);

/// Lets in.
#[derive(Clone, Debug, Default)]
pub struct Door {
    inside: Rc<Cell<usize>>,
    knocks: Rc<Cell<Knocks>>,
}

/// What came of knocks.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Knocks {
    /// Who proved a member's key.
    pub members: u64,
    /// Who proved none.
    pub strangers: u64,
    /// Who was sent away unheard, because too many knocked.
    pub unheard: u64,
    /// Who began and said nothing more.
    pub silent: u64,
}

impl Door {
    /// What came of all knocks so far.
    #[must_use]
    pub fn knocks(&self) -> Knocks {
        self.knocks.get()
    }

    fn note(&self, note: impl FnOnce(&mut Knocks)) {
        let mut knocks = self.knocks.get();
        note(&mut knocks);
        self.knocks.set(knocks);
    }

    /// Whether who knocks is heard. The rest is [`Self::hear`], in a task of its own.
    #[must_use]
    pub fn admits(&self, incoming: Incoming) -> Option<Guest> {
        let inside = self.inside.get();
        if inside >= AT_ONCE {
            self.note(|it| it.unheard += 1);
            incoming.ignore();
            return None;
        }
        if inside >= BUSY && !incoming.remote_address_validated() && incoming.may_retry() {
            // It comes back with a token, or never was there.
            let _ = incoming.retry();
            return None;
        }
        self.inside.set(inside + 1);
        Some(Guest {
            from: incoming.remote_address().ip(),
            incoming,
            _seat: Seat(Rc::clone(&self.inside)),
        })
    }

    /// Waits until the guest has proved its key.
    ///
    /// # Errors
    /// Where it came from, and why it is none.
    pub async fn hear(&self, guest: Guest) -> Result<Line, (IpAddr, CallError)> {
        let from = guest.from;
        let patience = if self.inside.get() < CROWDED {
            PATIENCE
        } else {
            HURRIED
        };
        let heard = async {
            let connecting = guest.incoming.accept()?;
            let proved = tokio::time::timeout(patience, connecting).await;
            Line::of(proved.map_err(|_| CallError::Silence)??)
        };
        let heard = heard.await;
        self.note(|it| match &heard {
            Ok(_) => it.members += 1,
            Err(CallError::Silence) => it.silent += 1,
            Err(_) => it.strangers += 1,
        });
        heard.map_err(|error| (from, error))
    }
}

/// Who is being heard.
#[derive(Debug)]
pub struct Guest {
    from: IpAddr,
    incoming: Incoming,
    _seat: Seat,
}

#[derive(Debug)]
struct Seat(Rc<Cell<usize>>);

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.set(self.0.get().saturating_sub(1));
    }
}
