//! What waits for a member to be sent: bounded, the newest first to stay.
use std::collections::VecDeque;

use coloc_shm_types::Matters;

/// Something to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Waiting {
    /// The kind, as it is numbered on the wire.
    pub kind: u32,
    /// What of the kind matters.
    pub matters: Matters,
    /// After that it is of no use (ns of `CLOCK_BOOTTIME`).
    pub until_ns: i64,
    /// The whole message.
    pub bytes: Vec<u8>,
}

/// Messages that wait, the oldest in front.
#[derive(Debug, Default)]
pub struct Queue {
    waiting: VecDeque<Waiting>,
}

impl Queue {
    /// So many may wait.
    pub const MOST: usize = 64;

    /// Takes in a message; one that makes an earlier one needless takes its place in the row. How many others had to go.
    pub fn push(&mut self, message: Waiting) -> u64 {
        if message.matters == Matters::Newest {
            let earlier = self.waiting.iter_mut().find(|it| it.kind == message.kind);
            if let Some(earlier) = earlier {
                *earlier = message;
                return 1;
            }
        }
        let full = self.waiting.len() >= Self::MOST;
        if full {
            self.waiting.pop_front();
        }
        self.waiting.push_back(message);
        u64::from(full)
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// The next that is still of use at `now_ns`, and how many before it were not.
    pub fn pop(&mut self, now_ns: i64) -> (Option<Waiting>, u64) {
        let mut too_old = 0;
        while let Some(message) = self.waiting.pop_front() {
            if message.until_ns >= now_ns {
                return (Some(message), too_old);
            }
            too_old += 1;
        }
        (None, too_old)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(kind: u32, matters: Matters, until_ns: i64) -> Waiting {
        Waiting {
            kind,
            matters,
            until_ns,
            bytes: Vec::new(),
        }
    }

    #[test]
    fn the_oldest_gives_way_and_the_newest_takes_the_place_of_its_kind() {
        let mut queue = Queue::default();
        let most = i64::try_from(Queue::MOST).unwrap();
        for place in 0..most {
            assert_eq!(queue.push(message(1, Matters::All, place)), 0);
        }
        assert_eq!(queue.push(message(2, Matters::Newest, 1000)), 1);
        assert_eq!(queue.push(message(2, Matters::Newest, 2000)), 1);
        let all: Vec<_> = std::iter::from_fn(|| queue.pop(0).0).collect();
        assert_eq!(all.len(), Queue::MOST);
        assert_eq!(all.first().unwrap().until_ns, 1);
        assert_eq!(all.last().unwrap().until_ns, 2000);
    }

    #[test]
    fn what_is_too_old_is_passed_over_and_counted() {
        let mut queue = Queue::default();
        for until_ns in [1, 2, 30] {
            queue.push(message(1, Matters::All, until_ns));
        }
        let (next, too_old) = queue.pop(10);
        assert_eq!((next.unwrap().until_ns, too_old), (30, 2));
        assert_eq!(queue.pop(10), (None, 0));
    }
}
