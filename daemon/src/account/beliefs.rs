//! When the belief is due to be saved, for a robot that is started again to go on from.

use coloc_estimator::{Estimate, OdometryState};

use super::losses::Teller;
use crate::config::{Config, nanos};
use crate::event::Event;

/// As often as the configuration says.
#[derive(Debug)]
pub(super) struct Beliefs {
    /// None: nobody wants it saved \[ns\].
    period_ns: Option<i64>,
    next_ns: i64,
}

impl Beliefs {
    pub(super) fn new(config: &Config) -> Self {
        let period_ns = nanos(1.0 / config.telemetry.state_hz);
        Self {
            period_ns: config.initial.resume.then_some(period_ns),
            next_ns: 0,
        }
    }

    /// That of a tick.
    pub(super) fn next(&mut self, estimate: &Estimate, teller: &mut Teller) {
        if self.is_due(estimate.stamp.as_nanos()) {
            tell(estimate, teller);
        }
    }

    /// The last one, due or not.
    pub(super) fn last(&self, estimate: &Estimate, teller: &mut Teller) {
        if self.period_ns.is_some() {
            tell(estimate, teller);
        }
    }

    fn is_due(&mut self, now_ns: i64) -> bool {
        let Some(period_ns) = self.period_ns else {
            return false;
        };
        let due = now_ns >= self.next_ns;
        if due {
            self.next_ns = now_ns + period_ns;
        }
        due
    }
}

fn tell(estimate: &Estimate, teller: &mut Teller) {
    let measured = estimate.odometry != OdometryState::Stale;
    teller.tell(Event::Belief {
        boot_ns: estimate.stamp.as_nanos(),
        belief: estimate.belief,
        velocity: measured.then_some(estimate.velocity),
        gyro: estimate.gyro.map(|it| [it.bias, it.bias_variance]),
    });
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use coloc_estimator::Stamp;

    use super::*;
    use crate::event::Link;

    /// How many of two seconds' ticks at 50 Hz are told, and whether the last one is.
    fn told(lines: &str) -> (usize, bool) {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n{lines}");
        let mut beliefs = Beliefs::new(&Config::parse(&text, Path::new("/a.toml")).unwrap());
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let mut estimate = Estimate::default();
        for tick in 1..=100 {
            estimate.stamp = Stamp::from_nanos(tick * 20_000_000);
            beliefs.next(&estimate, &mut teller);
        }
        let regular = link.waiting();
        beliefs.last(&estimate, &mut teller);
        (regular, link.waiting() > regular)
    }

    #[test]
    fn it_is_told_as_often_as_was_asked_for_and_once_more_at_the_end() {
        let resume = "[initial]\nresume = true\n[telemetry]\nstate_hz =";
        assert_eq!(told(&format!("{resume} 1.0\n")), (2, true));
        assert_eq!(told(&format!("{resume} 10.0\n")), (20, true));
    }

    #[test]
    fn nobody_is_told_who_does_not_save_it() {
        assert_eq!(told("[initial]\nresume = false\n"), (0, false));
    }
}
