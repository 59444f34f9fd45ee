//! Frames in, odometry out.

use std::time::Duration;

use crate::can::{Id, Kind, Received};
use crate::config_error::ConfigError;

use super::config::OdometryConfig;
use super::counters::OdometryCounters;
use super::merge::{Merge, WheelOdometry};
use super::message::Message;
use super::plan;
use super::reject::FrameReject;
use super::slip::Slip;

/// Makes odometry of CAN frames: each is checked against its message's guard, each of its signals against what the channel
/// said before, and what the channels say is put together to samples (`merge`).
///
/// Stamps are of a clock that nobody sets: one that goes back is refused. Nothing here allocates after
/// [`OdometryDecoder::new`].
#[derive(Clone, Debug)]
pub struct OdometryDecoder {
    messages: Vec<Message>,
    merge: Merge,
}

impl OdometryDecoder {
    /// Compiles the configuration.
    ///
    /// # Errors
    /// [`ConfigError`], with the setting, message or signal and what there is instead.
    pub fn new(config: &OdometryConfig) -> Result<Self, ConfigError> {
        let plan = plan::plan(config)?;
        Ok(Self {
            messages: plan.messages,
            merge: plan.merge,
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
        let carries = |message: &&mut Message| message.carries(received);
        let Some(message) = self.messages.iter_mut().find(carries) else {
            return Ok(None);
        };
        message.heard += 1;
        let sample = take(message, &mut self.merge, received)
            .and_then(|()| self.merge.form_sample())
            .inspect_err(|&reason| self.merge.counters.note_reject(reason))?;
        self.merge.counters.accepted += 1;
        Ok(sample)
    }

    /// When the next frame of the message that `received` is of was to be expected \[ns\], by what was seen of it.
    #[must_use]
    pub fn due_ns(&self, received: &Received) -> Option<i64> {
        let message = self.messages.iter().find(|it| it.carries(received))?;
        let mut channels = message.signals.iter().map(|signal| signal.channel);
        let period_ns = channels.find_map(|channel| self.merge.period_ns(channel))?;
        Some(message.last_ns?.saturating_add(period_ns))
    }

    /// How many frames have come of each wanted message, refused ones too, in the order of
    /// [`super::Description::expected`].
    pub fn heard(&self) -> impl Iterator<Item = u64> {
        self.messages.iter().map(|message| message.heard)
    }

    /// How often wheels began to slip.
    #[must_use]
    pub fn slips(&self) -> u64 {
        self.merge.slips()
    }

    /// Wheels that do not fit the others, now.
    #[must_use]
    pub fn slip(&self) -> Option<Slip> {
        self.merge.slip()
    }

    /// What has been counted so far.
    #[must_use]
    pub fn counters(&self) -> &OdometryCounters {
        &self.merge.counters
    }
}

fn take(message: &mut Message, merge: &mut Merge, received: &Received) -> Result<(), FrameReject> {
    if received.frame.kind() == Kind::Remote {
        return Err(FrameReject::Remote);
    }
    let (data, stamp_ns) = (received.frame.data(), received.stamp_ns);
    if message.last_ns.is_some_and(|last_ns| stamp_ns < last_ns) {
        return Err(FrameReject::Backward);
    }
    let passed = message.guard.check(message.id, data, stamp_ns)?;
    let said = message.signals.iter().map(|it| (it.channel, it.read(data)));
    let updates = merge.check(said, stamp_ns)?;
    message.guard.accept(passed);
    message.last_ns = Some(stamp_ns);
    merge.counters.skipped = merge.counters.skipped.saturating_add(passed.skipped);
    merge.apply(updates, stamp_ns);
    Ok(())
}
