//! Step 5 of the tick: what it took, what was turned away, and what telemetry should know.

mod driven;

use std::sync::Arc;

use coloc_estimator::{
    Belief, Estimate, Kind, Measurement, OdometryState, Report, Source, Stamp, TickOutputs, Verdict,
};
use coloc_shm_types::{
    BeliefState, BusState, CanCounters, Health, Input, Reject, Sender, SourceState, Status, Timing,
};

use crate::config::{Config, nanos};
use crate::event::{Event, Gated, Link};
use crate::health::{Standing, Watch};
use crate::ledger::Ledger;
use crate::record::Record;
use crate::sources::Sources;
use crate::wait::Wake;
use driven::driven;

/// Counts, on the real-time thread.
#[derive(Debug)]
pub struct Account {
    link: Arc<Link>,
    sender: Sender,
    /// What others call the moment `now` \[ns of the configured clock\].
    sent_ns: i64,
    /// All counters since the start.
    pub status: Status,
    watch: Watch,
    sources: Sources,
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
        Self {
            link,
            sender: sender.beside(),
            sent_ns: 0,
            status: Status::default(),
            watch: Watch::new(&config.health),
            sources: Sources::new(config),
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
            self.status.losses.events += 1;
        }
    }

    /// A tick stamped `now` begins, or one that may become a tick; `sent_ns` is what others call that moment.
    pub fn begin(&mut self, now: Stamp, sent_ns: i64) {
        self.now = now;
        self.sent_ns = sent_ns;
    }

    /// Tells telemetry, or counts that it could not be told.
    pub fn tell(&mut self, event: Event) {
        if self.link.tell(event).is_err() {
            self.status.losses.events += 1;
        }
    }

    /// Tells where the time of a tick went, unless telemetry has so much to catch up with that lines of the log could be lost.
    pub fn tell_timing(&mut self, timing: Timing) {
        if self.link.is_half_full() {
            self.status.losses.timings += 1;
        } else {
            self.tell(Event::Timing(timing));
        }
    }

    /// A valid sample of `source`, measured at `stamp`; whether it is fused is the estimator's business.
    pub fn valid(&mut self, input: Input, source: u16, stamp: Stamp) {
        self.watch.valid(input, stamp);
        self.sources.valid(input, source, stamp, self.now);
    }

    /// An input that is no valid sample of its sensor.
    pub fn invalid(&mut self, input: Input, source: u16, reason: Reject) {
        self.watch.invalid(input, self.now);
        self.sources.invalid(input, source, self.now);
        self.count_rejected((input, source), reason, None);
    }

    /// An input that was here before, or that a newer one stands for: no fault of its sensor.
    pub fn repeated(&mut self, input: Input, source: u16, reason: Reject) {
        self.sources.repeated(input, source);
        self.count_rejected((input, source), reason, None);
    }

    /// Something came of `input` that cannot even be decoded.
    pub fn undecodable(&mut self, input: Input) {
        self.watch.invalid(input, self.now);
    }

    /// Messages of some publisher cannot be read.
    pub fn unreadable(&mut self, input: Input) {
        self.watch.invalid(input, self.now);
        self.status.losses.unreadable += 1;
    }

    /// The channel of `input` has no place for this robot.
    pub fn deaf(&mut self, input: Input) {
        self.watch.broken(input, true);
    }

    /// The channel of `robot` has no place for this one.
    pub fn unreachable(&mut self, robot: u16) {
        self.sources.unreachable(robot);
    }

    /// So many messages have not reached everybody, since the start.
    pub fn undelivered(&mut self, messages: u64) {
        self.status.losses.undelivered = messages;
    }

    /// What is known of who speaks on the channel of `input`.
    pub fn sessions(&mut self, input: Input, states: impl Iterator<Item = SourceState>) {
        for state in states {
            if self.sources.sessions(input, &state) {
                self.tell(Event::Contested { input, state });
            }
        }
    }

    fn count_rejected(&mut self, (input, source): (Input, u16), reason: Reject, d2: Option<f64>) {
        let count = self
            .status
            .rejected
            .get_mut(input as usize)
            .and_then(|reasons| reasons.get_mut(reason as usize));
        if let Some(count) = count {
            *count += 1;
        }
        let gate = self.sources.gate(input);
        self.tell(Event::Rejected {
            input,
            source,
            reason,
            gated: d2.map(|d2| Gated { d2, gate }),
        });
    }

    /// What the estimator made of the measurements that it was `given`.
    pub fn outputs(&mut self, outputs: &TickOutputs<'_>, given: &[Measurement]) {
        outputs
            .reports
            .iter()
            .for_each(|report| self.verdict(report));
        for (source, samples) in driven(given, outputs.reports) {
            self.accepted(Source::new(Kind::Odometry, source), samples, None);
        }
        for told in outputs.outgoing {
            self.accepted(Source::new(Kind::Sighting, told.by), 1, None);
        }
        self.no_room(outputs.overflowed, outputs.folded_early);
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

    fn no_room(&mut self, overflowed: u32, folded_early: u32) {
        if overflowed > 0 || folded_early > 0 {
            self.status.losses.overflowed += u64::from(overflowed);
            self.status.losses.folded_early += u64::from(folded_early);
            self.tell(Event::NoRoom {
                overflowed,
                folded_early,
            });
        }
    }

    fn verdict(&mut self, report: &Report) {
        let (input, source) = (input(report.source.kind), report.source.number);
        let d2 = d2(report.verdict);
        match reason(report.verdict) {
            None => self.accepted(report.source, 1, d2),
            Some(Reject::Replayed) => self.repeated(input, source, Reject::Replayed),
            Some(reason) => {
                self.watch.refused(input, d2.is_some());
                self.sources.refused(input, source, d2, self.now);
                self.count_rejected((input, source), reason, d2);
            }
        }
    }

    fn accepted(&mut self, source: Source, count: u64, d2: Option<f64>) {
        let input = input(source.kind);
        if let Some(total) = self.status.accepted.get_mut(input as usize) {
            *total += count;
        }
        if count > 0 {
            self.watch.passed(input);
            self.sources.accepted(input, source.number, count, d2);
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

    /// Every input's health at this tick, and what the robot may say of that belief.
    pub fn health(&mut self, belief: &Belief) -> ([Health; Input::COUNT], Standing) {
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
        let standing = self.watch.standing(health, belief);
        self.status.fit = u8::from(standing.fit);
        let from = BeliefState::from_byte(self.status.state);
        self.status.state = standing.state as u8;
        if from != standing.state {
            self.tell(Event::State {
                from,
                to: standing.state,
                tick: self.status.tick,
            });
        }
        (health, standing)
    }

    /// How the wheels' buses are doing; whether odometry comes over them `alone`, so that without them there is none.
    pub fn buses(&mut self, worst: BusState, alone: bool) {
        let from = BusState::from_byte(std::mem::replace(&mut self.status.bus, worst as u8));
        if from != worst {
            self.tell(Event::Bus { from, to: worst });
        }
        self.watch
            .broken(Input::Odometry, alone && worst >= BusState::Off);
    }

    /// What was counted of odometry since the start.
    pub fn odometry(&mut self, counters: CanCounters) {
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

    /// Whether the next tick that is closed at `now_ns` closes the books of a second.
    #[must_use]
    pub fn is_report_due(&self, now_ns: i64) -> bool {
        now_ns >= self.next_report_ns
    }

    /// Closes the tick: latency, heartbeat and, once a second, the books.
    pub fn close(&mut self, now_ns: i64, latency_ns: u64) {
        self.ledger.record(latency_ns);
        self.status.tick += 1;
        self.link.beat(self.status.tick);
        if self.is_report_due(now_ns) {
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
        self.status.header = self.sender.header(self.sent_ns);
        self.status.sources = *self.sources.rows(self.now);
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

/// How far a measurement that met a gate was off.
fn d2(verdict: Verdict) -> Option<f64> {
    match verdict {
        Verdict::Accepted { d2 } | Verdict::Gated { d2 } => Some(d2),
        _ => None,
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
        account.health(&Belief::default());
        assert_eq!(link.waiting(), 0);
        account.valid(Input::Position, 0, Stamp::default());
        account.health(&Belief::default());
        account.health(&Belief::default());
        assert_eq!(link.waiting(), 1);
        assert_eq!(account.status.health_of(Input::Position), Health::Ok);
    }

    #[test]
    fn a_bus_that_is_off_is_a_fault_only_where_odometry_comes_over_nothing_else() {
        let (mut account, _link) = account();
        account.valid(Input::Odometry, 3, Stamp::default());
        for (alone, expected) in [(false, Health::Ok), (true, Health::Faulty)] {
            account.buses(BusState::Off, alone);
            account.health(&Belief::default());
            assert_eq!(account.status.health_of(Input::Odometry), expected);
        }
    }

    #[test]
    fn missed_deadlines_add_up_and_the_worst_stays() {
        let (mut account, _link) = account();
        for (missed, lateness_ns) in [(2, 50), (0, 1), (3, 20)] {
            let deadline_ns = 1000;
            let wake = Wake::Deadline {
                deadline_ns,
                missed,
            };
            let said = account.woke(wake, deadline_ns + lateness_ns);
            assert_eq!(said, lateness_ns.unsigned_abs());
        }
        let status = &account.status;
        assert_eq!((status.deadline_misses, status.worst_lateness_ns), (5, 50));
    }

    #[test]
    fn times_of_ticks_leave_room_for_everything_else() {
        let (mut account, link) = account();
        let capacity = Link::CAPACITY as u64;
        (0..capacity).for_each(|_| account.tell_timing(Timing::default()));
        (0..capacity / 2).for_each(|_| account.invalid(Input::Neighbour, 2, Reject::Gated));
        let losses = account.status.losses;
        assert_eq!((losses.timings, losses.events), (capacity / 2, 0));
        assert!(link.is_full());
    }

    #[test]
    fn a_full_ring_loses_events_and_counts_them_but_no_latency() {
        let (mut account, link) = account();
        let capacity = Link::CAPACITY as u64;
        (0..capacity + 5).for_each(|_| account.invalid(Input::Neighbour, 2, Reject::Gated));
        assert_eq!(account.status.losses.events, 5);
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
