//! Where the time of a tick goes.

use crate::clock::{Moment, TimeSource};

/// When the last stage ended \[ns of the inner clock\].
#[derive(Copy, Clone, Debug)]
pub(crate) struct Stopwatch(i64);

/// How long the stages of a tick took \[ns\].
#[derive(Copy, Clone, Debug, Default)]
#[expect(clippy::struct_field_names, reason = "units belong in names")]
pub(crate) struct Stages {
    /// From the wake-up until all inputs were there.
    pub(crate) collect_ns: u32,
    /// The estimator's step.
    pub(crate) estimate_ns: u32,
    /// Sending.
    pub(crate) publish_ns: u32,
    /// Counting.
    pub(crate) account_ns: u32,
}

impl Stopwatch {
    /// The first stage begins.
    pub(crate) fn start(time: &dyn TimeSource) -> Self {
        Self(time.now_ns())
    }

    /// When the last stage ended, or the first one began \[ns of the inner clock\].
    pub(crate) fn last_ns(self) -> i64 {
        self.0
    }

    /// How long the stage that ends now took \[ns\].
    pub(crate) fn lap(&mut self, time: &dyn TimeSource) -> u32 {
        let begin = std::mem::replace(&mut self.0, time.now_ns());
        u32::try_from((self.0 - begin).max(0)).unwrap_or(u32::MAX)
    }

    /// From the tick's stamp to the end of the last stage \[ns\].
    pub(crate) fn since(self, moment: &Moment) -> u64 {
        u64::try_from(self.0 - moment.stamp.as_nanos()).unwrap_or(0)
    }
}
