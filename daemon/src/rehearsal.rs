//! What is done while only a part of the wheels' frames has come: all that the tick will do, for nothing but the caches.
//!
//! The rest of a sample is on the wire, a quarter of a millisecond on most buses, and a tick that begins on cold caches takes three
//! times as long. Nothing that is rehearsed changes what the robot believes or says: an understudy steps in the estimator's place.
//!
//! It must not make a frame wait. So it is cut into acts. Each is played only if it will be over before a frame is likely to come,
//! by the shortest of the last gaps between the frames but one, and by what the act took lately: frames back to back leave no time
//! for any. That takes a look at the clock after each act, and no system call. Should a frame be earlier for once, it waits for one act,
//! which is about what the rehearsal saves.

use coloc_estimator::{Estimator, Measurement, Span, Stamp, Start, TickInputs, step};

use crate::collect::list::List;
use crate::config::Config;
use crate::estimate::{Places, places, settings};

/// Gaps that are remembered.
const GAPS: usize = 8;
/// What an act took counts so much against what it took before, if it was faster; slower, a half. Where it was not played it is believed to
/// take a little less, as what disturbed it once must not keep it away for good.
const FASTER: i64 = 8;
const UNPLAYED: i64 = 64;

/// How long the rest of a sample lets itself be waited for \[ns\].
#[derive(Clone, Debug, Default)]
pub(crate) struct Gaps {
    last_ns: [i64; GAPS],
    seen: usize,
    /// Since when is waited, and when the last frame before that had come.
    open: Option<[i64; 2]>,
}

impl Gaps {
    /// At `now_ns` only a part had come, its last frame at `frame_ns`.
    pub(crate) fn begin(&mut self, now_ns: i64, frame_ns: i64) {
        self.open = Some([now_ns, frame_ns]);
    }

    /// Frames were read, the last of them came at `frame_ns`.
    pub(crate) fn end(&mut self, frame_ns: i64) {
        let Some([since_ns, before_ns]) = self.open.take() else {
            return;
        };
        // A deadline ended the wait, and no frame.
        if frame_ns > before_ns {
            self.last_ns.rotate_right(1);
            self.last_ns[0] = frame_ns - since_ns;
            self.seen = (self.seen + 1).min(GAPS);
        }
    }

    /// For so long nothing is likely to come: the shortest gap but one, as one may have been an accident \[ns\].
    pub(crate) fn sure_ns(&self) -> i64 {
        if self.seen < GAPS {
            return 0;
        }
        let shorter =
            |[least, next]: [i64; 2], gap: &i64| [least.min(*gap), next.min(least.max(*gap))];
        let [_, next] = self.last_ns.iter().fold([i64::MAX; 2], shorter);
        next.max(0)
    }
}

/// What an act is believed to take \[ns\].
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Length(i64);

impl Length {
    pub(crate) fn ns(self) -> i64 {
        self.0
    }

    pub(crate) fn took(&mut self, ns: i64) {
        let more_ns = ns - self.0;
        self.0 += more_ns / if more_ns > 0 { 2 } else { FASTER };
    }

    pub(crate) fn left_out(&mut self) {
        self.0 -= self.0 / UNPLAYED;
    }
}

/// Plays the estimator's part: it hears what the robot hears, the wheels one tick later, and nobody asks what it believes.
#[derive(Debug)]
pub(crate) struct Understudy {
    estimator: Estimator<Places>,
    /// For its next step.
    script: List<Measurement>,
}

/// What it remembers of the past \[ticks\], in so many places at most.
const MEMORY: i64 = 8;
const SLOTS: usize = 64;
/// It takes in so much at once: a flood is not rehearsed.
const LINES: usize = 16;

impl Understudy {
    /// Of the size of an estimator: not on anybody's stack.
    #[inline(never)]
    pub(crate) fn new(config: &Config, stamp: Stamp, start: &Start) -> Box<Self> {
        let mut settings = settings(config);
        let memory = Span::from_nanos(MEMORY * config.period_ns());
        settings.history = settings.history.min(memory);
        let places = places(&settings, SLOTS);
        Box::new(Self {
            estimator: Estimator::starting(settings, stamp, start, places),
            script: List::with_capacity(LINES),
        })
    }

    /// A tick took in `measurements`: of them it will hear how the wheels moved.
    pub(crate) fn learn(&mut self, measurements: &[Measurement]) {
        let odometry = |it: &&Measurement| it.as_odometry().is_some();
        for sample in measurements.iter().filter(odometry) {
            if !self.script.push(*sample) {
                self.script.clear();
            }
        }
    }

    /// A tick at `stamp` that hears `messages`.
    pub(crate) fn play(&mut self, stamp: Stamp, messages: &[Measurement]) {
        for message in messages {
            if !self.script.push(*message) {
                break;
            }
        }
        let inputs = TickInputs {
            stamp,
            measurements: self.script.as_slice(),
        };
        std::hint::black_box(&step(&mut self.estimator, &inputs));
        self.script.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: i64 = 1000;

    /// After gaps of so many microseconds.
    fn gaps(us: &[i64]) -> Gaps {
        let mut gaps = Gaps::default();
        for (turn, us) in (1..).zip(us) {
            let now_ns = 20_000 * US * turn;
            gaps.begin(now_ns, now_ns - 50 * US);
            gaps.end(now_ns + us * US);
        }
        gaps
    }

    #[test]
    fn the_shortest_of_the_last_gaps_but_one_is_what_one_can_count_on() {
        assert_eq!(gaps(&[200; 7]).sure_ns(), 0, "not known yet");
        assert_eq!(gaps(&[200; 8]).sure_ns(), 200 * US);
        let mut us = [200; 20];
        us[11] = 40;
        assert_eq!(gaps(&us[..19]).sure_ns(), 200 * US, "once");
        us[13] = 50;
        assert_eq!(gaps(&us[..19]).sure_ns(), 50 * US);
        assert_eq!(gaps(&us).sure_ns(), 200 * US, "long ago");
    }

    /// Frames that were there before the wait began, as those back to back are.
    #[test]
    fn frames_back_to_back_leave_no_time() {
        assert_eq!(gaps(&[-20; 8]).sure_ns(), 0);
        let mut us = [200; 8];
        (us[3], us[5]) = (-1, -2);
        assert_eq!(gaps(&us).sure_ns(), 0);
    }

    #[test]
    fn a_wait_that_a_deadline_ended_says_nothing_of_frames() {
        let mut gaps = gaps(&[200; 8]);
        for turn in 10..30 {
            gaps.begin(turn, turn - 1);
            gaps.end(turn - 1);
        }
        assert_eq!(gaps.sure_ns(), 200 * US);
    }

    #[test]
    fn an_act_takes_what_it_took_lately() {
        let mut length = Length::default();
        (0..10).for_each(|_| length.took(1000));
        assert!((990..=1000).contains(&length.ns()), "{length:?}");
        length.took(5000);
        assert!(length.ns() > 2900, "{length:?}");
        (0..40).for_each(|_| length.took(1000));
        assert!((1000..1020).contains(&length.ns()), "{length:?}");
    }

    #[test]
    fn an_act_that_was_disturbed_once_is_played_again_some_day() {
        let mut length = Length::default();
        length.took(1_000_000);
        (0..200).for_each(|_| length.left_out());
        assert!(length.ns() < 25_000, "{length:?}");
    }
}
