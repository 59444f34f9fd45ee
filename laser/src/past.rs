//! What a robot has said of itself lately: a scan that comes late is of a moment about which more has been said since.

use crate::beliefs::Belief;

/// So many beliefs: more than a second of 50 Hz.
const MOST: usize = 64;

/// The last beliefs of a robot.
#[derive(Clone, Debug)]
pub(crate) struct Past {
    said: Vec<Belief>,
    /// Where the next one goes.
    next: usize,
}

impl Default for Past {
    fn default() -> Self {
        Self {
            said: Vec::with_capacity(MOST),
            next: 0,
        }
    }
}

impl Past {
    /// Takes in what it says now; nothing if it does not know where it is, and then what it said before counts no more.
    pub(crate) fn hear(&mut self, belief: Option<Belief>) {
        let Some(belief) = belief else {
            self.said.clear();
            self.next = 0;
            return;
        };
        match self.said.get_mut(self.next) {
            Some(oldest) => *oldest = belief,
            None => self.said.push(belief),
        }
        self.next = (self.next + 1) % MOST;
    }

    /// The belief of the moment that is nearest to `at_ns`.
    pub(crate) fn nearest(&self, at_ns: i64) -> Option<Belief> {
        let apart = |it: &&Belief| it.at_ns.abs_diff(at_ns);
        self.said.iter().min_by_key(apart).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn belief(at_ns: i64) -> Belief {
        Belief {
            at_ns,
            ..Belief::default()
        }
    }

    #[test]
    fn the_nearest_of_the_last_ones_is_found() {
        let mut past = Past::default();
        assert!(past.nearest(0).is_none());
        let count = i64::try_from(MOST).unwrap() + 10;
        for at_ns in 0..count {
            past.hear(Some(belief(10 * at_ns)));
        }
        for (at_ns, nearest_ns) in [(504, 500), (0, 100), (i64::MAX, 10 * count - 10)] {
            assert_eq!(past.nearest(at_ns).unwrap().at_ns, nearest_ns);
        }
        past.hear(None);
        assert!(past.nearest(0).is_none());
        past.hear(Some(belief(7)));
        assert_eq!(past.nearest(0).unwrap().at_ns, 7);
    }
}
