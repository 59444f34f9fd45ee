//! What a sensor says to a channel.

use crate::signal::SignalDecoder;

use super::reject::FrameReject;

/// A number, before anybody knows whether to believe it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Said {
    /// The raw count of a counter.
    Count(u64),
    /// A velocity, in the unit of its channel.
    Rate(f64),
}

/// A signal of a message, and the channel that it is for.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Carried {
    /// Position of the channel.
    pub(super) channel: usize,
    pub(super) signal: SignalDecoder,
    /// It is the raw count that matters.
    pub(super) counts: bool,
}

impl Carried {
    /// # Errors
    /// [`FrameReject::Short`], and [`FrameReject::OutOfRange`] where the DBC file has a range.
    pub(super) fn read(&self, data: &[u8]) -> Result<Said, FrameReject> {
        if self.counts {
            return self
                .signal
                .raw(data)
                .map(Said::Count)
                .ok_or(FrameReject::Short);
        }
        let value = self.signal.physical(data).ok_or(FrameReject::Short)?;
        let allowed = self.signal.allows(value).then_some(Said::Rate(value));
        allowed.ok_or(FrameReject::OutOfRange)
    }
}
