//! Step 5 of the tick: what it took, what was turned away, and what telemetry should know.
//!
//! [`Account`] is what the tick calls; each thing that it counts or tells has a room of its own. How inputs are doing is
//! [`health`](crate::health)'s to say.

mod beliefs;
mod books;
mod changes;
mod counters;
mod deadlines;
mod dissents;
mod driven;
mod ledger;
mod losses;
mod recording;
mod verdicts;

use std::hint::black_box;
use std::sync::Arc;

use coloc_drivers::canopen::CanopenEvent;
use coloc_drivers::encoder::Slip;
use coloc_estimator::assist::assistant::Counts;
use coloc_estimator::assist::news::News;
use coloc_estimator::{
    Belief, Decision, Estimate, Finding, FindingState, Kind, Measurement, Report, Stamp,
    TickOutputs,
};
use coloc_shm_types::{
    AssistCounters, BusState, CanCounters, Health, Input, Opinion, Reject, Sender, SourceState,
    Status, Timing,
};

use crate::config::Config;
use crate::event::{Event, Gated, Link};
use crate::health::{Fact, Standing, Watch};
use crate::record::Record;
use crate::wait::Wake;
use beliefs::Beliefs;
use books::Books;
use changes::Changes;
use counters::Counters;
use deadlines::Deadlines;
use dissents::Dissents;
use driven::driven;
use losses::Teller;
use recording::Recording;

pub use ledger::Ledger;

/// Counts, on the real-time thread.
#[derive(Debug)]
pub struct Account {
    sender: Sender,
    now: Stamp,
    /// What others call the moment `now` \[ns of the configured clock\].
    sent_ns: i64,
    watch: Watch,
    counters: Counters,
    changes: Changes,
    deadlines: Deadlines,
    recording: Recording,
    beliefs: Beliefs,
    dissents: Dissents,
    books: Books,
    teller: Teller,
}

/// Which sensor or robot of a kind.
type Of = (Input, u16);

impl Account {
    /// Reports through `link`; hands on the belief as often as the configuration says, if it is to be saved.
    #[must_use]
    pub fn new(config: &Config, link: Arc<Link>, sender: &Sender) -> Self {
        Self {
            sender: sender.beside(),
            now: Stamp::default(),
            sent_ns: 0,
            watch: Watch::new(config),
            counters: Counters::default(),
            changes: Changes::default(),
            deadlines: Deadlines::default(),
            recording: Recording::new(&config.telemetry),
            beliefs: Beliefs::new(config),
            dissents: Dissents::default(),
            books: Books::default(),
            teller: Teller::new(link),
        }
    }

    /// A tick stamped `now` begins, or one that may become a tick; `sent_ns` is what others call that moment.
    pub fn begin(&mut self, now: Stamp, sent_ns: i64) {
        self.now = now;
        self.sent_ns = sent_ns;
    }

    /// Ticks since the start.
    #[must_use]
    pub fn tick(&self) -> u64 {
        self.books.tick
    }

    /// A valid sample of `source`, measured at `stamp`; whether it is fused is the estimator's business.
    pub fn valid(&mut self, input: Input, source: u16, stamp: Stamp) {
        self.watch
            .note((input, source), Fact::Valid(stamp), self.now);
    }

    /// An input that is no valid sample of its sensor.
    pub fn invalid(&mut self, input: Input, source: u16, reason: Reject) {
        self.rejected((input, source), Fact::Invalid, reason);
    }

    /// An input that was here before, or that a newer one stands for: no fault of its sensor.
    pub fn repeated(&mut self, input: Input, source: u16, reason: Reject) {
        self.rejected((input, source), Fact::Repeated, reason);
    }

    /// Something came of `input` that cannot even be decoded.
    pub fn undecodable(&mut self, input: Input) {
        self.watch.note_garbage(input, self.now);
    }

    /// Messages of some publisher cannot be read.
    pub fn unreadable(&mut self, input: Input) {
        self.watch.note_garbage(input, self.now);
        self.teller.losses.unreadable += 1;
    }

    /// The channel of `input` has no place for this robot.
    pub fn deaf(&mut self, input: Input) {
        self.watch.broken(input, true);
    }

    /// The channel of `robot` has no place for this one.
    pub fn unreachable(&mut self, robot: u16) {
        self.watch.unreachable(robot);
    }

    /// How the wheels' buses are doing; whether odometry comes over them `alone`, so that without them there is none.
    pub fn buses(&mut self, worst: BusState, alone: bool) {
        self.watch.buses(worst, alone);
        self.changes.buses(worst, &mut self.teller);
    }

    /// Of a CANopen node, or of who sends SYNC.
    pub fn canopen(&mut self, event: CanopenEvent) {
        self.teller.tell(Event::Canopen(event));
    }

    /// Wheels that do not fit the others, now.
    pub fn slip(&mut self, slip: Option<Slip>) {
        self.changes.slip(slip, &mut self.teller);
    }

    /// What was counted of odometry since the start.
    pub fn odometry(&mut self, counters: CanCounters) {
        self.counters.odometry = counters;
    }

    /// Who speaks on the channel of `input`, as far as its [`Sessions`](coloc_shm_types::Sessions) know it.
    pub fn sessions(&mut self, input: Input, state: impl Fn(u16) -> Option<SourceState>) {
        let tell = |state| self.teller.tell(Event::Contested { input, state });
        self.watch.sessions(input, state, tell);
    }

    /// What the estimator made of the measurements that it was `given`.
    pub fn outputs(&mut self, outputs: &TickOutputs<'_>, given: &[Measurement]) {
        for report in outputs.reports {
            self.verdict(report);
        }
        for (source, count) in driven(given, outputs.reports) {
            self.passed(source.kind, source.number, count);
        }
        for told in outputs.outgoing {
            self.passed(Kind::Sighting, told.by, 1);
        }
        for told in outputs.seen {
            self.passed(Kind::Partial, told.sighting.sensor, 1);
        }
        self.teller.no_room(outputs);
        self.changes
            .gyro(outputs.estimate.gyro, self.now, &mut self.teller);
        for decided in outputs.finding.decisions() {
            self.decided(decided);
        }
        if outputs.finding.state == FindingState::Ok {
            self.beliefs.next(&outputs.estimate, &mut self.teller);
        }
    }

    fn decided(&mut self, (stamp, decision): &(Stamp, Decision)) {
        let source = decision.source();
        self.teller.tell(Event::Decided {
            input: verdicts::input(source.kind),
            source: source.number,
            decision: *decision,
            ago_ns: (self.now - *stamp).as_nanos(),
        });
    }

    fn verdict(&mut self, report: &Report) {
        let of = (verdicts::input(report.source.kind), report.source.number);
        let fact = verdicts::fact(report.verdict);
        match verdicts::reason(report.verdict) {
            None => self.accepted(of, fact, 1),
            Some(reason) => self.rejected(of, fact, reason),
        }
    }

    /// Of what meets no gate.
    fn passed(&mut self, kind: Kind, source: u16, count: u64) {
        if count > 0 {
            let of = (verdicts::input(kind), source);
            self.accepted(of, Fact::Passed { count, d2: None }, count);
        }
    }

    fn accepted(&mut self, of: Of, fact: Fact, count: u64) {
        self.watch.note(of, fact, self.now);
        self.counters.accept(of.0, count);
    }

    fn rejected(&mut self, of: Of, fact: Fact, reason: Reject) {
        self.watch.note(of, fact, self.now);
        let gate = self.watch.gate(of.0);
        let gated = fact.gated().map(|d2| Gated { d2, gate });
        self.counters.reject(of, reason, gated, &mut self.teller);
    }

    /// The last belief, due or not: who is started again goes on from there. What is not sure of itself is not worth it.
    pub fn last(&mut self, estimate: &Estimate, finding: &Finding) {
        if finding.state == FindingState::Ok {
            self.beliefs.last(estimate, &mut self.teller);
        }
    }

    /// Every input's health at this tick, and what the robot may say of that belief.
    pub fn health(
        &mut self,
        belief: &Belief,
        finding: &Finding,
    ) -> ([Health; Input::COUNT], Standing) {
        let mut health = self.watch.at(self.now);
        let standing = self.watch.standing(health, belief, finding);
        self.changes.parted(&mut health);
        let tick = self.tick();
        if self
            .dissents
            .update(finding.dissents(), self.now, &mut self.teller)
        {
            self.watch.against(self.dissents.those());
        }
        self.changes.health(health, tick, &mut self.teller);
        self.changes
            .standing(standing, belief, tick, &mut self.teller);
        (health, standing)
    }

    /// What is said of a second opinion whose newest word is `newest`, by the health of its channel.
    #[allow(clippy::indexing_slicing)] // One place for each of the inputs' numbers.
    pub fn opinion(&mut self, newest: Opinion, health: [Health; Input::COUNT]) -> Opinion {
        let is_silent = health[Input::Integrity as usize] != Health::Ok;
        let opinion = match newest {
            Opinion::None => Opinion::None,
            _ if is_silent => Opinion::Stale,
            said => said,
        };
        let tick = self.tick();
        self.changes.opinion(opinion, tick, &mut self.teller);
        opinion
    }

    /// Does in advance what [`Self::health`] will do, and changes nothing.
    pub fn rehearse(&self, belief: &Belief, finding: &Finding) {
        let health = black_box(self.watch.at(self.now));
        black_box(self.watch.standing(health, belief, finding));
    }

    /// The wake-up's lateness \[ns\]; the deadlines that passed before it are counted.
    pub fn woke(&mut self, wake: Wake, now_ns: i64) -> u64 {
        self.deadlines.woke(wake, now_ns, &mut self.teller)
    }

    /// Hands lines on, if there is a recording.
    pub fn record(&mut self, lines: impl IntoIterator<Item = Record>) {
        self.recording.lines(lines, &mut self.teller);
    }

    /// Tells telemetry, or counts that it could not be told.
    pub fn tell(&mut self, event: Event) {
        self.teller.tell(event);
    }

    /// Tells where the time of a tick went, unless telemetry has so much to catch up with that lines of the log could be lost.
    pub fn tell_timing(&mut self, timing: Timing) {
        self.teller.tell_timing(timing);
    }

    /// So many messages have not reached everybody, since the start.
    pub fn undelivered(&mut self, messages: u64) {
        self.teller.losses.undelivered = messages;
    }

    /// What became of what leaders said, since the start.
    pub fn assisted(&mut self, counts: &Counts) {
        self.counters.assist = AssistCounters {
            accepted: counts.accepted,
            declined: counts.declined,
            forwarded: counts.forwarded,
            timed_out: counts.timed_out,
            freed_late: counts.freed_late,
            closed_early: counts.closed_early,
            disagreed: counts.disagreed,
            mutes: counts.mutes,
            mute: counts.mute.0,
            reserved: [0; 4],
        };
    }

    /// What there is to say of that.
    pub fn assist_news(&mut self, news: &[News]) {
        for it in news {
            self.teller.tell(Event::Assist(*it));
        }
    }

    /// Whether the next tick that is closed at `now_ns` closes the books of a second.
    #[must_use]
    pub fn is_report_due(&self, now_ns: i64) -> bool {
        self.books.are_due(now_ns)
    }

    /// Closes the tick: latency, heartbeat and, once a second, the books.
    pub fn close(&mut self, now_ns: i64, latency_ns: u64) {
        let link = &self.teller.link;
        if let Some(mut full) = self.books.close(now_ns, latency_ns, link) {
            full.status.header = self.sender.header(self.sent_ns);
            self.write_to(&mut full.status);
            self.teller.tell(Event::Account(full));
        }
    }

    /// All counters since the start.
    #[must_use]
    pub fn status(&self) -> Status {
        let mut status = Status::default();
        self.write_to(&mut status);
        status
    }

    fn write_to(&self, status: &mut Status) {
        status.tick = self.tick();
        status.losses = self.teller.losses;
        self.deadlines.write_to(status);
        self.counters.write_to(status);
        self.changes.write_to(status);
        self.watch.write_to(status, self.now);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_estimator::{Motion, OdometrySample, Source, Verdict};
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
        account.health(&Belief::default(), &Finding::default());
        assert_eq!(link.waiting(), 0);
        account.valid(Input::Position, 0, Stamp::default());
        account.health(&Belief::default(), &Finding::default());
        account.health(&Belief::default(), &Finding::default());
        assert_eq!(link.waiting(), 1);
        assert_eq!(account.status().health_of(Input::Position), Health::Ok);
    }

    #[test]
    fn a_bus_that_is_off_is_a_fault_only_where_odometry_comes_over_nothing_else() {
        let (mut account, _link) = account();
        account.valid(Input::Odometry, 3, Stamp::default());
        for (alone, expected) in [(false, Health::Ok), (true, Health::Faulty)] {
            account.buses(BusState::Off, alone);
            account.health(&Belief::default(), &Finding::default());
            assert_eq!(account.status().health_of(Input::Odometry), expected);
        }
    }

    /// Of samples of these sources, one of source 3 was too old.
    fn refuse_one(account: &mut Account, sources: &[u16], stamp: Stamp) {
        let sample = |&source| {
            Measurement::from(OdometrySample {
                source,
                start: Stamp::default(),
                stamp,
                motion: Motion::standstill([1.0; 3]),
            })
        };
        let too_old = Report {
            source: Source::new(Kind::Odometry, 3),
            stamp,
            verdict: Verdict::TooOld,
        };
        let outputs = TickOutputs {
            estimate: Estimate::default(),
            finding: &Finding::default(),
            shared: None,
            outgoing: &[],
            seen: &[],
            answers: &[],
            reports: &[too_old],
            overflowed: 0,
            folded_early: 0,
        };
        let given: Vec<_> = sources.iter().map(sample).collect();
        account.outputs(&outputs, &given);
    }

    /// All of it used to count for the first one.
    #[test]
    fn odometry_counts_for_the_source_that_it_came_from() {
        let (mut account, _link) = account();
        let stamp = Stamp::from_nanos(20_000_000);
        account.begin(stamp, 0);
        refuse_one(&mut account, &[0, 3, 3], stamp);
        let status = account.status();
        let rows = status.sources().map(|(_, row)| row);
        let mut counts: Vec<_> = rows
            .map(|it| (it.source, it.accepted, it.rejected))
            .collect();
        counts.sort_unstable();
        assert_eq!(counts, [(0, 1, 0), (3, 1, 1)]);
        assert_eq!(status.accepted_of(Input::Odometry), 2);
        assert_eq!(status.rejected_of(Input::Odometry, Reject::TooOld), 1);
    }

    /// Nothing of it moved the robot: that is no good news of the wheels.
    #[test]
    fn odometry_that_is_refused_whole_has_not_passed() {
        let (mut account, _link) = account();
        for millis in [20, 40, 60] {
            let stamp = Stamp::from_nanos(1_000_000 * millis);
            account.begin(stamp, 0);
            account.valid(Input::Odometry, 3, stamp);
            refuse_one(&mut account, &[3], stamp);
        }
        let (health, _) = account.health(&Belief::default(), &Finding::default());
        assert_eq!(health[Input::Odometry as usize], Health::Refused);
    }

    #[test]
    fn a_full_ring_loses_events_and_counts_them_but_no_counter() {
        let (mut account, link) = account();
        let capacity = Link::CAPACITY as u64;
        (0..capacity + 5).for_each(|_| account.invalid(Input::Neighbour, 2, Reject::Gated));
        let status = account.status();
        assert_eq!(status.losses.events, 5);
        let rejected = status.rejected_of(Input::Neighbour, Reject::Gated);
        assert_eq!(rejected, capacity + 5);
        while link.next_event().is_some() {}
        account.close(1, 100);
        let Some(Event::Account(ledger)) = link.next_event() else {
            panic!("the first second's books")
        };
        assert_eq!(ledger.status.losses, status.losses);
        assert_eq!(ledger.status.rejected, status.rejected);
        assert_eq!((ledger.status.tick, account.tick()), (1, 1));
    }
}
