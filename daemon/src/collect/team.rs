//! Who speaks to this robot, and what is known of how old a message may be.

use coloc_estimator::Stamp;
use coloc_shm_types::{Clock, Limits, Present, boot};

use crate::config::{Config, nanos};

/// What a message is held against.
#[derive(Debug)]
pub(super) struct Team {
    own: u16,
    robots: Box<[u16]>,
    boot: u64,
    history_ns: i64,
    future_tolerance_ns: i64,
}

impl Team {
    pub(super) fn new(config: &Config) -> Self {
        let own = config.robot.id;
        let others = config.peers().map(|peer| peer.id);
        Self {
            own,
            robots: std::iter::once(own).chain(others).collect(),
            boot: boot(),
            history_ns: nanos(config.history.length_s),
            future_tolerance_ns: nanos(config.history.future_tolerance_s),
        }
    }

    /// At `now`, of the inner clock.
    pub(super) fn limits(&self, now: Stamp) -> Limits<'_> {
        Limits {
            now: Present::only(Clock::Boottime, now.as_nanos()),
            boot: self.boot,
            history_ns: self.history_ns,
            future_tolerance_ns: self.future_tolerance_ns,
            own: self.own,
            robots: &self.robots,
        }
    }

    /// The same for what is of use however late it comes, if it is newer than `before`, less the history.
    pub(super) fn limits_since(&self, before: Stamp, now: Stamp) -> Limits<'_> {
        let late_ns = (now - before).as_nanos().max(0);
        Limits {
            history_ns: self.history_ns.saturating_add(late_ns),
            ..self.limits(now)
        }
    }

    /// How many robots there are.
    pub(super) fn size(&self) -> usize {
        self.robots.len()
    }
}
