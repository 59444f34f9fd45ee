//! Whether whoever was started gives a sign of life: a daemon its first estimate, read by the witness; a reader that it
//! has read one; a feeder that it has sent something.

use std::process::ExitStatus;
use std::time::Duration;

use super::{Fleet, Started, Who};
use crate::bars::Bar;
use crate::fault::{Outcome, fault};

/// Within which whoever is started answers.
pub(crate) const ANSWER: Bar = Bar(Duration::from_secs(2));
/// Within which it is sent away, or works although something is missing.
const CHOICE: Bar = Bar(Duration::from_secs(4));
/// What is waited for beyond that, to see whether it is late or never comes.
pub(super) const PATIENCE: Bar = Bar(Duration::from_secs(10));
/// Between two looks at whether it has ended instead.
const STEP: Duration = Duration::from_millis(20);

/// What comes of a start where something is missing.
pub(crate) enum Answer {
    /// As ever.
    Works,
    /// It has ended, with a status and a sentence.
    Refuses(String),
}

impl Fleet {
    /// How long it took since it was started.
    pub(crate) fn answers(&mut self, started: &mut Started) -> Outcome<Duration> {
        let took = self.answers_at_last(started)?;
        let Started { program, .. } = started;
        let words = || {
            format!(
                "{} took {took:?} to answer{}",
                program.name(),
                program.words()
            )
        };
        ANSWER.hold(took, words)?;
        Ok(took)
    }

    /// However long it takes.
    pub(crate) fn answers_at_last(&mut self, started: &mut Started) -> Outcome<Duration> {
        match self.answers_or_ends(started)? {
            Ok(took) => Ok(took),
            Err(status) => fault!(
                "{} ended by itself, {status}{}",
                started.program.name(),
                started.program.words()
            ),
        }
    }

    /// It works, or says why not.
    pub(crate) fn answers_or_refuses(&mut self, started: &mut Started) -> Outcome<Answer> {
        let answer = match self.answers_or_ends(started)? {
            Ok(_) => Answer::Works,
            Err(status) => Answer::Refuses(started.program.refused(status)?),
        };
        let took = started.at.elapsed();
        CHOICE.hold(took, || {
            format!("{} took {took:?} to answer", started.program.name())
        })?;
        Ok(answer)
    }

    fn answers_or_ends(&mut self, started: &mut Started) -> Outcome<Result<Duration, ExitStatus>> {
        while started.at.elapsed() < PATIENCE.patience() {
            if let Some(took) = self.sign_of_life(started) {
                return Ok(Ok(took));
            }
            if let Some(status) = started.program.ended() {
                return Ok(Err(status));
            }
            self.look()?;
        }
        fault!(
            "{} did not answer within {PATIENCE:?}{}{}",
            started.program.name(),
            started.program.evidence(),
            self.evidence()
        )
    }

    fn sign_of_life(&self, started: &Started) -> Option<Duration> {
        if started.who != Who::Daemon {
            let _ready = started.program.line_if_any("ready", STEP)?;
            return Some(started.at.elapsed());
        }
        let watch = self.watch();
        let first_ns = watch.first_estimate(started.robot, started.realtime_ns, STEP)?;
        let took_ns = (first_ns - started.monotonic_ns).max(0).unsigned_abs();
        Some(Duration::from_nanos(took_ns))
    }
}
