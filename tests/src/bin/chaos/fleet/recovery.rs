//! What must be so after somebody was harmed.

use std::thread::sleep;
use std::time::{Duration, Instant};

use rand::RngExt;

use super::{ANSWER, Fleet, OTHER, VICTIM, Who};
use crate::bars::Bar;
use crate::fault::{Outcome, fault};
use crate::rounds::Round;
use crate::watch::Book;

/// Longest time between two ticks of a robot that nobody harms.
const GAP: Bar = Bar(Duration::from_secs(1));

impl Fleet {
    /// The other robot ticks, now and ever since its book was taken.
    pub(crate) fn other_goes_on(&mut self) -> Outcome<Book> {
        self.look()?;
        if !self.ticks_now(OTHER) {
            fault!("robot2 is not heard for {ANSWER:?}{}", self.evidence());
        }
        let book = self.watch().take_book(OTHER);
        let longest = Duration::from_nanos(book.longest_ns.unsigned_abs());
        GAP.hold(longest, || format!("robot2 did not tick for {longest:?}"))?;
        Ok(book)
    }

    /// After `who` was killed: others can come and be sent away, it can come back and end, and all is as before.
    pub(crate) fn recovers(&mut self, who: Who, start: Duration, round: &mut Round<'_>) -> Outcome {
        if round.chance.random_ratio(1, 3) {
            self.is_sent_away(start, round)?;
        }
        let mut again = self.start(who, VICTIM);
        let took = self.answers(&mut again)?;
        if who == Who::Daemon {
            round.tally.restarts.push(took);
        }
        round.tally.ends.push(again.program.terminate()?);
        self.other_goes_on()?;
        let (files, held) = (self.files(), self.held());
        self.litter.look(files, &held)
    }

    /// Somebody comes, and is to end at once.
    fn is_sent_away(&self, start: Duration, round: &mut Round<'_>) -> Outcome {
        let mut visitor = self.start(Who::any(&mut round.chance), VICTIM);
        sleep(start.mul_f64(round.chance.random()));
        round.tally.ends.push(visitor.program.terminate()?);
        Ok(())
    }

    /// Waits until there are no more files than `most`.
    pub(crate) fn settles_to(&self, most: usize) -> Outcome {
        let deadline = Instant::now() + ANSWER.patience();
        while self.files().len() > most {
            if Instant::now() > deadline {
                fault!("{} files, {most} before the kills", self.files().len());
            }
            sleep(Duration::from_millis(20));
        }
        Ok(())
    }
}
