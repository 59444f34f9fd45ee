//! How often the frames of a message come.

use crate::database::DbcMessage;

use super::super::words::Time;

/// The time from one frame of a message to the next, and who says so.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Period {
    /// \[s\]
    pub(super) s: f64,
    source: Source,
}

#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Source {
    Setting,
    Dbc,
    Assumed,
}

/// Where nobody says anything \[s\].
const USUAL_S: f64 = 0.02;

/// What a cycle time can be \[s\]; anything else is a way to write that there is none.
const CYCLES_S: std::ops::RangeInclusive<f64> = 1e-3..=10.0;

impl Period {
    /// As configured, else as the DBC file says, else as usual.
    pub(super) fn of(configured_s: Option<f64>, message: &DbcMessage) -> Self {
        let dbc_s = message.cycle_s().filter(|s| CYCLES_S.contains(s));
        let (s, source) = match (configured_s, dbc_s) {
            (Some(s), _) => (s, Source::Setting),
            (None, Some(s)) => (s, Source::Dbc),
            (None, None) => (USUAL_S, Source::Assumed),
        };
        Self { s, source }
    }

    /// Where what is configured and what the DBC file says are not alike.
    pub(super) fn contradiction(
        setting: &str,
        configured_s: Option<f64>,
        message: &DbcMessage,
    ) -> Option<String> {
        let dbc_s = message.cycle_s().filter(|s| CYCLES_S.contains(s))?;
        let s = configured_s.filter(|s| !(0.8..=1.25).contains(&(s / dbc_s)))?;
        Some(format!(
            "{setting}.period_s: is {}, and GenMsgCycleTime of the DBC file {}: which is right?",
            Time(s),
            Time(dbc_s)
        ))
    }

    /// Whether a setting or the DBC file says so.
    pub(super) fn is_said(self) -> bool {
        self.source != Source::Assumed
    }

    /// In words.
    pub(super) fn describe(self) -> String {
        let source = match self.source {
            Source::Setting => "as configured",
            Source::Dbc => "by GenMsgCycleTime of the DBC file",
            Source::Assumed => "assumed: neither period_s nor GenMsgCycleTime says",
        };
        format!("a frame every {} ({source})", Time(self.s))
    }

    /// \[µs\]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "positive and at most ten seconds"
    )]
    pub(super) fn us(self) -> u64 {
        (self.s * 1e6).round() as u64
    }
}
