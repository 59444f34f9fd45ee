//! What drives the robot, samples of odometry and of a gyro on a bus, and waits for the estimator.

use coloc_drivers::encoder::GyroReading;
use coloc_estimator::{GyroSample, Measurement, OdometrySample, Origin, Span, Stamp, TickInputs};
use coloc_shm_types::Input;

use super::list::List;
use crate::account::Account;
use crate::config::{self, Config};
use crate::pace::{Arrival, Arrivals};

/// The estimator takes so many samples at once: 64 ticks' worth at the usual rate. If there are more, it takes the next
/// ones in another step, before the tick's own.
pub const SAMPLES: usize = 64;

/// And so many of a gyro: a quarter of a second at 1 kHz, as long as they may wait.
const TURNS: usize = 256;

/// Together.
pub const WAITING: usize = SAMPLES + TURNS;

/// The way since the estimator's last step.
#[derive(Debug)]
pub struct Way {
    samples: List<Measurement>,
    /// How many of them are of odometry.
    moves: usize,
    /// How many a gyro has said, ever.
    turns: u64,
    /// Radians for one that a gyro reads.
    gyro_scale: f64,
    /// They wait no longer, or the history might begin after them.
    patience: Span,
    /// There was one since the last tick.
    had_samples: bool,
    /// Stamps of the newest sample and of the one before \[ns\]; 0 if there was none.
    newest_ns: [i64; 2],
    arrivals: Arrivals,
}

/// How a sample has come.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Via {
    /// In frames of a CAN bus.
    Bus,
    /// In a message.
    Message,
}

impl Way {
    /// None yet.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            samples: List::with_capacity(WAITING),
            moves: 0,
            turns: 0,
            gyro_scale: config.gyro.scale,
            patience: Span::from_nanos(config::nanos(config.history.length_s) / 4),
            had_samples: false,
            newest_ns: [0; 2],
            arrivals: Arrivals::default(),
        }
    }

    /// Whether another sample may be added before the estimator takes these.
    #[must_use]
    pub fn has_room(&self) -> bool {
        let is_full = self.samples.is_full() || self.moves >= SAMPLES;
        !is_full && !self.spans_more_than(self.patience)
    }

    /// Whether all that waits can wait for the tick at `now`.
    #[must_use]
    pub fn can_wait(&self, now: Stamp) -> bool {
        let oldest = self.samples.as_slice().first();
        oldest.is_none_or(|oldest| now - oldest.stamp() <= self.patience)
    }

    /// One more.
    pub fn push(&mut self, sample: OdometrySample, via: Via, account: &mut Account) {
        self.arrivals.push(Arrival {
            at_ns: sample.stamp.as_nanos(),
            by_bus: via == Via::Bus,
        });
        account.valid(Input::Odometry, sample.source, sample.stamp);
        let [newest_ns, _] = self.newest_ns;
        if sample.stamp.as_nanos() > newest_ns {
            self.newest_ns = [sample.stamp.as_nanos(), newest_ns];
        }
        self.had_samples |= self.samples.push(sample.into());
        self.moves += 1;
    }

    /// One more of the gyro.
    pub fn turn(&mut self, reading: &GyroReading, account: &mut Account) {
        let stamp = Stamp::from_nanos(reading.stamp_ns);
        account.valid(Input::Gyro, 0, stamp);
        self.turns += 1;
        let sample = GyroSample {
            stamp,
            origin: Origin::counted(self.turns),
            rate_radps: self.gyro_scale * reading.rate_radps,
            noise: 0.0,
        };
        let _ = self.samples.push(sample.into()); // There is room, or it was not asked.
    }

    /// When the last ones have come.
    #[must_use]
    pub fn arrivals(&self) -> &Arrivals {
        &self.arrivals
    }

    /// Whether there was a sample since the last tick.
    #[must_use]
    pub fn had_samples(&self) -> bool {
        self.had_samples
    }

    /// Those that wait, as inputs up to the newest of them, but no further than `now`: a base may be ahead of the clock a little.
    /// `None` if there are none.
    #[must_use]
    pub fn inputs(&self, now: Stamp) -> Option<TickInputs<'_>> {
        let measurements = self.samples.as_slice();
        let newest = measurements.iter().map(Measurement::stamp).max()?;
        Some(TickInputs {
            stamp: newest.min(now),
            measurements,
        })
    }

    /// Puts them into a list that has room for [`WAITING`].
    pub fn gather(&mut self, into: &mut List<Measurement>) {
        for sample in self.samples.as_slice() {
            let _ = into.push(*sample);
        }
        self.taken();
    }

    /// The estimator has taken them.
    pub fn taken(&mut self) {
        self.samples.clear();
        self.moves = 0;
    }

    /// The tick is over.
    pub fn clear(&mut self) {
        self.had_samples = false;
    }

    /// Stamp of the newest sample up to `stamp` \[ns\]; 0 if there was none. The very newest may have come after the
    /// tick's stamp was read: it is the next tick's.
    #[must_use]
    pub fn newest_ns(&self, stamp: Stamp) -> i64 {
        let [newest, before] = self.newest_ns;
        if newest <= stamp.as_nanos() {
            newest
        } else {
            before
        }
    }

    /// From the first sample to the last.
    fn spans_more_than(&self, limit: Span) -> bool {
        match self.samples.as_slice() {
            [first, .., last] => last.stamp() - first.stamp() > limit,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use coloc_estimator::Motion;
    use coloc_shm_types::{Clock, Sender};

    use super::*;
    use crate::event::Link;

    #[test]
    fn a_step_ahead_of_the_tick_is_never_ahead_of_the_clock() {
        let text = "[robot]\nname = \"a\"\nid = 1\n";
        let config = Config::parse(text, Path::new("a.toml")).unwrap();
        let sender = Sender::start(1, Clock::Boottime).unwrap();
        let mut account = Account::new(&config, Arc::new(Link::new()), &sender);
        let mut way = Way::new(&config);
        let at = |millis| Stamp::default() + Span::from_millis(millis);
        assert!(way.inputs(at(100)).is_none());
        for (start, stamp) in [(0, 20), (40, 60), (20, 40)] {
            let sample = OdometrySample {
                source: 0,
                start: at(start),
                stamp: at(stamp),
                motion: Motion::standstill([1.0; 3]),
            };
            way.push(sample, Via::Bus, &mut account);
        }
        let until = |now| way.inputs(at(now)).map(|it| it.stamp);
        assert_eq!([until(50), until(70)], [Some(at(50)), Some(at(60))]);
        assert_eq!(
            [way.newest_ns(at(60)), way.newest_ns(at(50))],
            [60, 20].map(|it| at(it).as_nanos())
        );
    }
}
