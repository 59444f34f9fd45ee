//! What a program is told on channels: whether it can be used, when it was, and what came of it all.

use coloc_shm_types::{Header, Limits, Present, Reject, Sessions, boot};

use crate::moment::Moment;
use crate::run::Report;

/// How far back messages are understood \[ns\], and by how much clocks of the team may differ.
const HISTORY_NS: i64 = 5_000_000_000;
const TOLERANCE_NS: i64 = 100_000_000;

/// A program's own reasons not to use a message.
pub trait Refuses: Copy {
    /// Of one that cannot be computed with.
    const INVALID: Self;
    /// Of one whose stamp cannot be compared with this computer's clocks.
    const CLOCK: Self;
    /// Of one that is too old, or from the future.
    const LATE: Self;
    /// Of one that was here before, or too many speak.
    const REPEATED: Self;

    /// Why a message is not valid.
    #[must_use]
    fn of(reason: Reject) -> Self {
        match reason {
            Reject::ForeignClock | Reject::UnknownClock => Self::CLOCK,
            Reject::TooOld | Reject::FromFuture => Self::LATE,
            _ => Self::INVALID,
        }
    }

    /// Its place in `refused` of the driver's status.
    fn place(self) -> usize;
}

/// The ears of a program, behind its channels, and its books.
#[derive(Debug)]
pub struct Hearing<R> {
    own: u16,
    own_boot: u64,
    robots: Vec<u16>,
    /// Of each kind of messages.
    heard: Vec<Sessions>,
    whole: u64,
    broken: u64,
    said: u64,
    said_ns: i64,
    refused: [u64; 16],
    /// What was refused for the first time.
    fresh: Vec<R>,
}

impl<R: Refuses> Hearing<R> {
    /// Of the robot `own` in a team of `robots`; of each kind of messages how many may speak.
    #[must_use]
    pub fn new(own: u16, robots: Vec<u16>, speakers: &[usize]) -> Self {
        Self {
            own,
            own_boot: boot(),
            robots,
            heard: speakers.iter().map(|it| Sessions::new(*it)).collect(),
            whole: 0,
            broken: 0,
            said: 0,
            said_ns: 0,
            refused: [0; 16],
            fresh: Vec::new(),
        }
    }

    /// Whether a message is valid now. It is counted.
    pub fn check(
        &mut self,
        now: Moment,
        validate: impl FnOnce(&Limits<'_>) -> Result<(), Reject>,
    ) -> Option<()> {
        let limits = Limits {
            now: Present {
                boottime_ns: Some(now.boottime_ns),
                realtime_ns: Some(now.realtime_ns),
                tai_ns: None,
            },
            boot: self.own_boot,
            history_ns: HISTORY_NS,
            future_tolerance_ns: TOLERANCE_NS,
            own: self.own,
            robots: &self.robots,
        };
        match validate(&limits) {
            Ok(()) => {
                self.whole += 1;
                Some(())
            }
            Err(reason) => {
                self.broken += 1;
                self.refuse(R::of(reason));
                None
            }
        }
    }

    /// The moment by `CLOCK_BOOTTIME` \[ns\] of a valid message of a kind, if it was not here before.
    pub fn accept(&mut self, kind: usize, header: &Header, now: Moment) -> Option<i64> {
        let sessions = self.heard.get_mut(kind)?;
        if sessions.accept(header, now.boottime_ns).is_err() {
            self.refuse(R::REPEATED);
            return None;
        }
        let at_ns = now.boottime_of(header, self.own_boot);
        if at_ns.is_none() {
            self.refuse(R::CLOCK);
        }
        at_ns
    }

    /// Something is not used.
    pub fn refuse(&mut self, refusal: R) {
        let count = &mut self.refused[refusal.place()];
        *count += 1;
        if *count == 1 {
            self.fresh.push(refusal);
        }
    }

    /// Something of the moment `at_ns` was said.
    pub fn note_said(&mut self, at_ns: i64) {
        self.said += 1;
        self.said_ns = at_ns;
    }

    /// What was refused for the first time, since that was last asked.
    pub fn fresh(&mut self) -> Vec<R> {
        std::mem::take(&mut self.fresh)
    }

    /// For the driver's status.
    #[must_use]
    pub fn report(&self, figures: [f64; 8]) -> Report {
        Report {
            whole: self.whole,
            broken: self.broken,
            said: self.said,
            nothing_to_say: 0,
            said_ns: self.said_ns,
            refused: self.refused,
            figures,
        }
    }
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::Clock;

    use super::*;

    #[derive(Copy, Clone, Debug, PartialEq)]
    enum Why {
        Invalid,
        Clock,
        Late,
        Repeated,
    }

    impl Refuses for Why {
        const INVALID: Self = Self::Invalid;
        const CLOCK: Self = Self::Clock;
        const LATE: Self = Self::Late;
        const REPEATED: Self = Self::Repeated;

        fn place(self) -> usize {
            self as usize
        }
    }

    #[test]
    fn each_message_counts_once_and_a_reason_is_told_the_first_time() {
        let mut hearing = Hearing::<Why>::new(1, vec![1, 2], &[4]);
        let now = Moment {
            boottime_ns: 7,
            realtime_ns: 1_000,
        };
        let header = |sequence| Header {
            stamp_ns: 998,
            session: 3,
            sequence,
            clock: Clock::Realtime as u8,
            ..Header::default()
        };
        for reason in [Reject::NotFinite, Reject::TooOld, Reject::Asymmetric] {
            assert_eq!(hearing.check(now, |_| Err(reason)), None);
        }
        hearing.check(now, |_| Ok(())).expect("it is valid");
        assert_eq!(hearing.accept(0, &header(0), now), Some(5));
        assert_eq!(hearing.accept(0, &header(0), now), None);
        let tai = Header {
            clock: Clock::Tai as u8,
            ..header(1)
        };
        assert_eq!(hearing.accept(0, &tai, now), None);
        assert_eq!(
            hearing.fresh(),
            [Why::Invalid, Why::Late, Why::Repeated, Why::Clock]
        );
        hearing.refuse(Why::Invalid);
        assert!(hearing.fresh().is_empty());
        hearing.note_said(5);
        let report = hearing.report([0.5; 8]);
        assert_eq!((report.whole, report.broken), (1, 3));
        assert_eq!((report.said, report.said_ns), (1, 5));
        assert_eq!(report.refused[..4], [3, 1, 1, 1]);
    }
}
