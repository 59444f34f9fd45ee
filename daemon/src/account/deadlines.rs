//! How late the ticks woke up.

use coloc_shm_types::Status;

use super::losses::Teller;
use crate::event::Event;
use crate::wait::Wake;

/// Since the start.
#[derive(Debug, Default)]
pub(super) struct Deadlines {
    missed: u64,
    worst_lateness_ns: u64,
}

impl Deadlines {
    /// The wake-up's lateness \[ns\]; the deadlines that passed before it are counted and told.
    pub(super) fn woke(&mut self, wake: Wake, now_ns: i64, teller: &mut Teller) -> u64 {
        let Wake::Deadline {
            deadline_ns,
            missed,
        } = wake
        else {
            return 0;
        };
        let lateness_ns = u64::try_from(now_ns - deadline_ns).unwrap_or(0);
        self.worst_lateness_ns = self.worst_lateness_ns.max(lateness_ns);
        self.missed += missed;
        if missed > 0 {
            teller.tell(Event::Missed {
                deadlines: missed,
                lateness_ns,
            });
        }
        lateness_ns
    }

    pub(super) fn write_to(&self, status: &mut Status) {
        status.deadline_misses = self.missed;
        status.worst_lateness_ns = self.worst_lateness_ns;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::event::Link;

    #[test]
    fn missed_deadlines_add_up_and_the_worst_stays() {
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let (mut deadlines, deadline_ns) = (Deadlines::default(), 1000);
        for (missed, lateness_ns) in [(2, 50), (0, 1), (3, 20)] {
            let wake = Wake::Deadline {
                deadline_ns,
                missed,
            };
            let said = deadlines.woke(wake, deadline_ns + lateness_ns, &mut teller);
            assert_eq!(said, lateness_ns.unsigned_abs());
        }
        assert_eq!((deadlines.missed, deadlines.worst_lateness_ns), (5, 50));
        assert_eq!(link.waiting(), 2);
    }
}
