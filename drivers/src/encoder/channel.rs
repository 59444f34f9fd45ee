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
    /// Counter: distance since the last sample \[m\]. Rate: the newest velocity \[m/s or rad/s\]. Angle: the newest \[rad\].
    value: f64,
    /// Where counting began again: a way that began before that counts in part.
    began_ns: Option<i64>,
}

/// What it measures.
#[derive(Copy, Clone, Debug, PartialEq)]
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
    /// An angle of the moment of its frame.
    Angle {
        /// What its signal says of zero, in its unit.
        zero: f64,
        /// From its unit to radians.
        scale: f64,
        /// The most that is plausible \[rad\].
        limit: f64,
        /// It says nothing about a time longer than this before it.
        longest_s: f64,
        /// At the beginning of the interval.
        before: Beginning,
    },
}

/// An angle where an interval begins, and how it came there.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Beginning {
    angle_rad: f64,
    /// When that was.
    stamp_ns: Option<i64>,
    /// How fast it changed in the interval before, and how long that was \[rad/s, s\].
    came: Option<[f64; 2]>,
}

impl Beginning {
    /// How fast the angle changes until it is `angle_rad` at `last_ns`, and how long that takes \[rad/s, s\].
    fn goes(&self, angle_rad: f64, last_ns: Option<i64>) -> Option<[f64; 2]> {
        let dt_s = seconds(last_ns?.saturating_sub(self.stamp_ns?));
        (dt_s > 0.0).then(|| [(angle_rad - self.angle_rad) / dt_s, dt_s])
    }

    /// How much faster than in the interval before; 0 where that is not known \[rad/s²\].
    fn bend(&self, angle_rad: f64, last_ns: Option<i64>) -> f64 {
        let both = self.came.zip(self.goes(angle_rad, last_ns));
        both.map_or(0.0, |([came, before_s], [goes, dt_s])| {
            2.0 * (goes - came) / (before_s + dt_s)
        })
    }
}

/// What a channel says of an interval.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Part {
    /// A mean speed, or an angle at the end \[m/s, rad/s, rad\].
    pub(super) value: f64,
    /// The angle at the beginning; of a speed, the same.
    pub(super) before: f64,
    /// How much faster the angle changes than before \[rad/s²\].
    pub(super) bend: f64,
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
            (
                Said::Rate(value),
                Measure::Angle {
                    zero, scale, limit, ..
                },
            ) => {
                let angle = (value - *zero) * *scale;
                let plausible = (-*limit..=*limit).contains(&angle);
                plausible
                    .then_some(Update::Rate(angle))
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
            (
                Update::Rate(angle),
                Measure::Angle {
                    longest_s, before, ..
                },
            ) => {
                self.value = angle;
                let gap = interval_ns.is_some_and(|ns| seconds(ns) > *longest_s);
                if gap || interval_ns.is_none() {
                    *before = Beginning {
                        angle_rad: angle,
                        ..Beginning::default()
                    };
                }
                if gap {
                    return Continuity::Gap;
                }
            }
            _ => {}
        }
        Continuity::Continued
    }

    /// What it says of the `dt_s` seconds since the last sample.
    pub(super) fn part(&self, dt_s: f64) -> Part {
        let value = self.velocity(dt_s);
        let (before, bend) = match self.measure {
            Measure::Angle { before, .. } => (before.angle_rad, before.bend(value, self.last_ns)),
            Measure::Counter(_) | Measure::Rate { .. } => (value, 0.0),
        };
        Part {
            value,
            before,
            bend,
        }
    }

    /// Velocity over the `dt_s` seconds since the last sample.
    fn velocity(&self, dt_s: f64) -> f64 {
        match self.measure {
            Measure::Counter(_) => self.value / dt_s,
            Measure::Rate { .. } | Measure::Angle { .. } => self.value,
        }
    }

    /// How many seconds the way since the last sample takes at the highest speed.
    pub(super) fn least_s(&self) -> f64 {
        match self.measure {
            Measure::Counter(counter) => self.value.abs() / counter.max_speed_mps(),
            Measure::Rate { .. } | Measure::Angle { .. } => 0.0,
        }
    }

    /// A sample has been formed that says this much of the way, or the time before is given up.
    pub(super) fn begin_interval(&mut self, said: f64) {
        self.has_news = false;
        match &mut self.measure {
            Measure::Counter(_) => {
                self.value = if said < 1.0 {
                    self.value * (1.0 - said)
                } else {
                    0.0
                };
            }
            Measure::Angle { before, .. } => {
                *before = Beginning {
                    angle_rad: self.value,
                    stamp_ns: self.last_ns,
                    came: before.goes(self.value, self.last_ns),
                };
            }
            Measure::Rate { .. } => {}
        }
    }

    /// Counting begins again at `stamp_ns`, where all channels are of one moment.
    pub(super) fn begin_anew(&mut self, stamp_ns: i64) {
        self.began_ns = Some(stamp_ns);
    }

    /// Whether it says how fast the robot is, rather than how far it has come.
    pub(super) fn is_speed(&self) -> bool {
        matches!(self.measure, Measure::Rate { .. })
    }

    /// One count of it \[m\]; 0 where it does not count.
    pub(super) fn count_m(&self) -> f64 {
        match self.measure {
            Measure::Counter(counter) => counter.metres_per_count().abs(),
            Measure::Rate { .. } | Measure::Angle { .. } => 0.0,
        }
    }

    /// Its way since the last sample that said it \[m\]; 0 where it does not count.
    pub(super) fn way_m(&self) -> f64 {
        match self.measure {
            Measure::Counter(_) => self.value,
            Measure::Rate { .. } | Measure::Angle { .. } => 0.0,
        }
    }

    /// The same in counts.
    pub(super) fn counts(&self) -> f64 {
        match self.measure {
            Measure::Counter(counter) => self.value / counter.metres_per_count().abs(),
            Measure::Rate { .. } | Measure::Angle { .. } => 0.0,
        }
    }

    /// The most that a counter believes \[m/s\]; 0 where it does not count.
    pub(super) fn max_speed_mps(&self) -> f64 {
        match self.measure {
            Measure::Counter(counter) => counter.max_speed_mps(),
            Measure::Rate { .. } | Measure::Angle { .. } => 0.0,
        }
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
