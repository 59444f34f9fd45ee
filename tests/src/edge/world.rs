//! What really happens: true times, the clock of the day, the kernel's queue, and when the process runs.

use std::collections::VecDeque;

use coloc_daemon::clock::Reading;
use coloc_drivers::can::{Frame, Received};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::encoders::Encoders;
use super::{PERIOD_NS, Tally};

const MS: i64 = 1_000_000;
const SECOND: i64 = 1000 * MS;

/// Ticks at the end in which the robot stands and nothing goes wrong, so that all that it has come is known.
pub(super) const LAST_TICKS: u32 = 100;

/// Pairs of frames at the begin in which it stands: counting starts at zero.
const STANDING: u32 = 10;

/// The clocks are not read at once; who takes longer reads again.
pub(super) const WIDEST_NS: i64 = 200_000;

#[derive(Debug)]
pub(super) struct World {
    random: ChaCha8Rng,
    /// The inner clock.
    pub(super) now_ns: i64,
    /// When the clock of the day is set, and by how much.
    pub(super) steps: Vec<(i64, i64)>,
    /// When the process is stopped, and for how long.
    stop: (i64, i64),
    /// It is the whole computer that sleeps then: nothing is received, and it wakes with another time of day.
    sleeps: bool,
    asleep: bool,
    /// When the gateway holds frames back, and until when.
    hold: (i64, i64),
    end_ns: i64,
    encoders: Encoders,
    /// When the next pair leaves the encoders, and how long after the last.
    next_ns: i64,
    last_ns: i64,
    /// Frames and when they come.
    under_way: VecDeque<(i64, Frame)>,
    queue: VecDeque<Received>,
    capacity: usize,
    /// When frames came, those that were not read yet or not long ago.
    pub(super) came_ns: VecDeque<i64>,
    pairs: u32,
    received: u64,
    pub(super) stopped_ns: i64,
    loss: f64,
    tally: Tally,
}

impl World {
    pub(super) fn new(episode: u64, ticks: u32) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(episode);
        let begin_ns = random.random_range(0..1_000_000 * SECOND);
        let length_ns = PERIOD_NS * i64::from(ticks);
        let moment = |random: &mut ChaCha8Rng| begin_ns + random.random_range(0..length_ns);
        let size_ns = (1e6 * 3.6e6_f64.powf(random.random())) as i64; // 1 ms to 1 h.
        let by_ns = if random.random() { size_ns } else { -size_ns };
        let stopped_ns = (5e7 * 600.0_f64.powf(random.random())) as i64; // 50 ms to 30 s.
        // Frames that come at once and of which some are missing are no longer told from a false count: that way is refused, and
        // counted. So it is one or the other.
        let (loss, longest_hold_ns) = if random.random() {
            (0.0, 150 * MS)
        } else {
            (0.03, 20 * MS)
        };
        Self {
            now_ns: begin_ns,
            steps: vec![(moment(&mut random), by_ns)],
            stop: (moment(&mut random), stopped_ns),
            sleeps: random.random_bool(0.25),
            asleep: false,
            hold: (moment(&mut random), random.random_range(0..longest_hold_ns)),
            end_ns: begin_ns + length_ns,
            encoders: Encoders::new(&mut random),
            next_ns: begin_ns + PERIOD_NS / 2,
            last_ns: begin_ns,
            under_way: VecDeque::new(),
            queue: VecDeque::new(),
            came_ns: VecDeque::new(),
            pairs: 0,
            received: 0,
            stopped_ns,
            capacity: random.random_range(200..8000),
            loss,
            tally: Tally::default(),
            random,
        }
    }

    pub(super) fn tally(&self) -> Tally {
        let set = self.steps.iter().filter(|step| step.0 <= self.now_ns);
        Tally {
            steps: set.count() as u64,
            ..self.tally
        }
    }

    /// The wheels, as far as they have come \[m\].
    pub(super) fn ways_m(&self) -> [f64; 2] {
        self.encoders.ways_m()
    }

    fn is_over(&self) -> bool {
        self.next_ns >= self.end_ns
    }

    /// Until the next tick, a little late, or much later if the process is stopped.
    pub(super) fn wait(&mut self) {
        let late_ns = self.random.random_range(0..3 * MS);
        self.pass(PERIOD_NS - 2 * MS + late_ns);
        let (begin_ns, length_ns) = self.stop;
        // Nobody knows what was driven before the first pair.
        let has_begun = self.received >= 2;
        if self.now_ns >= begin_ns && length_ns > 0 && has_begun && !self.is_over() {
            self.stop.1 = 0;
            self.asleep = self.sleeps && !self.is_set_around(self.now_ns, length_ns);
            self.pass(length_ns);
            self.wake();
        }
    }

    /// Nobody sets the clock of a computer that sleeps. Nor is it played that somebody did so in the very tick before: then a
    /// frame in between has the stamp of a clock that no reading shows, and counts as of the time of the read; what the robot
    /// came in its sleep is given up then, and counted.
    fn is_set_around(&self, begin_ns: i64, length_ns: i64) -> bool {
        let near = begin_ns - 3 * PERIOD_NS..begin_ns + length_ns + 3 * PERIOD_NS;
        self.steps.iter().any(|step| near.contains(&step.0))
    }

    /// The clock on the board knows the time to a second or so.
    fn wake(&mut self) {
        if std::mem::take(&mut self.asleep) {
            let by_ns = self.random.random_range(-SECOND..SECOND);
            self.steps.push((self.now_ns, by_ns));
        }
    }

    fn pass(&mut self, ns: i64) {
        self.now_ns += ns;
        while self.next_ns <= self.now_ns {
            self.send();
        }
        while let Some(&(came_ns, frame)) = self.under_way.front()
            && came_ns <= self.now_ns
        {
            self.under_way.pop_front();
            self.deliver(came_ns, frame);
        }
    }

    fn deliver(&mut self, came_ns: i64, frame: Frame) {
        if self.asleep || self.queue.len() >= self.capacity {
            self.tally.dropped += 1;
            return;
        }
        self.came_ns.push_back(came_ns);
        self.queue.push_back(Received {
            frame,
            stamp_ns: self.wall_ns(came_ns),
            bus: 0,
        });
    }

    fn send(&mut self) {
        let (sent_ns, over) = (self.next_ns, self.is_over());
        self.pairs += 1;
        if over {
            self.encoders.stand();
        } else if self.pairs > STANDING {
            self.encoders.drive(&mut self.random);
        }
        let pair = self.encoders.turn((sent_ns - self.last_ns) as f64 * 1e-9);
        let apart_ns = self.random.random_range(50_000..3 * MS);
        let well = over || self.pairs <= STANDING;
        for (frame, after_ns) in pair.into_iter().zip([0, apart_ns]) {
            self.tally.frames += 1;
            if well || !self.random.random_bool(self.loss) {
                self.under_way
                    .push_back((self.released(sent_ns + after_ns), frame));
            }
        }
        self.last_ns = sent_ns;
        self.next_ns = sent_ns + PERIOD_NS + self.random.random_range(-MS..MS);
    }

    /// When a frame leaves the gateway.
    fn released(&self, sent_ns: i64) -> i64 {
        let (begin_ns, length_ns) = self.hold;
        let held = (begin_ns..begin_ns + length_ns).contains(&sent_ns);
        if held { begin_ns + length_ns } else { sent_ns }
    }

    /// What the clock of the day says at a true time.
    pub(super) fn wall_ns(&self, at_ns: i64) -> i64 {
        let set = self.steps.iter().filter(|step| step.0 <= at_ns);
        1_700_000_000 * SECOND + at_ns + set.map(|step| step.1).sum::<i64>()
    }

    /// The next frame that has come.
    pub(super) fn receive(&mut self) -> Option<Received> {
        let received = self.queue.pop_front();
        self.received += u64::from(received.is_some());
        received
    }

    /// How many frames have been read.
    pub(super) fn received(&self) -> u64 {
        self.received
    }

    /// How far a stamp is from the nearest moment at which a frame came \[ns\]; moments long before are forgotten.
    pub(super) fn off_ns(&mut self, stamp_ns: i64) -> i64 {
        let mut off_ns = i64::MAX;
        while let Some(&came_ns) = self.came_ns.front() {
            let distance_ns = (stamp_ns - came_ns).abs();
            if came_ns > stamp_ns || distance_ns > off_ns {
                return off_ns.min(distance_ns);
            }
            off_ns = distance_ns;
            if self.came_ns.len() < 2 || self.came_ns[1] > stamp_ns {
                let next = self
                    .came_ns
                    .get(1)
                    .map_or(i64::MAX, |next| (next - stamp_ns).abs());
                return off_ns.min(next);
            }
            self.came_ns.pop_front();
        }
        off_ns
    }

    /// By how much a frame that came about then may be misplaced, because the clock was set meanwhile \[ns\].
    pub(super) fn doubt_ns(&self, stamp_ns: i64) -> i64 {
        let near = |&&(at_ns, by_ns): &&(i64, i64)| {
            (at_ns - stamp_ns).abs() <= 3 * PERIOD_NS + self.stopped_ns + by_ns.abs()
        };
        let by_ns = self.steps.iter().filter(near).map(|step| step.1.abs());
        by_ns.sum::<i64>().min(3 * PERIOD_NS + self.stopped_ns)
    }

    /// The clocks, read a little later than the buses.
    pub(super) fn read(&mut self) -> Reading {
        let late_ns = if self.random.random_bool(0.01) {
            5 * MS
        } else {
            20_000
        };
        let after_ns = self.random.random_range(0..late_ns);
        self.pass(after_ns);
        let boot_ns = self.now_ns;
        let width_ns = self.random.random_range(0..WIDEST_NS);
        let after_ns = self.random.random_range(0..=width_ns);
        let realtime_ns = self.wall_ns(boot_ns + after_ns);
        Reading {
            boot_ns,
            realtime_ns,
            tai_ns: realtime_ns,
            width_ns,
        }
    }
}
