//! What starts a tick where the configuration leaves it open (`trigger = "auto"`): decided by when odometry has come, and by
//! nothing else.
//!
//! * **Frames start the ticks** where the wheels alone are heard, and eight of their samples in a row have come at the tick's rate:
//!   each within a quarter of a period of when it was due, all of them to 2 %. They do no longer once eight in a row have not, a
//!   third of them for long, the rate is off by 4 %, or somebody else speaks.
//! * **Deadlines lock to what comes** otherwise: to the moment at which samples wait least for their tick, judged by the last
//!   sixteen. Half the rate, twice the rate, wheels and a base: each has such a moment. Where there is none, as with 33 samples a
//!   second and 50 ticks, and where nothing comes, they run free.
//!
//! | | between two ticks |
//! | --- | --- |
//! | frames start them | as frames come, but half a period at least (a frame that is earlier waits for that), and 1.5 at most |
//! | deadlines | a period; while they move, it is up to 1/64 shorter or longer |

/// So many arrivals are looked at.
const MOST: usize = 16;
/// So many are needed to lock, and between two looks.
const LOOK: u64 = 8;
/// So many samples of the wheels later somebody else who spoke is forgotten.
const FORGOTTEN: u32 = 16;
/// Samples in a row at the tick's rate before frames start ticks.
const RUN: u32 = 8;
/// One that was not when it was due counts so much against frames, one that was so much for them; beyond the limit they are not
/// followed.
const MISS: u32 = 2;
const LIMIT: u32 = 16;
/// How far the rate of frames may be off, to be followed at first and to be followed on, as a part of it.
const NEAR: i64 = 50;
const STILL_NEAR: i64 = 25;
/// A deadline comes so much after what it is for, and moves by so much at most, as a part of a period.
const LAG: i64 = 64;
/// It stays where it is within so much.
const REST: i64 = 128;

/// A sample of odometry, when it was complete.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Arrival {
    /// \[ns of the inner clock\].
    pub at_ns: i64,
    /// Over a CAN bus: by the kernel's stamp, and it can wake the tick. Of a message the stamp is that of the measurement.
    pub by_bus: bool,
}

/// The last arrivals.
#[derive(Copy, Clone, Debug, Default)]
pub struct Arrivals {
    last: [Arrival; MOST],
    count: u64,
}

impl Arrivals {
    /// Another one.
    pub fn push(&mut self, arrival: Arrival) {
        if let Some(place) = self.last.get_mut(place(self.count)) {
            *place = arrival;
        }
        self.count += 1;
    }

    /// Those after the first `count` of all, as far as they are still known; the oldest first.
    fn after(&self, count: u64) -> impl Iterator<Item = Arrival> {
        let first = count.max(self.count.saturating_sub(MOST as u64));
        (first..self.count).filter_map(|number| self.last.get(place(number)).copied())
    }
}

fn place(number: u64) -> usize {
    usize::try_from(number % MOST as u64).unwrap_or(0)
}

/// What starts the ticks of one robot.
#[derive(Clone, Debug)]
pub struct Pace {
    period_ns: i64,
    /// So many arrivals have been judged.
    judged: u64,
    rhythm: Rhythm,
    /// Arrivals that the wheels' buses did not bring, among the last ones.
    strangers: u32,
    follows_frames: bool,
    /// A moment at which a tick is wanted, and so are all a whole number of periods from it.
    wanted_ns: Option<i64>,
    /// How long messages are under way beyond what deadlines allow for \[ns\].
    under_way_ns: i64,
    missed: bool,
    /// The last tick's stamp.
    tick_ns: i64,
}

impl Pace {
    /// Nothing has come yet.
    #[must_use]
    pub fn new(period_ns: i64) -> Self {
        Self {
            period_ns,
            judged: 0,
            rhythm: Rhythm::default(),
            strangers: 0,
            follows_frames: false,
            wanted_ns: None,
            under_way_ns: 0,
            missed: false,
            tick_ns: i64::MIN,
        }
    }

    /// Whether frames start the ticks; else deadlines do.
    #[must_use]
    pub fn follows_frames(&self) -> bool {
        self.follows_frames
    }

    /// By how much the deadline after this one is to be later than a period \[ns\].
    #[must_use]
    pub fn shift_ns(&self, deadline_ns: i64) -> i64 {
        let Some(wanted_ns) = self.wanted_ns else {
            return 0;
        };
        let ahead = (wanted_ns - deadline_ns).rem_euclid(self.period_ns);
        let off = if 2 * ahead > self.period_ns {
            ahead - self.period_ns
        } else {
            ahead
        };
        if off.abs() <= self.period_ns / REST {
            return 0;
        }
        let most = self.period_ns / LAG;
        off.clamp(-most, most)
    }

    /// A tick at `tick_ns` has taken in all that had come: judges what is new among `arrivals`.
    pub fn ticked(&mut self, tick_ns: i64, arrivals: &Arrivals) {
        for arrival in arrivals.after(self.judged) {
            self.judge(arrival);
        }
        let looks = |count: u64| count / LOOK;
        if looks(arrivals.count) > looks(self.judged) {
            self.look(arrivals);
        }
        self.judged = arrivals.count;
        self.tick_ns = tick_ns;
    }

    fn judge(&mut self, arrival: Arrival) {
        if arrival.by_bus {
            self.strangers = self.strangers.saturating_sub(1);
            self.rhythm.beat(arrival.at_ns, self.period_ns);
        } else {
            self.strangers = FORGOTTEN;
            // The tick before should have had it.
            self.missed |= arrival.at_ns.saturating_add(self.under_way_ns) < self.tick_ns;
        }
        self.follows_frames = self.strangers == 0
            && if self.follows_frames {
                self.rhythm.goes_on(self.period_ns)
            } else {
                self.rhythm.is_steady(self.period_ns)
            };
    }

    fn look(&mut self, arrivals: &Arrivals) {
        let lag_ns = self.period_ns / LAG;
        self.under_way_ns = if std::mem::take(&mut self.missed) {
            (self.under_way_ns + lag_ns) % self.period_ns
        } else {
            (self.under_way_ns - lag_ns / 64).max(0)
        };
        let mut phases = [0; MOST];
        let mut count = 0;
        for (phase, arrival) in phases.iter_mut().zip(arrivals.after(0)) {
            let under_way_ns = if arrival.by_bus { 0 } else { self.under_way_ns };
            *phase = (arrival.at_ns + under_way_ns).rem_euclid(self.period_ns);
            count += 1;
        }
        let phases = phases.get(..count).unwrap_or_default();
        let now = self.wanted_ns.map(|wanted| wanted - lag_ns);
        let best = best(phases, now, self.period_ns);
        self.wanted_ns = best.map(|phase| phase + lag_ns);
    }
}

/// The phase after which those of `phases` wait least for their tick; about that of `now` rather than another that is hardly
/// better. `None` where it makes little difference.
fn best(phases: &[i64], now: Option<i64>, period_ns: i64) -> Option<i64> {
    let count = i64::try_from(phases.len()).unwrap_or(0);
    let wait_of = |phase: i64| phases.iter().map(move |of| after(*of, phase, period_ns));
    let wait = |phase: i64| wait_of(phase).sum::<i64>();
    let best = phases.iter().copied().min_by_key(|phase| wait(*phase))?;
    let near = |phase: &i64| {
        now.is_some_and(|now| {
            let apart = after(now.rem_euclid(period_ns), *phase, period_ns);
            apart.min(period_ns - apart) <= period_ns / 8
        })
    };
    let stays = phases.iter().copied().filter(near);
    let stays = stays.min_by_key(|phase| wait(*phase));
    let stays = stays.filter(|phase| wait(*phase) <= wait(best) + count * period_ns / 8);
    let chosen = stays.unwrap_or(best);
    // Free, they wait half a period.
    (10 * wait(chosen) < 4 * count * period_ns).then_some(chosen)
}

/// From phase `from` to the next `to`, both within a period.
fn after(from: i64, to: i64, period_ns: i64) -> i64 {
    if to >= from {
        to - from
    } else {
        to - from + period_ns
    }
}

/// How regularly frames come.
#[derive(Clone, Debug, Default)]
struct Rhythm {
    /// When the last ones came, the newest first.
    last_ns: [i64; RUN as usize + 1],
    /// So many in a row came when they were due.
    run: u32,
    /// How much speaks against it.
    against: u32,
}

impl Rhythm {
    fn beat(&mut self, at_ns: i64, period_ns: i64) {
        let [newest_ns, ..] = self.last_ns;
        self.last_ns.rotate_right(1);
        self.last_ns[0] = at_ns;
        let late_ns = at_ns.saturating_sub(newest_ns).saturating_sub(period_ns);
        if late_ns.unsigned_abs() <= (period_ns / 4).unsigned_abs() {
            self.run = (self.run + 1).min(RUN);
            self.against = self.against.saturating_sub(1);
        } else {
            self.run = 0;
            self.against = (self.against + MISS).min(LIMIT + MISS);
        }
    }

    fn is_steady(&self, period_ns: i64) -> bool {
        self.run == RUN && self.is_near(period_ns, NEAR)
    }

    fn goes_on(&self, period_ns: i64) -> bool {
        self.against < LIMIT && (self.run < RUN || self.is_near(period_ns, STILL_NEAR))
    }

    /// Whether the rate of the last ones is off by less than one in `parts`.
    fn is_near(&self, period_ns: i64, parts: i64) -> bool {
        let [newest_ns, .., oldest_ns] = self.last_ns;
        let nominal_ns = i64::from(RUN) * period_ns;
        let off_ns = newest_ns.saturating_sub(oldest_ns) - nominal_ns;
        off_ns.abs() <= nominal_ns / parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;
    const PERIOD: i64 = 20 * MS;
    /// From the arrival of a frame to the stamp of the tick that it starts.
    const WAKE: i64 = MS / 20;

    /// Samples that come regularly, but for `jitter_ns` at most.
    #[derive(Clone, Copy)]
    struct Source {
        first_ns: i64,
        every_ns: i64,
        jitter_ns: i64,
        by_bus: bool,
        /// How long a message is under way \[ns\].
        under_way_ns: i64,
    }

    impl Source {
        fn wheels(first_ns: i64, every_ns: i64) -> Self {
            Self {
                first_ns,
                every_ns,
                jitter_ns: 0,
                by_bus: true,
                under_way_ns: 0,
            }
        }

        fn base(first_ns: i64, every_ns: i64, under_way_ns: i64) -> Self {
            Self {
                by_bus: false,
                under_way_ns,
                ..Self::wheels(first_ns, every_ns)
            }
        }

        /// Until `end_ns`: when each is there, and what is known of it.
        fn until(self, end_ns: i64) -> Vec<(i64, Arrival)> {
            let count = (end_ns - self.first_ns) / self.every_ns;
            let one = |number: i64| {
                let at_ns = self.first_ns + number * self.every_ns;
                let at_ns = at_ns + scattered(number) % (self.jitter_ns + 1);
                let by_bus = self.by_bus;
                (at_ns + self.under_way_ns, Arrival { at_ns, by_bus })
            };
            (0..count.max(0)).map(one).collect()
        }
    }

    /// Something for each number, as if by chance (`SplitMix64`).
    fn scattered(number: i64) -> i64 {
        let z = number.cast_unsigned().wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z >> 33).cast_signed()
    }

    fn come(sources: &[Source], end_ns: i64) -> Vec<(i64, Arrival)> {
        let all = sources.iter().flat_map(|source| source.until(end_ns));
        let mut all: Vec<_> = all.collect();
        all.sort_by_key(|(there_ns, _)| *there_ns);
        all
    }

    /// What was seen of a robot.
    #[derive(Default)]
    struct Lived {
        ticks_ns: Vec<i64>,
        /// When each sample was there, and the tick that had it.
        waits: Vec<(i64, i64)>,
        /// Those ticks that frames started.
        by_frames: Vec<i64>,
        moved: usize,
    }

    impl Lived {
        /// The longest wait of samples that came after `from_ns`, but for one in a hundred.
        fn wait_ns(&self, from_ns: i64) -> i64 {
            let after = self
                .waits
                .iter()
                .filter(|(there_ns, _)| *there_ns >= from_ns);
            let mut waits: Vec<_> = after.map(|(there, tick)| tick - there).collect();
            waits.sort_unstable();
            waits[waits.len() * 99 / 100]
        }

        fn mean_ns(&self, from_ns: i64) -> i64 {
            let after = self
                .waits
                .iter()
                .filter(|(there_ns, _)| *there_ns >= from_ns);
            let waits: Vec<_> = after.map(|(there, tick)| tick - there).collect();
            waits.iter().sum::<i64>() / i64::try_from(waits.len()).unwrap()
        }

        fn between_ns(&self) -> impl Iterator<Item = i64> {
            self.ticks_ns.windows(2).map(|two| two[1] - two[0])
        }

        /// The shortest and the longest.
        fn extremes_ns(&self) -> [i64; 2] {
            [self.between_ns().min(), self.between_ns().max()].map(Option::unwrap)
        }
    }

    /// A robot as `Wait` has it: the same rules, without a kernel.
    fn live(all: &[(i64, Arrival)], end_ns: i64) -> Lived {
        let (mut pace, mut arrivals, mut lived) =
            (Pace::new(PERIOD), Arrivals::default(), Lived::default());
        let (mut deadline_ns, mut not_before_ns, mut next) = (PERIOD, 0, 0);
        loop {
            let frame = all.get(next..).unwrap_or_default();
            let frame = frame.iter().find(|(_, arrival)| arrival.by_bus);
            let frame_ns = frame
                .filter(|_| pace.follows_frames())
                .map(|(there_ns, _)| i64::max(there_ns + WAKE, not_before_ns));
            let is_frame = frame_ns.is_some_and(|frame_ns| frame_ns < deadline_ns);
            let tick_ns = frame_ns.unwrap_or(i64::MAX).min(deadline_ns);
            if tick_ns > end_ns {
                return lived;
            }
            while let Some((there_ns, arrival)) = all.get(next).filter(|it| it.0 <= tick_ns) {
                arrivals.push(*arrival);
                lived.waits.push((*there_ns, tick_ns));
                next += 1;
            }
            let before = pace.follows_frames();
            pace.ticked(tick_ns, &arrivals);
            lived.ticks_ns.push(tick_ns);
            lived.by_frames.extend(is_frame.then_some(tick_ns));
            not_before_ns = tick_ns + PERIOD / 2;
            deadline_ns = match (pace.follows_frames(), before) {
                (true, true) if !is_frame => deadline_ns + PERIOD,
                (true, _) => tick_ns + PERIOD + PERIOD / 2,
                (false, true) => tick_ns + PERIOD,
                (false, false) => {
                    let shift_ns = pace.shift_ns(deadline_ns + PERIOD);
                    lived.moved += usize::from(shift_ns != 0);
                    deadline_ns + PERIOD + shift_ns
                }
            };
        }
    }

    const SECOND: i64 = 1000 * MS;

    #[test]
    fn frames_at_the_ticks_rate_start_the_ticks_at_any_phase_and_with_any_clock() {
        for phase in 0..20 {
            for ppm in [-100, 0, 100] {
                let every_ns = PERIOD + PERIOD * ppm / 1_000_000;
                let wheels = Source::wheels(SECOND + phase * MS + 1, every_ns);
                let lived = live(&come(&[wheels], 60 * SECOND), 60 * SECOND);
                assert_eq!(lived.wait_ns(2 * SECOND), WAKE, "{phase} {ppm}");
                let by_frames = lived.by_frames.len();
                assert!(by_frames > 59 * 50 - 12, "{by_frames}: {phase} {ppm}");
                let [shortest, longest] = lived.extremes_ns();
                assert!(shortest >= PERIOD / 2 && longest <= 3 * PERIOD / 2 + WAKE);
            }
        }
    }

    #[test]
    fn frames_that_jitter_are_followed_as_long_as_they_are_regular() {
        let jitter = |jitter_ns| {
            let wheels = Source {
                jitter_ns,
                ..Source::wheels(5 * MS, PERIOD)
            };
            live(&come(&[wheels], 60 * SECOND), 60 * SECOND)
                .by_frames
                .len()
        };
        assert!(jitter(2 * MS) > 2980);
        assert!(jitter(PERIOD) < 60, "by chance");
    }

    /// Twice the rate does not make twice the ticks; the deadlines move behind the frames.
    #[test]
    fn frames_at_other_rates_move_the_deadlines_behind_them() {
        let most = PERIOD / LAG + PERIOD / REST;
        for (hz, worst) in [
            (100, PERIOD / 2 + most),
            (10, most),
            (25, most),
            (200, 3 * PERIOD / 4 + most),
        ] {
            for phase in [1, 6, 13, 19] {
                let wheels = Source::wheels(phase * MS, SECOND / hz);
                let lived = live(&come(&[wheels], 60 * SECOND), 60 * SECOND);
                let wait_ns = lived.wait_ns(10 * SECOND);
                assert!(wait_ns <= worst, "{hz} Hz, {phase} ms: {wait_ns}");
                assert!(lived.by_frames.is_empty());
                let [shortest, longest] = lived.extremes_ns();
                let most = PERIOD / LAG;
                assert!(shortest >= PERIOD - most && longest <= PERIOD + most);
            }
        }
    }

    #[test]
    fn deadlines_follow_a_clock_that_is_off_and_rest_mostly() {
        let wheels = Source::wheels(7 * MS, SECOND / 10 + 10_000);
        let lived = live(&come(&[wheels], 600 * SECOND), 600 * SECOND);
        assert!(lived.wait_ns(10 * SECOND) <= PERIOD / LAG + 2 * PERIOD / REST);
        assert!(lived.moved < 1000, "{} of 30000", lived.moved);
    }

    #[test]
    fn where_no_moment_is_better_than_another_deadlines_run_free() {
        let wheels = Source::wheels(7 * MS, 29_999_999);
        let lived = live(&come(&[wheels], 60 * SECOND), 60 * SECOND);
        let mean_ns = lived.mean_ns(10 * SECOND);
        assert!(mean_ns < 6 * PERIOD / 10, "{mean_ns}");
        let [shortest, longest] = lived.extremes_ns();
        assert!(shortest >= PERIOD - PERIOD / LAG && longest <= PERIOD + PERIOD / LAG);
        assert_eq!(live(&[], 10 * SECOND).extremes_ns(), [PERIOD; 2]);
    }

    /// Messages carry no stamp of when they came: how long they are under way is learned.
    #[test]
    fn a_base_that_speaks_has_the_deadlines_behind_its_messages() {
        for under_way_ns in [0, MS / 10, 2 * MS, 7 * MS] {
            let base = Source {
                jitter_ns: MS / 20,
                ..Source::base(3 * MS, PERIOD, under_way_ns)
            };
            let lived = live(&come(&[base], 120 * SECOND), 120 * SECOND);
            let mean_ns = lived.mean_ns(60 * SECOND);
            assert!(mean_ns < MS, "{under_way_ns}: {mean_ns}");
            assert!(lived.by_frames.is_empty());
        }
    }

    #[test]
    fn of_two_bases_the_deadlines_come_right_after_one() {
        let pair = |first: Source, apart_ns: i64| {
            let other = Source::base(first.first_ns + apart_ns, PERIOD, 0);
            let lived = live(&come(&[first, other], 60 * SECOND), 60 * SECOND);
            assert!(lived.wait_ns(10 * SECOND) < PERIOD);
            (lived.mean_ns(10 * SECOND), lived.by_frames.len())
        };
        // 3 ms apart: after the second, and the first waits 3 ms.
        let (mean_ns, _) = pair(Source::base(MS, PERIOD, 0), 3 * MS);
        assert!(mean_ns < 2 * MS, "{mean_ns}");
        let (mean_ns, _) = pair(Source::base(MS, PERIOD, 0), 17 * MS);
        assert!(mean_ns < 2 * MS, "{mean_ns}");
        // Frames start no ticks where a base speaks as well.
        let (mean_ns, by_frames) = pair(Source::wheels(MS, PERIOD), 5 * MS);
        assert!(
            mean_ns < 3 * MS + MS / 2 && by_frames < 12,
            "{mean_ns} {by_frames}"
        );
    }

    /// Of two thousand frames, without those that `is_lost` says.
    fn with_gaps(is_lost: impl Fn(i64) -> bool) -> Lived {
        let mut all = come(&[Source::wheels(5 * MS, PERIOD)], 40 * SECOND);
        let mut number = 0;
        all.retain(|_| {
            number += 1;
            !is_lost(number)
        });
        live(&all, 40 * SECOND)
    }

    #[test]
    fn a_frame_that_is_lost_now_and_then_changes_nothing() {
        let lived = with_gaps(|number| number % 10 == 0);
        let [shortest, longest] = lived.extremes_ns();
        assert!(shortest >= PERIOD / 2 && longest <= 3 * PERIOD / 2 + WAKE);
        assert_eq!(lived.wait_ns(SECOND), WAKE);
    }

    #[test]
    fn frames_that_stop_leave_the_ticks_their_rate_and_start_them_again_when_they_come_back() {
        let lived = with_gaps(|number| (500..1000).contains(&number));
        let at = |from: i64, to: i64| {
            let within = lived.ticks_ns.iter().filter(|it| (from..to).contains(*it));
            within.count()
        };
        assert!((498..=502).contains(&at(10 * SECOND, 20 * SECOND)));
        let again = lived.by_frames.iter().find(|it| **it > 20 * SECOND);
        assert!(again.is_some_and(|at_ns| *at_ns < 20 * SECOND + 2 * PERIOD));
        let [shortest, longest] = lived.extremes_ns();
        assert!(shortest >= PERIOD / 2 && longest <= 3 * PERIOD / 2 + WAKE);
    }

    /// A bus that stalls for a tenth of a second now and then, and then brings what it held all at once.
    #[test]
    fn bursts_are_no_reason_to_hurry() {
        let mut all = come(&[Source::wheels(5 * MS, PERIOD)], 40 * SECOND);
        for (there_ns, arrival) in &mut all {
            let within = *there_ns % SECOND;
            if (500 * MS..600 * MS).contains(&within) {
                arrival.at_ns += 600 * MS - within + within / 100;
                *there_ns = arrival.at_ns;
            }
        }
        let lived = live(&all, 40 * SECOND);
        let [shortest, longest] = lived.extremes_ns();
        assert!(shortest >= PERIOD / 2 && longest <= 3 * PERIOD / 2 + WAKE);
        let ticks = i64::try_from(lived.ticks_ns.len()).unwrap();
        assert!((1960..=2060).contains(&ticks), "{ticks}");
        assert!(lived.by_frames.len() > 500, "{}", lived.by_frames.len());
    }

    #[test]
    fn wheels_that_change_their_rate_are_left_soon() {
        let mut all = come(&[Source::wheels(5 * MS, PERIOD)], 10 * SECOND);
        all.extend(come(
            &[Source::wheels(10 * SECOND, PERIOD / 2)],
            20 * SECOND,
        ));
        let lived = live(&all, 20 * SECOND);
        let last = lived.by_frames.last().copied().unwrap();
        assert!(last < 10 * SECOND + 8 * PERIOD, "{last}");
        let after = lived
            .ticks_ns
            .iter()
            .filter(|it| **it >= 10 * SECOND)
            .count();
        assert!((498..=508).contains(&after), "{after}");
    }
}
