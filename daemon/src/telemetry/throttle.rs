//! Rejected inputs in the log: the first of a kind at once, then a sum every few seconds. A flood stays a few lines.

use std::time::{Duration, Instant};

use coloc_shm_types::{Input, Reject};
use tracing::warn;

const PERIOD: Duration = Duration::from_secs(5);

/// What has been rejected and not been logged, by input and reason.
#[derive(Debug, Default)]
pub(super) struct Throttle {
    kinds: [[Kind; Reject::COUNT]; Input::COUNT],
}

#[derive(Copy, Clone, Debug, Default)]
struct Kind {
    logged: Option<Instant>,
    unsaid: u64,
}

impl Throttle {
    /// One more.
    pub(super) fn note(&mut self, input: Input, reason: Reject) {
        self.kinds[input as usize][reason as usize].unsaid += 1;
    }

    /// Says what is due.
    pub(super) fn tick(&mut self) {
        self.say(|kind| kind.logged.is_none_or(|logged| logged.elapsed() >= PERIOD));
    }

    /// Says everything that was not said yet.
    pub(super) fn flush(&mut self) {
        self.say(|_| true);
    }

    fn say(&mut self, due: impl Fn(&Kind) -> bool) {
        for input in Input::ALL {
            for reason in Reject::ALL {
                let kind = &mut self.kinds[input as usize][reason as usize];
                if kind.unsaid > 0 && due(kind) {
                    warn!(count = kind.unsaid, "{input} rejected: {reason}");
                    *kind = Kind {
                        logged: Some(Instant::now()),
                        unsaid: 0,
                    };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_is_said_at_once_and_the_others_later_as_a_sum() {
        let mut throttle = Throttle::default();
        throttle.note(Input::Position, Reject::Gated);
        throttle.tick();
        let kind =
            |throttle: &Throttle| throttle.kinds[Input::Position as usize][Reject::Gated as usize];
        assert_eq!(kind(&throttle).unsaid, 0);
        (0..100).for_each(|_| throttle.note(Input::Position, Reject::Gated));
        throttle.tick();
        assert_eq!(kind(&throttle).unsaid, 100);
        throttle.flush();
        assert_eq!(kind(&throttle).unsaid, 0);
    }
}
