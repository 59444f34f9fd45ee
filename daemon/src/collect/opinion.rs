//! What `coloc-bounds` says of the belief, where it is asked. It is no measurement: nothing is made of it but a word in the estimate.

use coloc_estimator::Stamp;
use coloc_shm_types::{
    Input, Integrity, Limits, Opinion, PortError, Reject, RobotName, Sessions, Space,
};

use super::messages::stamp;
use super::port::Port;
use crate::account::Account;
use crate::clock::Moment;

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const WORDS: usize = 4;

/// The subscriber, and what was heard last.
#[derive(Debug)]
pub(super) struct Opinions {
    port: Port<Integrity>,
    newest: Option<(Stamp, Opinion)>,
}

impl Opinions {
    /// Subscribes to the channel of `name`.
    pub(super) fn open(space: &Space, name: &RobotName) -> Result<Self, PortError> {
        Ok(Self {
            port: Port::open(space, name, (Input::Integrity, Sessions::SENSORS, WORDS))?,
            newest: None,
        })
    }

    pub(super) fn deaf(&self) -> Option<Input> {
        self.port.deaf()
    }

    pub(super) fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        self.port.tell_sessions(now, account);
    }

    pub(super) fn receive(&mut self, moment: &Moment, limits: &Limits<'_>, account: &mut Account) {
        while let Some((message, heard)) = self.port.next(moment, account, |it| word(it, limits)) {
            let source = message.header.source;
            match heard {
                Ok((at, opinion)) => {
                    account.valid(Input::Integrity, source, at);
                    if self.newest.is_none_or(|(before, _)| at >= before) {
                        self.newest = Some((at, opinion));
                    }
                }
                Err(reason) => self.port.refuse(source, reason, account),
            }
        }
    }

    /// The newest word, however old.
    pub(super) fn newest(&self) -> Opinion {
        self.newest.map_or(Opinion::None, |it| it.1)
    }

    pub(super) fn clear(&mut self) {
        self.port.clear();
    }
}

/// What it says, and of when.
///
/// # Errors
/// Why it says nothing of this robot.
fn word(message: &Integrity, limits: &Limits<'_>) -> Result<(Stamp, Opinion), Reject> {
    message.validate(limits)?;
    if message.robot != limits.own {
        return Err(Reject::UnknownRobot);
    }
    Ok((stamp(message), Opinion::of_state(message.state)))
}
