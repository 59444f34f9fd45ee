//! The life of a program that listens to channels: wait, let it hear and speak, say how it is doing, until asked to end.

use std::os::fd::BorrowedFd;
use std::time::Duration;

use crate::end::EndError;
use crate::run::Report;
use crate::stop::{Stop, Woken};
use crate::voice::Voice;

/// What listens to channels, and speaks on others.
pub trait Listener {
    /// Readable once something has come that it waits for; none where it looks from time to time.
    ///
    /// # Errors
    /// If a channel is lost.
    fn bell(&self) -> Result<Option<BorrowedFd<'_>>, EndError>;

    /// Takes in what has come, and says what there is to say of it; of how many bytes it was.
    ///
    /// # Errors
    /// If it cannot go on.
    fn turn(&mut self) -> Result<u64, EndError>;

    /// What it has to tell of itself.
    fn report(&self) -> Report;

    /// What a person should hear, since it was last asked.
    fn remarks(&mut self) -> Vec<String>;
}

/// Lets `listener` live until it is asked to end. It is woken by its bell, and after `patience` at the latest.
///
/// # Errors
/// Why it could not go on.
pub fn listen(
    listener: &mut impl Listener,
    patience: Duration,
    stop: &Stop,
    voice: &mut Voice<'_>,
) -> Result<(), EndError> {
    (voice.line.is_open, voice.line.opened) = (true, 1);
    let ended = turns(listener, patience, stop, voice);
    voice.finish();
    ended
}

fn turns(
    listener: &mut impl Listener,
    patience: Duration,
    stop: &Stop,
    voice: &mut Voice<'_>,
) -> Result<(), EndError> {
    loop {
        let woken = stop.wait(listener.bell()?, patience);
        if woken.map_err(EndError::of("it cannot be waited"))? == Woken::Stop {
            return Ok(());
        }
        voice.line.bytes += listener.turn()?;
        voice.say(&listener.report(), listener.remarks())?;
    }
}
