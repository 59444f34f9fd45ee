//! What the fleet's own reader hears of each robot.

use std::collections::HashMap;
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Of both robots' ticks \[ns\].
pub(crate) const PERIOD_NS: i64 = 20_000_000;

/// Everything so far.
#[derive(Clone)]
pub(crate) struct Watch(Arc<(Mutex<State>, Condvar)>);

#[derive(Default)]
struct State {
    robots: HashMap<usize, Heard>,
    refusals: u64,
    last_refusal: String,
}

/// Of one robot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Heard {
    /// The newest start of its daemon.
    session: i64,
    /// When the first estimate of that session was stamped \[ns of the realtime clock\] and read \[ns of the monotonic clock\].
    first_stamp_ns: i64,
    first_ns: i64,
    stamp_ns: i64,
    tick: u64,
    /// Fixes accepted since that start.
    fixes: u64,
    book: Book,
}

/// What is kept about ticks.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Book {
    /// Ticks that came.
    pub(crate) ticks: i64,
    /// Deadlines without a tick.
    pub(crate) missed: i64,
    /// Longest time between two ticks \[ns\].
    pub(crate) longest_ns: i64,
}

impl Book {
    pub(crate) fn add(&mut self, other: Self) {
        self.ticks += other.ticks;
        self.missed += other.missed;
        self.longest_ns = self.longest_ns.max(other.longest_ns);
    }
}

impl Watch {
    /// Follows what a reader says with `--report`.
    pub(crate) fn new(lines: Receiver<String>) -> Self {
        let watch = Self(Arc::default());
        let own = watch.clone();
        thread::spawn(move || lines.iter().for_each(|line| own.take(&line)));
        watch
    }

    fn take(&self, line: &str) {
        let (state, changed) = &*self.0;
        state.lock().unwrap().take(line);
        changed.notify_all();
    }

    /// Waits until `answer` has one.
    fn until<T>(&self, within: Duration, answer: impl Fn(&State) -> Option<T>) -> Option<T> {
        let (state, changed) = &*self.0;
        let deadline = Instant::now() + within;
        let mut state = state.lock().unwrap();
        loop {
            if let Some(answer) = answer(&state) {
                return Some(answer);
            }
            let left = deadline.checked_duration_since(Instant::now())?;
            state = changed.wait_timeout(state, left).unwrap().0;
        }
    }

    /// When the first estimate was read of a daemon that was started after `after_ns` \[ns of the realtime clock\]: the
    /// time by the monotonic clock \[ns\].
    pub(crate) fn first_estimate(
        &self,
        robot: usize,
        after_ns: i64,
        within: Duration,
    ) -> Option<i64> {
        self.until(within, |state| {
            let heard = state.robots.get(&robot)?;
            (heard.first_stamp_ns > after_ns).then_some(heard.first_ns)
        })
    }

    /// Whether a tick is heard that is stamped after `after_ns`.
    pub(crate) fn ticks_after(&self, robot: usize, after_ns: i64, within: Duration) -> bool {
        self.until(within, |state| {
            (state.robots.get(&robot)?.stamp_ns > after_ns).then_some(())
        })
        .is_some()
    }

    /// The book of a robot since the last time.
    pub(crate) fn take_book(&self, robot: usize) -> Book {
        let mut state = self.0.0.lock().unwrap();
        let heard = state.robots.entry(robot).or_default();
        std::mem::take(&mut heard.book)
    }

    /// Whether more fixes are accepted than were when this was asked; they are told once a second.
    pub(crate) fn is_fed(&self, robot: usize, within: Duration) -> bool {
        let fixes = |state: &State| state.robots.get(&robot).map_or(0, |heard| heard.fixes);
        let before = fixes(&self.0.0.lock().unwrap());
        self.until(within, |state| (fixes(state) > before).then_some(()))
            .is_some()
    }

    /// How often a message could not be read, and the last reason.
    pub(crate) fn refusals(&self) -> (u64, String) {
        let state = self.0.0.lock().unwrap();
        (state.refusals, state.last_refusal.clone())
    }
}

impl State {
    fn take(&mut self, line: &str) {
        let words: Vec<&str> = line.split(' ').collect();
        let number = |index: usize| words.get(index).and_then(|word| word.parse().ok());
        let Some(robot) = number(0).and_then(|robot: i64| usize::try_from(robot).ok()) else {
            return; // `ready`
        };
        let heard = self.robots.entry(robot).or_default();
        match (words.get(1), number(2)) {
            (Some(&"estimate"), Some(session)) => {
                let numbers = [3, 4, 5].map(|index| number(index).unwrap_or_default());
                heard.estimate(session, numbers);
            }
            (Some(&"status"), Some(_)) => {
                heard.fixes = number(3).unwrap_or_default().unsigned_abs();
            }
            _ => {
                self.refusals += 1;
                self.last_refusal = line.into();
            }
        }
    }
}

impl Heard {
    fn estimate(&mut self, session: i64, [tick, stamp_ns, read_ns]: [i64; 3]) {
        let tick = tick.unsigned_abs();
        if session == self.session {
            self.count(tick, stamp_ns);
        } else {
            (self.session, self.first_stamp_ns, self.first_ns) = (session, stamp_ns, read_ns);
        }
        (self.tick, self.stamp_ns) = (tick, stamp_ns);
    }

    fn count(&mut self, tick: u64, stamp_ns: i64) {
        let ticks = i64::try_from(tick.saturating_sub(self.tick)).unwrap_or(i64::MAX);
        let passed_ns = stamp_ns - self.stamp_ns;
        let periods = (passed_ns + PERIOD_NS / 2) / PERIOD_NS;
        self.book.add(Book {
            ticks,
            missed: (periods - ticks).max(0),
            longest_ns: passed_ns,
        });
    }
}
