//! Three sources that speak on one channel: late, twice, not at all, under clocks of their own, and started again now and then.

use std::collections::{BTreeSet, VecDeque};

use coloc_daemon::clock::Moment;
use coloc_shm_types::{Clock, Header, Limits, Position, Present, Reject, Sessions, boot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::world::{WIDEST_NS, World};
use super::{Fault, PERIOD_NS, Tally, demand};

const MS: i64 = 1_000_000;

/// As many messages of one source wait for the robot as on the real channel; a new one pushes out the oldest.
const WAITING: usize = 64;

/// A measurement older than this is of no use.
const HISTORY_NS: i64 = 1000 * MS;
const FUTURE_NS: i64 = 100 * MS;

/// A stamp is as good as the reading of the clocks \[ns\].
const STAMP_NS: i64 = 400_000;

/// On the way so long at most \[ns\]; a copy longer.
const LONGEST_NS: i64 = 80 * MS;
const COPY_NS: i64 = 200 * MS;

#[derive(Debug)]
pub(super) struct Speakers {
    random: ChaCha8Rng,
    sources: [Speaker; 3],
    sessions: Sessions,
}

/// A process takes so long to start: no source has more sessions under way than the robot keeps \[ns\].
const RESTART_NS: i64 = 500 * MS;

/// A source, its life, and what became of its words.
#[derive(Debug)]
struct Speaker {
    number: u16,
    clock: Clock,
    period_ns: i64,
    next_ns: i64,
    session: u64,
    begun_ns: i64,
    sequence: u64,
    /// When they arrive.
    under_way: Vec<(i64, Word)>,
    queue: VecDeque<Word>,
    accepted: BTreeSet<(u64, u64)>,
    /// The first and the highest of each session that was heard.
    heard: Vec<(u64, u64, u64)>,
}

/// A message, and when it was really measured.
#[derive(Copy, Clone, Debug)]
struct Word {
    header: Header,
    true_ns: i64,
}

impl Speakers {
    pub(super) fn new(episode: u64, begin_ns: i64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(episode ^ 0x5EED_0F5B_EA6E_2555);
        let clocks = [Clock::Boottime, Clock::Realtime, Clock::Realtime];
        let mut number = 0;
        let sources = clocks.map(|clock| {
            let speaker = Speaker::new(number, clock, begin_ns, &mut random);
            number += 1;
            speaker
        });
        Self {
            random,
            sources,
            sessions: Sessions::new(Sessions::SENSORS),
        }
    }

    /// All that happens until now.
    pub(super) fn speak(&mut self, world: &World) {
        for source in &mut self.sources {
            while source.next_ns <= world.now_ns {
                source.say(world, &mut self.random);
            }
            source.deliver(world.now_ns);
        }
    }

    /// The robot takes in what has arrived.
    pub(super) fn hear(
        &mut self,
        moment: &Moment,
        world: &World,
        tally: &mut Tally,
    ) -> Result<(), Fault> {
        for source in &mut self.sources {
            while let Some(word) = source.queue.pop_front() {
                let inner = moment.inner(&word.header);
                let heard = check(inner, moment).and_then(|()| {
                    let now_ns = moment.stamp.as_nanos();
                    self.sessions.accept(&inner, now_ns)
                });
                tally.messages += 1;
                source.judge(&word, &inner, heard, world)?;
            }
        }
        Ok(())
    }

    /// All is over: every message that is missing is counted.
    pub(super) fn close(&self, now_ns: i64) -> Result<(), Fault> {
        for source in &self.sources {
            let lost = self.sessions.state(source.number, now_ns);
            let lost = lost.map_or(0, |state| state.lost);
            let [least, most] = source.missing();
            demand((least..=most).contains(&lost), || {
                let number = source.number;
                format!("source {number}: {lost} are called lost, {least} to {most} are")
            })?;
        }
        Ok(())
    }
}

/// What the daemon checks before it asks who speaks.
fn check(header: Header, moment: &Moment) -> Result<(), Reject> {
    let limits = Limits {
        now: Present::only(Clock::Boottime, moment.stamp.as_nanos()),
        boot: boot(),
        history_ns: HISTORY_NS,
        future_tolerance_ns: FUTURE_NS,
        own: 1,
        robots: &[1],
    };
    let fix = Position {
        header,
        quality: 4,
        covariance: [1.0, 0.0, 0.0, 1.0],
        ..Position::default()
    };
    fix.validate(&limits)
}

impl Speaker {
    fn new(number: u16, clock: Clock, begin_ns: i64, random: &mut ChaCha8Rng) -> Self {
        let period_ns = random.random_range(10 * MS..400 * MS);
        Self {
            number,
            clock,
            period_ns,
            next_ns: begin_ns + random.random_range(0..period_ns),
            session: random.random(),
            begun_ns: begin_ns,
            sequence: 0,
            under_way: Vec::new(),
            queue: VecDeque::new(),
            accepted: BTreeSet::new(),
            heard: Vec::new(),
        }
    }

    fn say(&mut self, world: &World, random: &mut ChaCha8Rng) {
        let true_ns = self.next_ns;
        if random.random_bool(0.003) && true_ns - self.begun_ns >= RESTART_NS {
            (self.session, self.sequence) = (random.random(), 0);
            self.begun_ns = true_ns;
        }
        let stamp_ns = match self.clock {
            Clock::Boottime => true_ns,
            _ => world.wall_ns(true_ns),
        };
        let header = Header {
            stamp_ns,
            session: self.session,
            sequence: self.sequence,
            boot: boot(),
            source: self.number,
            clock: self.clock as u8,
            ..Header::default()
        };
        let word = Word { header, true_ns };
        if random.random_bool(0.97) {
            let after_ns = random.random_range(0..LONGEST_NS);
            self.under_way.push((true_ns + after_ns, word));
            if random.random_bool(0.02) {
                let again_ns = random.random_range(after_ns..COPY_NS);
                self.under_way.push((true_ns + again_ns, word));
            }
        }
        self.sequence += 1;
        self.next_ns += self.period_ns + random.random_range(-MS..MS);
    }

    fn deliver(&mut self, now_ns: i64) {
        let arrived = self.under_way.extract_if(.., |(at_ns, _)| *at_ns <= now_ns);
        let mut arrived: Vec<_> = arrived.collect();
        arrived.sort_by_key(|(at_ns, _)| *at_ns);
        for (_, word) in arrived {
            self.queue.push_back(word);
            if self.queue.len() > WAITING {
                self.queue.pop_front();
            }
        }
    }

    /// Whether what became of a message is as it must be.
    fn judge(
        &mut self,
        word: &Word,
        inner: &Header,
        heard: Result<(), Reject>,
        world: &World,
    ) -> Result<(), Fault> {
        let key = (word.header.session, word.header.sequence);
        let off_ns = inner.stamp_ns - word.true_ns;
        let age_ns = world.now_ns - word.true_ns;
        let doubt_ns = self.doubt_ns(word, world);
        demand(off_ns.abs() <= STAMP_NS + doubt_ns, || {
            format!("{word:?} is read {off_ns} ns off; {doubt_ns} are in doubt")
        })?;
        let right = match heard {
            Ok(()) => self.accepted.insert(key),
            Err(Reject::Replayed) => self.accepted.contains(&key),
            Err(Reject::TooOld) => age_ns + doubt_ns + STAMP_NS > HISTORY_NS,
            Err(Reject::FromFuture) => doubt_ns > FUTURE_NS - STAMP_NS,
            Err(_) => false,
        };
        if heard.is_ok() {
            self.note(key);
        }
        demand(right, || format!("{word:?}, {age_ns} ns old: {heard:?}"))
    }

    fn note(&mut self, (session, sequence): (u64, u64)) {
        match self.heard.iter_mut().find(|(own, ..)| *own == session) {
            Some((_, _, highest)) => *highest = sequence.max(*highest),
            None => self.heard.push((session, sequence, sequence)),
        }
    }

    /// A wall clock that is set while a message is under way, or between the same two looks at the clock, leaves in doubt what
    /// it means.
    fn doubt_ns(&self, word: &Word, world: &World) -> i64 {
        if self.clock == Clock::Boottime {
            return 0;
        }
        let look_ns = 3 * PERIOD_NS + world.stopped_ns;
        let since = |&&(at_ns, by_ns): &&(i64, i64)| {
            let latest_ns = world.now_ns + WIDEST_NS;
            (word.true_ns - by_ns.abs() - look_ns..=latest_ns).contains(&at_ns)
        };
        world
            .steps
            .iter()
            .filter(since)
            .map(|step| step.1.abs())
            .sum()
    }

    /// At least and at most so many are missing among those up to the newest that was heard of each session: before the first
    /// one nobody knows.
    fn missing(&self) -> [u64; 2] {
        let mut missing = [0; 2];
        for &(session, first, highest) in &self.heard {
            let gone = |from: u64| {
                let all = from..=highest;
                all.filter(|it| !self.accepted.contains(&(session, *it)))
                    .count() as u64
            };
            missing = [missing[0] + gone(first), missing[1] + gone(0)];
        }
        missing
    }
}
