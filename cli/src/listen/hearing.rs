//! Whether a robot is heard, and whether all of it.

use coloc_shm_types::Header;

/// An estimate is of use for as long.
const SILENCE_NS: i64 = 1_000_000_000;

/// What a person should know of how it came.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum News {
    /// For the first time, after a wait that was said.
    Speaks,
    /// After so long a silence \[ns\].
    Again { after_ns: i64, restarted: bool },
    /// It was started again, without a silence.
    Restarted,
}

/// What is known of one robot.
#[derive(Debug, Default)]
pub(super) struct Hearing {
    /// It was said that it is not heard.
    is_silent: bool,
    /// When it was last heard or, before that, when the wait began.
    last_ns: i64,
    /// Session, and the count that comes next.
    next: Option<(u64, u64)>,
    /// Estimates that never came, and were not told yet.
    lost: u64,
}

impl Hearing {
    /// From now on.
    pub(super) fn begin(now_ns: i64) -> Self {
        Self {
            last_ns: now_ns,
            ..Self::default()
        }
    }

    /// It was said that it is not heard.
    pub(super) fn is_missed(&mut self) {
        self.is_silent = true;
    }

    pub(super) fn heard(&mut self, header: &Header, now_ns: i64) -> Option<News> {
        let before = self.next;
        let restarted = before.is_some_and(|(session, _)| session != header.session);
        if let Some((session, next)) = before
            && session == header.session
        {
            self.lost += header.sequence.saturating_sub(next);
        }
        self.next = Some((header.session, header.sequence.saturating_add(1)));
        let after_ns = now_ns - std::mem::replace(&mut self.last_ns, now_ns);
        let was_silent = std::mem::take(&mut self.is_silent);
        match (was_silent, before) {
            (true, None) => Some(News::Speaks),
            (true, Some(_)) => Some(News::Again {
                after_ns,
                restarted,
            }),
            _ if restarted => Some(News::Restarted),
            _ => None,
        }
    }

    pub(super) fn is_silent(&self) -> bool {
        self.is_silent
    }

    /// Whether it has just become silent.
    pub(super) fn becomes_silent(&mut self, now_ns: i64) -> bool {
        let silent = now_ns.saturating_sub(self.last_ns) > SILENCE_NS;
        silent && !std::mem::replace(&mut self.is_silent, true)
    }

    /// Nobody looked for a while: what was said meanwhile is still to come.
    pub(super) fn was_not_asked(&mut self, now_ns: i64) {
        if !self.is_silent {
            self.last_ns = now_ns;
        }
    }

    /// What was lost since this was asked.
    pub(super) fn take_lost(&mut self) -> u64 {
        std::mem::take(&mut self.lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(session: u64, sequence: u64) -> Header {
        Header {
            session,
            sequence,
            ..Header::default()
        }
    }

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn gaps_in_the_count_of_one_session_are_losses() {
        let mut hearing = Hearing::begin(0);
        for sequence in [40, 41, 44, 43, 44] {
            assert_eq!(hearing.heard(&header(1, sequence), 0), None);
        }
        assert_eq!((hearing.take_lost(), hearing.take_lost()), (2, 0));
        assert_eq!(hearing.heard(&header(2, 7), 0), Some(News::Restarted));
        assert_eq!(hearing.take_lost(), 0);
    }

    #[test]
    fn a_robot_comes_goes_and_comes_back() {
        let mut hearing = Hearing::begin(0);
        hearing.is_missed();
        assert!(!hearing.becomes_silent(9 * SECOND), "it was said before");
        assert_eq!(
            hearing.heard(&header(1, 0), 10 * SECOND),
            Some(News::Speaks)
        );
        assert!(!hearing.becomes_silent(11 * SECOND));
        assert!(hearing.becomes_silent(11 * SECOND + 1) && !hearing.becomes_silent(13 * SECOND));
        let back = |restarted| {
            Some(News::Again {
                after_ns: 4 * SECOND,
                restarted,
            })
        };
        assert_eq!(hearing.heard(&header(2, 0), 14 * SECOND), back(true));
        assert!(hearing.becomes_silent(16 * SECOND));
        assert_eq!(hearing.heard(&header(2, 1), 18 * SECOND), back(false));
        assert_eq!(hearing.take_lost(), 0);
    }

    #[test]
    fn who_did_not_look_heard_no_silence() {
        let mut hearing = Hearing::begin(0);
        hearing.was_not_asked(5 * SECOND);
        assert!(!hearing.becomes_silent(5 * SECOND));
        assert!(hearing.becomes_silent(7 * SECOND));
    }
}
