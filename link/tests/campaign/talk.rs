//! What robots say to one another, and when it is heard.
use std::time::{Duration, Instant};

use coloc_shm_types::{Clock, Header, Neighbour, Publisher, Sender, Subscriber};

use crate::support::wall_ns;
use crate::team::Robot;

/// From one look at what was heard to the next.
const LOOK: Duration = Duration::from_millis(1);

/// Who is late catches up by so many at a time.
const MOST_AT_ONCE: usize = 8;

/// One robot that tells another where it saw it.
struct Pair {
    port: Publisher<Neighbour>,
    sender: Sender,
    from: u16,
    to: u16,
    /// Number of the next word.
    next: u64,
}

/// What was heard of a pair since somebody looked.
#[derive(Clone, Debug, Default)]
pub(crate) struct Heard {
    /// How often each was heard that was said since, by its number.
    words: Vec<u8>,
    /// Number of the first of them, and of what session it is.
    first: u64,
    session: u64,
    /// The longest between two (s).
    pub(crate) gap_s: f64,
    /// The oldest when it was heard (s).
    pub(crate) oldest_s: f64,
    /// The most that a stamp was off when it was heard (s).
    pub(crate) stamp_off_s: f64,
    last_ns: i64,
    /// When the newest of them was said.
    said_ns: i64,
}

/// All that is said and heard.
pub(crate) struct Talk {
    pairs: Vec<Pair>,
    ears: Vec<(u16, Subscriber<Neighbour>)>,
    period: Duration,
    next: Instant,
    pub(crate) said: usize,
    began_ns: i64,
    pub(crate) heard: std::collections::BTreeMap<(u16, u16), Heard>,
}

impl Talk {
    /// Each pair of `who`, from whom to whom, so often a second.
    pub(crate) fn new(robots: &[Robot], who: impl Fn(u16, u16) -> bool, hz: f64) -> Self {
        let pair = |from: &Robot, to: &Robot| Pair {
            port: from.space.publisher(&to.name()).unwrap(),
            sender: Sender::start(from.id, Clock::Realtime).unwrap(),
            from: from.id,
            to: to.id,
            next: 0,
        };
        let all = robots.iter();
        let all = all.flat_map(|from| robots.iter().map(move |to| (from, to)));
        let wanted = all.filter(|(from, to)| from.id != to.id && who(from.id, to.id));
        let pairs: Vec<_> = wanted.map(|(from, to)| pair(from, to)).collect();
        let ears = robots.iter();
        let ears = ears.map(|it| (it.id, it.space.subscriber(&it.name()).unwrap()));
        let mut talk = Self {
            pairs,
            ears: ears.collect(),
            period: Duration::from_secs_f64(1.0 / hz),
            next: Instant::now(),
            said: 0,
            began_ns: wall_ns(),
            heard: std::collections::BTreeMap::new(),
        };
        talk.forget();
        talk
    }

    /// Says what is due, and hears what came.
    pub(crate) fn turn(&mut self) {
        for _ in 0..MOST_AT_ONCE {
            if Instant::now() < self.next {
                break;
            }
            self.next += self.period;
            for pair in &mut self.pairs {
                let said_ns = wall_ns();
                let told = Neighbour {
                    header: pair.sender.header(said_ns),
                    // What the link does not change: when it was said.
                    pose: [seconds(said_ns - self.began_ns), 0.0, 0.0],
                    independent: [0.1, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1],
                    ..Neighbour::default()
                };
                pair.next = told.header.sequence + 1;
                // Who does not hear it is counted as not having heard it.
                let _ = pair.port.send(told);
                self.said += 1;
            }
        }
        self.listen();
    }

    fn listen(&mut self) {
        for (to, ear) in &self.ears {
            while let Ok(Some(told)) = ear.receive() {
                let now_ns = wall_ns();
                let heard = self.heard.entry((told.header.source, *to)).or_default();
                heard.note(&told.header, now_ns);
                let stamp_s = seconds(told.header.stamp_ns - self.began_ns);
                heard.stamp_off_s = heard.stamp_off_s.max((stamp_s - told.pose[0]).abs());
            }
        }
        std::thread::sleep(LOOK);
    }

    /// Hears what is still on its way, and says nothing.
    pub(crate) fn wait(&mut self, seconds: f64) {
        let begin = Instant::now();
        while begin.elapsed().as_secs_f64() < seconds {
            self.listen();
        }
    }

    /// For so long.
    pub(crate) fn go_on(&mut self, seconds: f64) {
        let begin = Instant::now();
        while begin.elapsed().as_secs_f64() < seconds {
            self.turn();
        }
    }

    /// Until something said after now is heard by this pair; how long that took (s).
    pub(crate) fn until_heard(&mut self, from: u16, to: u16) -> f64 {
        let begin = Instant::now();
        self.forget();
        let since_ns = wall_ns();
        loop {
            self.turn();
            let heard = self.heard.get(&(from, to));
            if heard.is_some_and(|it| it.said_ns >= since_ns) {
                return begin.elapsed().as_secs_f64();
            }
            assert!(
                begin.elapsed() < crate::support::PATIENCE,
                "{from} is never heard by {to}"
            );
        }
    }

    /// Until all pairs are heard.
    pub(crate) fn until_all_are_heard(&mut self) {
        let pairs: Vec<_> = self.pairs.iter().map(|it| (it.from, it.to)).collect();
        for (from, to) in pairs {
            self.until_heard(from, to);
        }
        self.forget();
    }

    pub(crate) fn forget(&mut self) {
        self.said = 0;
        for pair in &self.pairs {
            let heard = self.heard.entry((pair.from, pair.to)).or_default();
            *heard = Heard {
                first: pair.next,
                session: pair.sender.session(),
                last_ns: heard.last_ns,
                said_ns: heard.said_ns,
                ..Heard::default()
            };
        }
    }

    /// How many were heard of those that were said since, each counted once.
    pub(crate) fn count(&self) -> usize {
        self.counted(1)
    }

    /// How many of them were heard more than once.
    pub(crate) fn twice(&self) -> usize {
        self.counted(2)
    }

    fn counted(&self, times: u8) -> usize {
        self.heard.values().map(|it| it.counted(times)).sum()
    }

    /// The longest that anybody was not heard (s), but for pairs with `but`.
    pub(crate) fn longest_gap_s(&self, but: Option<u16>) -> f64 {
        let now_ns = wall_ns();
        let concerned = self.heard.iter();
        let concerned =
            concerned.filter(|((from, to), _)| ![Some(*from), Some(*to)].contains(&but));
        let gaps = concerned.map(|(_, it)| it.gap_s.max(seconds(now_ns - it.last_ns)));
        gaps.fold(0.0, f64::max)
    }

    pub(crate) fn oldest_s(&self) -> f64 {
        let oldest = self.heard.values().map(|it| it.oldest_s);
        oldest.fold(0.0, f64::max)
    }
}

impl Heard {
    /// How many words were heard so many times.
    pub(crate) fn counted(&self, times: u8) -> usize {
        self.words.iter().filter(|it| **it >= times).count()
    }

    fn note(&mut self, header: &Header, now_ns: i64) {
        let stamp_ns = header.stamp_ns;
        if self.last_ns != 0 {
            self.gap_s = self.gap_s.max(seconds(now_ns - self.last_ns));
        }
        let place = header.sequence.checked_sub(self.first);
        let place = place.filter(|_| header.session == self.session);
        if let Some(place) = place.and_then(|it| usize::try_from(it).ok()) {
            self.words.resize(self.words.len().max(place + 1), 0);
            self.words[place] = self.words[place].saturating_add(1);
        }
        self.oldest_s = self.oldest_s.max(seconds(now_ns - stamp_ns));
        self.last_ns = now_ns;
        self.said_ns = self.said_ns.max(stamp_ns);
    }
}

#[expect(clippy::cast_precision_loss, reason = "of some seconds")]
fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
