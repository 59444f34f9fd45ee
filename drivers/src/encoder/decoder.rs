//! Frames in, odometry out.

use std::time::Duration;

use crate::can::{Id, Kind, Received};
use crate::config_error::ConfigError;

use super::channel::{Channel, Continuity, SHORTEST_INTERVAL_NS, Update};
use super::config::OdometryConfig;
use super::counters::OdometryCounters;
use super::kinematics::Kinematics;
use super::message::Message;
use super::plan;
use super::reject::FrameReject;

/// The mean velocity of the body over `(start_ns, stamp_ns]`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct WheelOdometry {
    /// Stamp of the sample before \[ns\].
    pub start_ns: i64,
    /// The latest of the stamps of the frames that made it \[ns\]; later than `start_ns`.
    pub stamp_ns: i64,
    /// `[v_x, v_y, ω]` \[m/s, m/s, rad/s\]; finite.
    pub velocity: [f64; 3],
}

/// Makes odometry of CAN frames.
///
/// * The first frame of each wheel only says where counting starts.
/// * A sample is formed when every wheel has news, and the news belong together: stamps no farther apart than half a
///   period. Where a frame was lost this waits for the wheel that lags, so that a turn is not made of one wheel's
///   motion and the other's rest.
/// * What cumulative counters count is never lost with a frame: the next sample covers the longer time.
/// * Frames less than 1 ms apart (a backlog that came at once) go into one sample.
/// * No sample is faster than the robot can be. Where late frames come at once, their way is spread over what follows.
///
/// Stamps are of a clock that nobody sets: one that goes back is refused. Nothing here allocates after
/// [`OdometryDecoder::new`].
#[derive(Clone, Debug)]
pub struct OdometryDecoder {
    messages: Vec<Message>,
    channels: Vec<Channel>,
    kinematics: Kinematics,
    start_ns: Option<i64>,
    /// Frames that came while the wheels' news did not belong together.
    held: u32,
    counters: OdometryCounters,
}

/// The most channels that kinematics take.
pub const MAX_CHANNELS: usize = 3;

/// Where the way since the last sample is too long for its time, because late frames came at once, so long is waited for the
/// time to grow \[s\]; then a part of the way is said, and the rest goes into the next sample.
const LONGEST_WAIT_S: f64 = 0.1;

/// No frame is later than this \[s\]: more way than the robot could have come is garbage.
const LATEST_S: f64 = 1.0;

/// So many frames are waited for while every wheel has news but their stamps do not come close.
const PATIENCE: u32 = 4;

impl OdometryDecoder {
    /// Compiles the configuration.
    ///
    /// # Errors
    /// [`ConfigError`], with the setting, message or signal and what there is instead.
    pub fn new(config: &OdometryConfig) -> Result<Self, ConfigError> {
        let plan::Plan {
            messages,
            channels,
            kinematics,
            ..
        } = plan::plan(config)?;
        Ok(Self {
            messages,
            channels,
            kinematics,
            start_ns: None,
            held: 0,
            counters: OdometryCounters::default(),
        })
    }

    /// The identifiers that are wanted from `bus`: for [`crate::can::Filter::ids`].
    pub fn wanted_ids(&self, bus: u8) -> impl Iterator<Item = Id> {
        self.messages
            .iter()
            .filter(move |message| message.bus == bus)
            .map(|message| message.id)
    }

    /// How many wanted frames `bus` brings in that time, as far as configured: for [`crate::can::Bus::keep`].
    #[must_use]
    pub fn frames_in(&self, bus: u8, time: Duration) -> usize {
        let frames = |message: &Message| time.as_micros().div_ceil(message.period_us.max(1).into());
        let messages = self.messages.iter().filter(|message| message.bus == bus);
        usize::try_from(messages.map(frames).sum::<u128>()).unwrap_or(usize::MAX)
    }

    /// Takes a frame in; hands out a sample when this frame completes one. Frames of other messages are passed over.
    ///
    /// # Errors
    /// [`FrameReject`] for a frame of a wanted message that does not count; it is counted under its reason.
    pub fn push(&mut self, received: &Received) -> Result<Option<WheelOdometry>, FrameReject> {
        let Some(index) = self
            .messages
            .iter()
            .position(|message| message.carries(received))
        else {
            return Ok(None);
        };
        if let Some(message) = self.messages.get_mut(index) {
            message.heard += 1;
        }
        let sample = self
            .take(index, received)
            .and_then(|()| self.form_sample())
            .inspect_err(|&reason| self.counters.note_reject(reason))?;
        self.counters.accepted += 1;
        Ok(sample)
    }

    /// When the next frame of the message that `received` is of was to be expected \[ns\], by what was seen of it.
    #[must_use]
    pub fn due_ns(&self, received: &Received) -> Option<i64> {
        let message = self.messages.iter().find(|it| it.carries(received))?;
        let period_ns = |&channel: &usize| self.channels.get(channel)?.period_ns();
        let period_ns = message.channels.iter().find_map(period_ns)?;
        Some(message.last_ns?.saturating_add(period_ns))
    }

    /// How many frames have come of each wanted message, refused ones too, in the order of
    /// [`super::Description::expected`].
    pub fn heard(&self) -> impl Iterator<Item = u64> {
        self.messages.iter().map(|message| message.heard)
    }

    /// What has been counted so far.
    #[must_use]
    pub fn counters(&self) -> &OdometryCounters {
        &self.counters
    }

    fn take(&mut self, index: usize, received: &Received) -> Result<(), FrameReject> {
        if received.frame.kind() == Kind::Remote {
            return Err(FrameReject::Remote);
        }
        self.check_stamp(index, received.stamp_ns)?;
        let Some(message) = self.messages.get_mut(index) else {
            return Ok(());
        };
        let (data, stamp_ns) = (received.frame.data(), received.stamp_ns);
        let passed = message.guard.check(message.id, data, stamp_ns)?;
        let updates = check_all(&message.channels, &mut self.channels, data, stamp_ns)?;
        message.guard.accept(passed);
        message.last_ns = Some(stamp_ns);
        self.counters.skipped = self.counters.skipped.saturating_add(passed.skipped);
        self.apply(updates, stamp_ns);
        Ok(())
    }

    fn check_stamp(&self, index: usize, stamp_ns: i64) -> Result<(), FrameReject> {
        let last_ns = self.messages.get(index).and_then(|message| message.last_ns);
        match last_ns {
            Some(last_ns) if stamp_ns < last_ns => Err(FrameReject::Backward),
            _ => Ok(()),
        }
    }

    fn apply(&mut self, updates: Updates, stamp_ns: i64) {
        let mut continued = true;
        for (index, update) in updates.into_iter().flatten() {
            let Some(channel) = self.channels.get_mut(index) else {
                continue;
            };
            let continuity = channel.accept(update, stamp_ns);
            continued &= continuity == Continuity::Continued;
            self.counters.note(continuity);
        }
        if !continued {
            self.begin_interval(stamp_ns, 1.0);
        }
    }

    /// `said` is the part of the way that the interval before has accounted for.
    fn begin_interval(&mut self, stamp_ns: i64, said: f64) {
        (self.start_ns, self.held) = (Some(stamp_ns), 0);
        for channel in &mut self.channels {
            channel.begin_interval(said);
        }
    }

    /// # Errors
    /// [`FrameReject::Implausible`]: the way is longer than late frames explain.
    fn form_sample(&mut self) -> Result<Option<WheelOdometry>, FrameReject> {
        let Some((start_ns, stamp_ns)) = self.interval() else {
            return Ok(None);
        };
        let dt_s = seconds(stamp_ns.saturating_sub(start_ns));
        let least_s = self
            .channels
            .iter()
            .map(Channel::least_s)
            .fold(0.0, f64::max);
        // Rounding is no reason to wait.
        let late = least_s > dt_s * (1.0 + 1e-9);
        if late && least_s - dt_s > LATEST_S {
            self.counters.gaps += 1;
            self.begin_interval(stamp_ns, 1.0);
            return Err(FrameReject::Implausible);
        }
        if late && dt_s < LONGEST_WAIT_S {
            return Ok(None);
        }
        let velocity = self.velocity(dt_s.max(least_s));
        self.begin_interval(stamp_ns, if late { dt_s / least_s } else { 1.0 });
        self.counters.samples += 1;
        self.counters.late_ways += u64::from(late);
        Ok(Some(WheelOdometry {
            start_ns,
            stamp_ns,
            velocity,
        }))
    }

    /// Start and end of a sample, if there is enough for one.
    fn interval(&mut self) -> Option<(i64, i64)> {
        let (start_ns, stamp_ns) = (self.start_ns?, self.latest_news_ns()?);
        let dt_ns = stamp_ns.checked_sub(start_ns)?;
        if dt_ns < SHORTEST_INTERVAL_NS {
            return None;
        }
        if self.news_belong_together(stamp_ns) {
            self.held = 0;
        } else if self.held < PATIENCE {
            self.held += 1;
            return None;
        }
        Some((start_ns, stamp_ns))
    }

    /// The latest stamp, if every channel has news.
    fn latest_news_ns(&self) -> Option<i64> {
        let complete = self.channels.iter().all(Channel::has_news);
        self.channels
            .iter()
            .filter_map(Channel::last_ns)
            .max()
            .filter(|_| complete)
    }

    fn news_belong_together(&self, latest_ns: i64) -> bool {
        let earliest_ns = self
            .channels
            .iter()
            .filter_map(Channel::last_ns)
            .min()
            .unwrap_or(latest_ns);
        let period_ns = self.channels.iter().filter_map(Channel::period_ns).min();
        period_ns.is_none_or(|period_ns| latest_ns.saturating_sub(earliest_ns) <= period_ns / 2)
    }

    fn velocity(&self, dt_s: f64) -> [f64; 3] {
        let mut velocities = [0.0; MAX_CHANNELS];
        for (velocity, channel) in velocities.iter_mut().zip(&self.channels) {
            *velocity = channel.velocity(dt_s);
        }
        self.kinematics.velocity(velocities)
    }
}

type Updates = [Option<(usize, Update)>; MAX_CHANNELS];

/// What a payload says about each of its channels; if one refuses, the frame does not count for any.
fn check_all(
    indices: &[usize],
    channels: &mut [Channel],
    data: &[u8],
    stamp_ns: i64,
) -> Result<Updates, FrameReject> {
    let mut updates = [None; MAX_CHANNELS];
    let mut refused = None;
    for (slot, &index) in updates.iter_mut().zip(indices) {
        let Some(channel) = channels.get_mut(index) else {
            continue;
        };
        match channel.check(data, stamp_ns) {
            Ok(update) => *slot = Some((index, update)),
            // The others look at the frame all the same: they too must recognise a restarted encoder.
            Err(reason) => {
                refused.get_or_insert(reason);
            }
        }
    }
    refused.map_or(Ok(updates), Err)
}

#[expect(
    clippy::cast_precision_loss,
    reason = "nanoseconds of days are within 2^53"
)]
fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
