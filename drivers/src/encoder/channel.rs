//! From what one sensor says to a velocity.

use super::count::Count;
use super::counter::{Cause, Counter, Reading};
use super::reject::FrameReject;
use super::said::Said;
use super::tolerance::{SHORTEST_INTERVAL_NS, seconds};

/// Part of the time from frame to frame in which frames of several wheels are of one moment: they are read together and sent
/// one after the other.
const ONE_MOMENT: f64 = 0.25;

/// A sensor that tells a part of the robot's motion.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Channel {
    measure: Measure,
    last_ns: Option<i64>,
    /// Shortest recent time between two frames: lost frames make it longer, a backlog is left out.
    period_ns: Option<i64>,
    /// A frame has come since the last sample.
    has_news: bool,
    /// Counter: distance since the last sample \[m\]. Rate: the newest velocity \[m/s or rad/s\].
    value: f64,
    /// Where counting began again: a way that began before that counts in part.
    began_ns: Option<i64>,
}

/// What it measures.
#[derive(Copy, Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "a robot has three of them at most"
)]
pub(super) enum Measure {
    /// A cumulative count.
    Counter(Counter),
    /// A velocity.
    Rate {
        /// From its unit to SI.
        scale: f64,
        /// The most that is plausible, in SI.
        limit: f64,
        /// It says nothing about a time longer than this before it.
        longest_s: f64,
    },
}

/// What was said, checked but not applied yet.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Update {
    Count(Count, Reading),
    Rate(f64),
}

/// Whether the time since the channel's last frame is covered.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Continuity {
    /// Nothing is missing.
    Continued,
    /// This was the first frame.
    Started,
    /// The counter was taken up again at another value.
    Resynchronised(Cause),
    /// A speed is not applied to so long a time.
    Gap,
}

impl Channel {
    pub(super) fn new(measure: Measure) -> Self {
        Self {
            measure,
            last_ns: None,
            period_ns: None,
            has_news: false,
            value: 0.0,
            began_ns: None,
        }
    }

    /// What comes of that, measured at `stamp_ns`.
    ///
    /// # Errors
    /// [`FrameReject::OutOfRange`] and [`FrameReject::Implausible`].
    pub(super) fn check(&mut self, said: Said, stamp_ns: i64) -> Result<Update, FrameReject> {
        match (said, &mut self.measure) {
            (Said::Count(raw), Measure::Counter(counter)) => {
                let count = Count { raw, stamp_ns };
                let reading = counter.read(count);
                if reading == Err(FrameReject::Implausible) {
                    counter.suspect(count);
                }
                reading.map(|reading| Update::Count(count, reading))
            }
            (Said::Rate(value), Measure::Rate { scale, limit, .. }) => {
                let rate = value * *scale;
                // Not-a-number is in no range.
                let plausible = (-*limit..=*limit).contains(&rate);
                plausible
                    .then_some(Update::Rate(rate))
                    .ok_or(FrameReject::Implausible)
            }
            // Who says it was planned together with the channel.
            _ => Err(FrameReject::OutOfRange),
        }
    }

    /// Applies what [`Self::check`] found.
    pub(super) fn accept(&mut self, update: Update, stamp_ns: i64) -> Continuity {
        let interval_ns = self.last_ns.map(|last_ns| stamp_ns.saturating_sub(last_ns));
        let share = self.share_of_way(stamp_ns);
        (self.last_ns, self.has_news) = (Some(stamp_ns), true);
        self.note_interval(interval_ns.unwrap_or(0));
        let continuity = self.apply(update, interval_ns, share);
        if interval_ns.is_none() {
            Continuity::Started
        } else {
            continuity
        }
    }

    fn note_interval(&mut self, interval_ns: i64) {
        if interval_ns >= SHORTEST_INTERVAL_NS {
            let longest_ns = self.period_ns.map_or(interval_ns, |period_ns| {
                period_ns.saturating_add(period_ns / 16)
            });
            self.period_ns = Some(interval_ns.min(longest_ns));
        }
    }

    /// How much of the way up to `stamp_ns` was driven since counting began again: its part of the time. What came within
    /// [`ONE_MOMENT`] of that beginning, before or after it, is of the same moment, and was only sent later.
    fn share_of_way(&mut self, stamp_ns: i64) -> f64 {
        let (Some(began_ns), Some(last_ns)) = (self.began_ns, self.last_ns) else {
            return 1.0;
        };
        if stamp_ns <= began_ns {
            return 0.0;
        }
        self.began_ns = None;
        let before = seconds(began_ns.saturating_sub(last_ns));
        let part = before / seconds(stamp_ns.saturating_sub(last_ns));
        match part {
            _ if part >= 1.0 - ONE_MOMENT => 0.0,
            _ if part > ONE_MOMENT => 1.0 - part,
            _ => 1.0,
        }
    }

    fn apply(&mut self, update: Update, interval_ns: Option<i64>, share: f64) -> Continuity {
        match (update, &mut self.measure) {
            (Update::Count(count, reading), Measure::Counter(counter)) => {
                counter.accept(count, reading);
                match reading {
                    Reading::Travelled(way_m) => self.value += way_m * share,
                    Reading::Resynchronised(cause) => return Continuity::Resynchronised(cause),
                }
            }
            (Update::Rate(rate), Measure::Rate { longest_s, .. }) => {
                self.value = rate;
                if interval_ns.is_some_and(|ns| seconds(ns) > *longest_s) {
                    return Continuity::Gap;
                }
            }
            _ => {}
        }
        Continuity::Continued
    }

    /// Velocity over the `dt_s` seconds since the last sample.
    pub(super) fn velocity(&self, dt_s: f64) -> f64 {
        match self.measure {
            Measure::Counter(_) => self.value / dt_s,
            Measure::Rate { .. } => self.value,
        }
    }

    /// How many seconds the way since the last sample takes at the highest speed.
    pub(super) fn least_s(&self) -> f64 {
        match self.measure {
            Measure::Counter(counter) => self.value.abs() / counter.max_speed_mps(),
            Measure::Rate { .. } => 0.0,
        }
    }

    /// A sample has been formed that says this much of the way, or the time before is given up.
    pub(super) fn begin_interval(&mut self, said: f64) {
        self.has_news = false;
        if let Measure::Counter(_) = self.measure {
            self.value = if said < 1.0 {
                self.value * (1.0 - said)
            } else {
                0.0
            };
        }
    }

    /// Counting begins again at `stamp_ns`, where all channels are of one moment.
    pub(super) fn begin_anew(&mut self, stamp_ns: i64) {
        self.began_ns = Some(stamp_ns);
    }

    /// Whether it says how far it has come, rather than how fast it is.
    pub(super) fn counts(&self) -> bool {
        matches!(self.measure, Measure::Counter(_))
    }

    /// Whether a frame has come since the last sample.
    pub(super) fn has_news(&self) -> bool {
        self.has_news
    }

    /// Stamp of the newest frame.
    pub(super) fn last_ns(&self) -> Option<i64> {
        self.last_ns
    }

    /// Time between two of its frames, as far as seen.
    pub(super) fn period_ns(&self) -> Option<i64> {
        self.period_ns
    }
}
