//! What became of messages, counted.
use std::fmt::Write as _;

use coloc_sensors::Report;

use crate::admission::Counts as Refusals;

/// Why something was not sent or not said; what [admission](crate::admission) refuses has its own list.
pub const REASONS: [&str; 10] = [
    "not_connected",
    "not_spoken_there",
    "foreign_clock",
    "too_old_to_send",
    "pushed_out",
    "not_in_time",
    "refused",
    "no_reader",
    "told_too_much",
    "announced_by_strangers",
];

/// What the figures of the status are, in their order.
pub const FIGURES: [&str; 8] = [
    "members",
    "connected",
    "sent_bytes",
    "heard_bytes",
    "knocks_of_strangers",
    "knocks_unheard",
    "worst_round_trip_s",
    "worst_offset_s",
];

/// Since the start.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Messages of the own robot that were handed to the network, once for each member.
    pub sent: u64,
    /// Messages of others that were said in shared memory.
    pub said: u64,
    /// Messages that came, of every kind.
    pub came: u64,
    /// Signatures that were made, of every kind of message.
    pub signed: u64,
    /// Nobody was connected to whom it was for.
    pub not_connected: u64,
    /// The member does not know that kind, or has not said yet what it knows.
    pub not_spoken_there: u64,
    /// Its stamp is not of `CLOCK_REALTIME`.
    pub foreign_clock: u64,
    /// It had grown older than its kind may before it was sent.
    pub too_old_to_send: u64,
    /// Newer ones took its place in the queue.
    pub pushed_out: u64,
    /// It did not arrive before it was too old.
    pub not_in_time: u64,
    /// Refused by admission, for all reasons.
    pub refused: u64,
    /// Shared memory did not take it, or somebody who listens did not get it.
    pub no_reader: u64,
    /// A member said more than it may, and had to wait.
    pub told_too_much: u64,
    /// Others than members announced themselves by multicast DNS.
    pub announced_by_strangers: u64,
}

impl Counts {
    /// In words, at the end, with what admission `refused`.
    #[must_use]
    pub fn words(&self, refusals: &Refusals) -> String {
        let Self {
            signed,
            sent,
            came,
            said,
            refused,
            ..
        } = self;
        let mut words = format!(
            "signed {signed}, of these {sent} of the robot; {came} came, {said} were said, {refused} refused"
        );
        let refusals = refusals.some().map(|(why, count)| (why.name(), count));
        let here = REASONS.into_iter().zip(self.report().refused);
        let here = here.filter(|(why, count)| *count > 0 && *why != "refused");
        for (why, count) in refusals.chain(here) {
            // It cannot fail: it is a string.
            let _ = write!(words, ", {why} {count}");
        }
        words
    }

    /// As a driver reports it.
    #[must_use]
    pub fn report(&self) -> Report {
        let mut report = Report {
            whole: self.came.saturating_sub(self.refused),
            broken: 0,
            said: self.said,
            nothing_to_say: self
                .came
                .saturating_sub(self.refused.saturating_add(self.said)),
            ..Report::default()
        };
        let refused = [
            self.not_connected,
            self.not_spoken_there,
            self.foreign_clock,
            self.too_old_to_send,
            self.pushed_out,
            self.not_in_time,
            self.refused,
            self.no_reader,
            self.told_too_much,
            self.announced_by_strangers,
        ];
        for (place, count) in report.refused.iter_mut().zip(refused) {
            *place = count;
        }
        report
    }
}
