//! Why there is no odometry: within two seconds a line that says what is heard on the buses and of the base, what was expected,
//! and what was refused and why; again every five seconds, while it lasts.
//!
//! The kernel hands the daemon's own sockets the wanted frames alone. So a thread of its own listens in through others, for
//! a fifth of a second and only when the wanted ones do not come: what it hears costs the tick nothing.

mod report;

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use coloc_drivers::can::{BusSpec, Heard, OpenError, listen};
use coloc_drivers::encoder::{Expected, describe};
use tracing::warn;

use crate::config::Config;
use crate::event::Link;
use crate::hearing::Reception;
use report::Report;

/// No robot's encoders pause for so long.
const SILENCE: Duration = Duration::from_millis(1200);

/// From one line to the next.
const PERIOD: Duration = Duration::from_secs(5);

/// Long enough to hear everything that is sent five times a second.
const LISTENED: Duration = Duration::from_millis(200);

/// What was heard on each bus.
type Answer = Vec<Result<Heard, OpenError>>;

/// Watches over the wheels.
pub(super) struct Listening {
    link: Arc<Link>,
    buses: Vec<BusSpec>,
    /// The channel on which a base should speak, if one should.
    base: Option<String>,
    expected: Vec<Expected>,
    silence: Silence,
    /// Brings what was heard.
    ear: Option<Receiver<Answer>>,
}

/// How long there has been no odometry, and when that was last said.
#[derive(Debug)]
struct Silence {
    since: Option<Instant>,
    /// As it was when the last sample had just come.
    before: Reception,
    said: Option<Instant>,
}

impl Listening {
    /// None where there are no wheels.
    pub(super) fn new(config: &Config, link: Arc<Link>) -> Option<Self> {
        let odometry = config.odometry.as_ref()?;
        let before = link.hearing.reception();
        Some(Self {
            link,
            buses: odometry.buses.clone(),
            base: odometry
                .base
                .as_ref()
                .map(|_| format!("coloc/{}/odometry", config.robot.name)),
            // It was checked with the configuration; if the DBC file has gone since, less is said.
            expected: describe(odometry).map(|it| it.expected).unwrap_or_default(),
            silence: Silence::new(before),
            ear: None,
        })
    }

    /// Speaks up if there is a reason, at `now`.
    pub(super) fn look(&mut self, now: Instant) {
        if self.link.last_beat() == 0 {
            return;
        }
        let due = self.silence.is_due(self.link.hearing.reception(), now);
        match &self.ear {
            None if due => self.ear = Some(self.start()),
            None => {}
            Some(ear) => match ear.try_recv() {
                Err(TryRecvError::Empty) => {}
                Ok(answer) => self.answer(&answer, due, now),
                Err(TryRecvError::Disconnected) => self.answer(&Vec::new(), due, now),
            },
        }
    }

    /// Waits for who listens in, so that no socket of it is left behind.
    pub(super) fn finish(self) {
        if let Some(ear) = self.ear {
            let _ = ear.recv_timeout(2 * LISTENED);
        }
    }

    /// Without a thread to be had nothing is heard; the rest is said all the same.
    fn start(&self) -> Receiver<Answer> {
        let (heard, ear) = channel();
        let buses = self.buses.clone();
        let body = move || {
            // Who does not wait any more has ended.
            let _ = heard.send(listen(&buses, LISTENED));
        };
        let _ = Builder::new().name("colocd-ear".into()).spawn(body);
        ear
    }

    fn answer(&mut self, answer: &Answer, due: bool, now: Instant) {
        self.ear = None;
        if due {
            self.silence.said = Some(now);
            let report = self.report(answer, now);
            warn!("{report}");
        }
    }

    fn report<'a>(&'a self, answer: &'a Answer, now: Instant) -> Report<'a> {
        let since = self.silence.since.unwrap_or(now);
        Report {
            silent: now.saturating_duration_since(since),
            buses: &self.buses,
            base: self.base.as_deref(),
            states: (0..self.buses.len())
                .map(|bus| self.link.hearing.state(bus))
                .collect(),
            expected: &self.expected,
            heard: answer,
            reception: self.link.hearing.reception().since(&self.silence.before),
        }
    }
}

impl Silence {
    fn new(before: Reception) -> Self {
        Self {
            since: None,
            before,
            said: None,
        }
    }

    /// Whether it is time to say something, by what has been received until `now`.
    fn is_due(&mut self, reception: Reception, now: Instant) -> bool {
        let came = reception.samples != self.before.samples;
        let since = *self.since.get_or_insert(now);
        if came {
            (self.since, self.before, self.said) = (Some(now), reception, None);
            return false;
        }
        let waited = |from: Instant, time| now.saturating_duration_since(from) >= time;
        waited(since, SILENCE) && self.said.is_none_or(|said| waited(said, PERIOD))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hearing::Hearing;

    /// When it is due, if a sample comes at each of `samples_ms` and it is asked every 50 ms for 20 s.
    fn due_ms(samples_ms: &[u64]) -> Vec<u64> {
        let start = Instant::now();
        let mut reception = Hearing::new().reception();
        let mut silence = Silence::new(reception.clone());
        let mut due_ms = Vec::new();
        for ms in (0..20_000).step_by(50) {
            reception.samples += samples_ms
                .iter()
                .filter(|&&at| at > ms && at <= ms + 50)
                .count() as u64;
            let now = start + Duration::from_millis(ms);
            if silence.is_due(reception.clone(), now) {
                silence.said = Some(now);
                due_ms.push(ms);
            }
        }
        due_ms
    }

    #[test]
    fn it_is_due_soon_and_then_every_five_seconds() {
        assert_eq!(due_ms(&[]), [1200, 6200, 11_200, 16_200]);
    }

    #[test]
    fn a_sample_begins_it_anew() {
        let steady: Vec<u64> = (0..20_000).step_by(20).collect();
        assert_eq!(due_ms(&steady), Vec::<u64>::new());
        let until = |end: u64| (0..end).step_by(20).collect::<Vec<_>>();
        assert_eq!(due_ms(&until(10_000))[0], 11_150);
        let with_one_more = [until(10_000), vec![12_010]].concat();
        assert_eq!(due_ms(&with_one_more), [11_150, 13_200, 18_200]);
    }
}
