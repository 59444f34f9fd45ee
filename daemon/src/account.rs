//! Step 5 of the tick: what it took, what was turned away, and what telemetry should know.

use std::sync::Arc;

use coloc_estimator::{Estimate, Kind, OdometryState, Report, Stamp, TickOutputs, Verdict};
use coloc_shm_types::{BeliefState, BusState, CanCounters, Health, Input, Reject, Sender, Status};

use crate::config::{Config, nanos};
use crate::event::{Event, Link};
use crate::health::{Watch, belief_state};
use crate::ledger::Ledger;
use crate::record::Record;
use crate::wait::Wake;

/// Counts, on the real-time thread.
#[derive(Debug)]
pub struct Account {
    link: Arc<Link>,
    /// All counters since the start.
    pub status: Status,
    watch: Watch,
    now: Stamp,
    ledger: Box<Ledger>,
    next_report_ns: i64,
    next_belief_ns: i64,
    belief_period_ns: Option<i64>,
    records: bool,
    /// Lines of the recording that found no room since it was last told so.
    unrecorded: u64,
}

const REPORT_PERIOD_NS: i64 = 1_000_000_000;

impl Account {
    /// Reports through `link`; hands on the belief as often as the configuration says, if it is to be saved.
    #[must_use]
    pub fn new(config: &Config, link: Arc<Link>, sender: &Sender) -> Self {
        let header = sender.beside().header(0);
        Self {
            link,
            status: Status {
                header,
                ..Status::default()
            },
            watch: Watch::new(&config.health),
            now: Stamp::default(),
            ledger: Box::default(),
            next_report_ns: 0,
            next_belief_ns: 0,
            belief_period_ns: config
                .initial
                .resume
                .then(|| nanos(1.0 / config.telemetry.state_hz)),
            records: !config.telemetry.record.as_os_str().is_empty(),
            unrecorded: 0,
        }
    }

    /// Hands lines on, if there is a recording.
    pub fn record(&mut self, lines: impl IntoIterator<Item = Record>) {
        if self.records {
            lines.into_iter().for_each(|line| self.record_line(line));
        }
    }

    /// Where lines are missing, the recording says so before it goes on.
    fn record_line(&mut self, line: Record) {
        let tell = |line| self.link.tell(Event::Recorded(line)).is_ok();
        let lines = self.unrecorded;
        if (lines == 0 || tell(Record::Lost { lines })) && tell(line) {
            self.unrecorded = 0;
        } else {
            self.unrecorded += 1;
            self.status.lost_events += 1;
        }
    }

    /// A tick stamped `now` begins, or one that may become a tick; `sent_ns` is what others call that moment.
    pub fn begin(&mut self, now: Stamp, sent_ns: i64) {
        self.now = now;
        self.status.header.stamp_ns = sent_ns;
    }

    /// Tells telemetry, or counts that it could not be told.
    pub fn tell(&mut self, event: Event) {
        if self.link.tell(event).is_err() {
            self.status.lost_events += 1;
        }
    }

    /// A valid sample, measured at `stamp`; whether it is fused is the estimator's business.
    pub fn valid(&mut self, input: Input, stamp: Stamp) {
        self.watch.valid(input, stamp);
    }

    /// An input that is no valid sample of its sensor.
    pub fn invalid(&mut self, input: Input, reason: Reject) {
        self.watch.invalid(input, self.now);
        self.rejected(input, reason);
    }

    /// Something came that cannot even be read.
    pub fn unreadable(&mut self, input: Input) {
        self.watch.invalid(input, self.now);
    }

    /// An input that changed nothing.
    pub fn rejected(&mut self, input: Input, reason: Reject) {
        let count = self
            .status
            .rejected
            .get_mut(input as usize)
            .and_then(|reasons| reasons.get_mut(reason as usize));
        if let Some(count) = count {
            *count += 1;
        }
        self.tell(Event::Rejected { input, reason });
    }

    /// What the estimator made of a tick's inputs, `samples` of odometry among them.
    pub fn outputs(&mut self, outputs: &TickOutputs<'_>, samples: usize) {
        outputs
            .reports
            .iter()
            .for_each(|report| self.verdict(report));
        let refused = outputs
            .reports
            .iter()
            .filter(|report| report.source.kind == Kind::Odometry)
            .count();
        self.accepted(Input::Odometry, samples.saturating_sub(refused));
        self.accepted(Input::RelativePose, outputs.outgoing.len());
        if outputs.overflowed > 0 || outputs.folded_early > 0 {
            self.tell(Event::NoRoom {
                overflowed: outputs.overflowed,
                folded_early: outputs.folded_early,
            });
        }
        if self.belief_is_due(outputs.estimate.stamp.as_nanos()) {
            self.tell_belief(&outputs.estimate);
        }
    }

    /// The last belief, due or not: who is started again goes on from there.
    pub fn last(&mut self, estimate: &Estimate) {
        if self.belief_period_ns.is_some() {
            self.tell_belief(estimate);
        }
    }

    fn tell_belief(&mut self, estimate: &Estimate) {
        let measured = estimate.odometry != OdometryState::Stale;
        self.tell(Event::Belief {
            boot_ns: estimate.stamp.as_nanos(),
            belief: estimate.belief,
            velocity: measured.then_some(estimate.velocity),
        });
    }

    fn verdict(&mut self, report: &Report) {
        let input = input(report.source.kind);
        match reason(report.verdict) {
            None => self.accepted(input, 1),
            Some(reason) => self.rejected(input, reason),
        }
    }

    fn accepted(&mut self, input: Input, count: usize) {
        if let Some(total) = self.status.accepted.get_mut(input as usize) {
            *total += count as u64;
        }
    }

    /// The wake-up's lateness \[ns\]; the deadlines that passed before it are counted.
    pub fn woke(&mut self, wake: Wake, now_ns: i64) -> u64 {
        let Wake::Deadline {
            deadline_ns,
            missed,
        } = wake
        else {
            return 0;
        };
        let lateness_ns = u64::try_from(now_ns - deadline_ns).unwrap_or(0);
        self.status.worst_lateness_ns = self.status.worst_lateness_ns.max(lateness_ns);
        self.status.deadline_misses += missed;
        if missed > 0 {
            self.tell(Event::Missed {
                deadlines: missed,
                lateness_ns,
            });
        }
        lateness_ns
    }

    /// Every sensor's health at this tick.
    pub fn health(&mut self) -> [Health; Input::COUNT] {
        let health = self.watch.at(self.now);
        for (input, to) in Input::ALL.into_iter().zip(health) {
            let Some(byte) = self.status.health.get_mut(input as usize) else {
                continue;
            };
            let from = Health::from_byte(std::mem::replace(byte, to as u8));
            if from != to {
                let tick = self.status.tick;
                self.tell(Event::Health {
                    input,
                    from,
                    to,
                    tick,
                });
            }
        }
        let state = belief_state(health);
        self.status.state = state as u8;
        self.status.fit = u8::from(state == BeliefState::Ok);
        health
    }

    /// How the wheels' buses are doing.
    pub fn buses(&mut self, worst: BusState, counters: CanCounters) {
        let from = BusState::from_byte(std::mem::replace(&mut self.status.bus, worst as u8));
        if from != worst {
            self.tell(Event::Bus { from, to: worst });
        }
        self.watch.broken(Input::Odometry, worst >= BusState::Off);
        self.status.can = counters;
    }

    fn belief_is_due(&mut self, now_ns: i64) -> bool {
        let Some(period) = self.belief_period_ns else {
            return false;
        };
        let due = now_ns >= self.next_belief_ns;
        if due {
            self.next_belief_ns = now_ns + period;
        }
        due
    }

    /// Closes the tick: latency, heartbeat and, once a second, the books.
    pub fn close(&mut self, now_ns: i64, latency_ns: u64) {
        self.ledger.record(latency_ns);
        self.status.tick += 1;
        self.link.beat(self.status.tick);
        if now_ns >= self.next_report_ns {
            self.next_report_ns = now_ns + REPORT_PERIOD_NS;
            self.hand_over();
        }
    }

    /// Swaps ledgers with telemetry; while it has none to give back, or has too much to do, this one goes on.
    fn hand_over(&mut self) {
        if self.link.is_full() {
            return;
        }
        let Some(spare) = self.link.take_spare() else {
            return;
        };
        let mut full = std::mem::replace(&mut self.ledger, spare);
        full.status = self.status;
        self.tell(Event::Account(full));
    }
}

fn input(kind: Kind) -> Input {
    match kind {
        Kind::Odometry => Input::Odometry,
        Kind::Sighting => Input::RelativePose,
        Kind::Neighbour => Input::Neighbour,
        Kind::Fix => Input::Position,
    }
}

/// Why the estimator turned an input away; `None` if it did not.
fn reason(verdict: Verdict) -> Option<Reject> {
    match verdict {
        Verdict::Accepted { .. } => None,
        Verdict::Gated { .. } => Some(Reject::Gated),
        Verdict::TooOld => Some(Reject::TooOld),
        Verdict::FromFuture => Some(Reject::FromFuture),
        Verdict::Duplicate => Some(Reject::Replayed),
        Verdict::EmptyInterval => Some(Reject::EmptyInterval),
        Verdict::NoRoom => Some(Reject::HistoryFull),
        Verdict::NotFinite => Some(Reject::NotFinite),
        Verdict::NoNoise => Some(Reject::NoCovariance),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_shm_types::Clock;

    use super::*;

    fn account() -> (Account, Arc<Link>) {
        let link = Arc::new(Link::new());
        let config = Config::parse("[robot]\nname = \"a\"\nid = 1\n", Path::new("a.toml")).unwrap();
        let sender = Sender::start(1, Clock::Realtime).unwrap();
        (Account::new(&config, Arc::clone(&link), &sender), link)
    }

    #[test]
    fn health_is_told_when_it_changes_and_only_then() {
        let (mut account, link) = account();
        account.health();
        assert_eq!(link.waiting(), 0);
        account.valid(Input::Position, Stamp::default());
        account.health();
        account.health();
        assert_eq!(link.waiting(), 1);
        assert_eq!(account.status.health_of(Input::Position), Health::Ok);
    }

    #[test]
    fn a_full_ring_loses_events_and_counts_them_but_no_latency() {
        let (mut account, link) = account();
        let capacity = Link::CAPACITY as u64;
        (0..capacity + 5).for_each(|_| account.rejected(Input::Neighbour, Reject::Gated));
        assert_eq!(account.status.lost_events, 5);
        assert_eq!(
            account.status.rejected_of(Input::Neighbour, Reject::Gated),
            capacity + 5
        );
        account.close(1, 100);
        while link.next_event().is_some() {}
        account.close(1 + REPORT_PERIOD_NS, 200);
        let Some(Event::Account(ledger)) = link.next_event() else {
            panic!("a second has passed")
        };
        assert!(ledger.percentiles().p50_ns <= 101 && ledger.percentiles().max_ns >= 199);
    }

    #[test]
    fn without_a_ledger_in_return_the_old_one_goes_on() {
        let (mut account, link) = account();
        (0..3).for_each(|second| account.close(second * REPORT_PERIOD_NS, 100));
        assert_eq!(link.waiting(), 1);
        assert!(link.take_spare().is_none());
    }
}
