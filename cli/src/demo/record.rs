//! What was heard of one robot in the course of the demo.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use coloc_shm_types::{Estimate, Input, Reject, Status, Timing};
use hdrhistogram::Histogram;

use super::bystanders::{Stall, stalled_ns};
use super::told::Told;
use crate::comparison::{Accuracy, Comparison, Moment};

/// After so long without an estimate \[s\] its daemon was dead, or as good as.
const GAP_S: f64 = 0.25;

/// One robot's estimates and counters, over all starts of its daemon.
pub(crate) struct Record {
    /// Every estimate since the world started, beside the truth.
    pub(crate) moments: Vec<Moment>,
    /// The newest one, whenever it was.
    pub(crate) latest: Option<(Estimate, Instant)>,
    /// Who stood against the belief since the world started, and when that was first heard \[s\].
    pub(crate) against: BTreeMap<(Input, u16), f64>,
    /// How often others told it something.
    pub(crate) told: Told,
    /// When which robot was found in this one's scans \[s\].
    seen: Vec<(f64, usize)>,
    /// The newest counters of every start of the daemon, by its session.
    statuses: BTreeMap<u64, Status>,
    /// Deadlines that were missed, by session.
    missed: BTreeMap<u64, Missed>,
    /// Ticks that woke later than by a period.
    late: Vec<Late>,
    /// From wake-up to publication \[ns\].
    latency: Histogram<u64>,
}

/// A tick that woke too late.
#[derive(Copy, Clone, Debug)]
#[expect(clippy::struct_field_names, reason = "units belong in names")]
struct Late {
    at_ns: i64,
    lateness_ns: u64,
    period_ns: u64,
}

#[derive(Copy, Clone, Debug, Default)]
struct Missed {
    /// Periods that went by before the tick was published.
    at_all: u64,
    /// Periods that went by before it even woke.
    by_more_than_a_period: u64,
}

/// Latencies of the ticks \[µs\].
#[derive(Copy, Clone, Debug, Default, serde::Serialize)]
pub(crate) struct Latency {
    pub(crate) p50: f64,
    pub(crate) p99: f64,
    pub(crate) max: f64,
}

impl Record {
    pub(crate) fn new() -> Self {
        let latency =
            Histogram::new(3).unwrap_or_else(|_| unreachable!("three digits are allowed"));
        Self {
            moments: Vec::new(),
            latest: None,
            against: BTreeMap::new(),
            told: Told::default(),
            seen: Vec::new(),
            statuses: BTreeMap::new(),
            missed: BTreeMap::new(),
            late: Vec::new(),
            latency,
        }
    }

    /// Notes an estimate, with the truth at its stamp where that is known.
    pub(crate) fn hear_estimate(&mut self, estimate: &Estimate, moment: Option<Moment>) {
        self.latest = Some((*estimate, Instant::now()));
        self.moments.extend(moment);
        self.missed.entry(estimate.header.session).or_default();
    }

    /// Notes where a tick's time went.
    pub(crate) fn hear_timing(&mut self, timing: &Timing, period_ns: u64) {
        // It grows as needed; only a number beyond all memory could be refused.
        let took_ns = u64::from(timing.collect_ns) + u64::from(timing.estimate_ns);
        let _ = self.latency.record(took_ns);
        let missed = self.missed.entry(timing.header.session).or_default();
        missed.at_all += timing.lateness_ns.saturating_add(took_ns) / period_ns;
        missed.by_more_than_a_period += timing.lateness_ns / period_ns;
        if timing.lateness_ns >= period_ns {
            self.late.push(Late {
                at_ns: timing.header.stamp_ns,
                lateness_ns: timing.lateness_ns,
                period_ns,
            });
        }
    }

    /// How many of the deadlines that were missed by more than a period would not have been, had the machine not stood still.
    pub(crate) fn missed_by_the_machine(&self, stalls: &[Stall]) -> u64 {
        let of_the_machine = |late: &Late| {
            let began_ns = late.at_ns.saturating_sub_unsigned(late.lateness_ns);
            let stalled_ns = stalled_ns(stalls, began_ns, late.at_ns).unsigned_abs();
            let own_ns = late.lateness_ns.saturating_sub(stalled_ns);
            late.lateness_ns / late.period_ns - own_ns / late.period_ns
        };
        self.late.iter().map(of_the_machine).sum()
    }

    /// Notes that the robot with that place was seen.
    pub(crate) fn hear_seen(&mut self, time_s: f64, robot: usize) {
        self.seen.push((time_s, robot));
    }

    /// Who was seen after the one moment and until the other, each once.
    pub(crate) fn seen_between(&self, after_s: f64, until_s: f64) -> BTreeSet<usize> {
        let seen = self.seen.iter();
        seen.filter(|(time_s, _)| (after_s..until_s).contains(time_s))
            .map(|(_, robot)| *robot)
            .collect()
    }

    /// Notes that somebody stands against the belief.
    pub(crate) fn hear_against(&mut self, who: (Input, u16), time_s: f64) {
        self.against.entry(who).or_insert(time_s);
    }

    /// Who does so by the newest status.
    pub(crate) fn now_against(&self) -> impl Iterator<Item = (Input, u16)> {
        let newest = self.statuses.values().max_by_key(|it| it.header.stamp_ns);
        let rows = newest.into_iter().flat_map(Status::sources);
        rows.filter(|(_, row)| row.is_against())
            .map(|(input, row)| (input, row.source))
    }

    /// Notes the counters.
    pub(crate) fn hear_status(&mut self, status: &Status) {
        self.statuses.insert(status.header.session, *status);
    }

    /// How often its daemon was started.
    pub(crate) fn starts(&self) -> usize {
        self.missed.len()
    }

    /// Deadlines by which the tick before was not published yet.
    pub(crate) fn missed(&self) -> u64 {
        self.most_of(|seen| seen.at_all)
    }

    /// Deadlines by which the tick before had not even woken.
    pub(crate) fn missed_by_more_than_a_period(&self) -> u64 {
        self.most_of(|seen| seen.by_more_than_a_period)
    }

    /// The daemon's own count (of those by more than a period) or ours, whichever saw more: its news comes once a second.
    fn most_of(&self, ours: fn(&Missed) -> u64) -> u64 {
        let told = |session| {
            self.statuses
                .get(session)
                .map_or(0, |status| status.deadline_misses)
        };
        self.missed
            .iter()
            .map(|(session, seen)| ours(seen).max(told(session)))
            .sum()
    }

    /// Inputs that changed the belief.
    pub(crate) fn accepted(&self, input: Input) -> u64 {
        self.statuses
            .values()
            .map(|status| status.accepted_of(input))
            .sum()
    }

    /// Inputs that were turned away for `reason`.
    pub(crate) fn rejected(&self, input: Input, reason: Reject) -> u64 {
        self.statuses
            .values()
            .map(|status| status.rejected_of(input, reason))
            .sum()
    }

    /// All inputs that changed the belief, and all that did not.
    pub(crate) fn totals(&self) -> [u64; 2] {
        let accepted = Input::ALL
            .into_iter()
            .map(|input| self.accepted(input))
            .sum();
        let rejected = self
            .statuses
            .values()
            .flat_map(|status| Input::ALL.map(|input| status.rejected_total(input)))
            .sum();
        [accepted, rejected]
    }

    /// Percentiles of all ticks that were heard, if any were.
    #[allow(clippy::cast_precision_loss)] // Nanoseconds of one tick.
    pub(crate) fn latency(&self) -> Option<Latency> {
        let us = |ns: u64| ns as f64 / 1e3;
        (!self.latency.is_empty()).then(|| Latency {
            p50: us(self.latency.value_at_quantile(0.5)),
            p99: us(self.latency.value_at_quantile(0.99)),
            max: us(self.latency.max()),
        })
    }

    /// The newest comparison with the truth.
    pub(crate) fn latest_comparison(&self) -> Option<Comparison> {
        self.moments.last().map(|moment| moment.comparison)
    }

    /// How well it knew where it was.
    pub(crate) fn accuracy(&self) -> Option<Accuracy> {
        Accuracy::of(self.moments.iter().map(|moment| moment.comparison))
    }

    /// Time mean of εᵀ P⁻¹ ε of the pose; nothing if it was never heard, or P was no covariance.
    pub(crate) fn nees(&self) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "a count of ticks")]
        let count = self.moments.len() as f64;
        let sum: f64 = self.moments.iter().map(|moment| moment.nees).sum();
        Some(sum / count).filter(|mean| mean.is_finite())
    }

    /// Share of the time in which others told it something; none of a short run.
    pub(crate) fn told_share(&self) -> Option<f64> {
        let last = self.latest_comparison()?;
        self.told
            .share(last.time_s - self.moments[0].comparison.time_s)
    }

    /// Root of the time mean of the squared error of its wheels alone \[m, m, rad\].
    pub(crate) fn rms_error_of_wheels(&self) -> Option<[f64; 3]> {
        let of_wheels = Accuracy::of(self.moments.iter().map(Moment::of_wheels));
        of_wheels.map(|accuracy| accuracy.rms_error)
    }

    /// The moments, cut where nothing was heard for a while.
    pub(crate) fn pieces(&self) -> Vec<&[Moment]> {
        let time_s = |moment: &Moment| moment.comparison.time_s;
        let together = |a: &Moment, b: &Moment| time_s(b) - time_s(a) < GAP_S;
        self.moments.chunk_by(together).collect()
    }
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::{BeliefState, Header};

    use super::*;

    fn timing(lateness_ns: u64) -> Timing {
        Timing {
            collect_ns: 100_000,
            lateness_ns,
            ..Timing::default()
        }
    }

    #[test]
    fn dead_time_is_a_gap() {
        let mut record = Record::new();
        assert!(record.pieces().is_empty() && record.latency().is_none());
        for time_s in [0.0, 0.02, 0.1, 1.5, 1.52] {
            let comparison = Comparison {
                time_s,
                truth: coloc_estimator::Pose::default(),
                estimate: coloc_estimator::Pose::default(),
                sigma: [0.1; 3],
            };
            let moment = Moment {
                comparison,
                covariance: [0.01, 0.0, 0.01],
                nees: 0.0,
                state: BeliefState::Ok,
                by_wheels: comparison.truth,
            };
            record.hear_estimate(&Estimate::default(), Some(moment));
        }
        let lengths: Vec<usize> = record.pieces().iter().map(|piece| piece.len()).collect();
        assert_eq!(lengths, [3, 2]);
    }

    #[test]
    fn who_was_seen_in_a_turn_is_named_once() {
        let mut record = Record::new();
        for (time_s, robot) in [(0.5, 1), (1.0, 2), (1.05, 2), (1.06, 4), (1.1, 3)] {
            record.hear_seen(time_s, robot);
        }
        let seen: Vec<_> = record.seen_between(1.0, 1.1).into_iter().collect();
        assert_eq!(seen, [2, 4]);
    }

    #[test]
    fn counters_add_up_over_restarts() {
        let mut record = Record::new();
        for (session, accepted) in [(1, 10), (1, 25), (2, 7)] {
            let header = Header {
                session,
                ..Header::default()
            };
            let mut status = Status {
                header,
                ..Status::default()
            };
            status.accepted[0] = accepted;
            record.hear_status(&status);
        }
        assert_eq!(record.totals(), [32, 0]);
    }

    #[test]
    fn a_miss_is_by_more_than_a_period_only_if_the_wake_up_was() {
        let mut record = Record::new();
        for lateness_ns in [50_000, 19_950_000, 20_000_001] {
            record.hear_timing(&timing(lateness_ns), 20_000_000);
        }
        assert_eq!(
            (
                record.missed(),
                record.missed_by_more_than_a_period(),
                record.starts()
            ),
            (2, 1, 1)
        );
    }

    #[test]
    fn what_the_machine_did_is_not_the_robots() {
        let mut record = Record::new();
        let mut late = timing(45_000_000);
        late.header.stamp_ns = 1_000_000_000;
        record.hear_timing(&late, 20_000_000);
        let missed = |from_ms: i64, until_ms: i64| {
            let [from_ns, until_ns] = [from_ms, until_ms].map(|ms| ms * 1_000_000);
            record.missed_by_the_machine(&[Stall { from_ns, until_ns }])
        };
        assert_eq!(record.missed_by_more_than_a_period(), 2);
        assert_eq!(missed(950, 1010), 2);
        assert_eq!(missed(955, 970), 1, "30 ms of 45 were the robot's own");
        assert_eq!(missed(0, 900), 0);
    }

    #[test]
    fn a_daemon_that_counted_more_than_was_heard_is_believed() {
        let mut record = Record::new();
        record.hear_estimate(&Estimate::default(), None);
        record.hear_status(&Status {
            deadline_misses: 3,
            ..Status::default()
        });
        assert_eq!(
            (record.missed(), record.missed_by_more_than_a_period()),
            (3, 3)
        );
    }
}
