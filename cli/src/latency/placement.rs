//! Which processor everybody runs on: the daemon on one of its own, where there are two.

use coloc_daemon::config::{Realtime, Scheduler};
use coloc_daemon::realtime;
use rustix::thread::{CpuSet, sched_getaffinity};

/// Processors for the daemon, and for everybody else.
#[derive(Clone, Debug)]
pub(crate) struct Placement {
    pub(crate) daemon: Vec<usize>,
    pub(crate) others: Vec<usize>,
}

impl Placement {
    /// Of those that this process may use, the last is for the daemon, the last but one for sender and reader.
    pub(crate) fn choose() -> Self {
        let usable: Vec<usize> = sched_getaffinity(None).map_or_else(
            |_| Vec::new(),
            |set| {
                (0..CpuSet::MAX_CPU)
                    .filter(|&cpu| set.is_set(cpu))
                    .collect()
            },
        );
        match usable.as_slice() {
            [.., other, daemon] => Self {
                daemon: vec![*daemon],
                others: vec![*other],
            },
            _ => Self {
                daemon: Vec::new(),
                others: Vec::new(),
            },
        }
    }
}

/// Moves the calling thread to `cpus`; in real time if `urgent`. Where that is refused, it stays as it is: the lateness
/// shows in the figures.
pub(crate) fn settle(cpus: &[usize], urgent: bool) {
    let wanted = Realtime {
        scheduler: if urgent {
            Scheduler::Fifo
        } else {
            Scheduler::Other
        },
        cpus: cpus.to_vec(),
        lock_memory: false,
        ..Realtime::default()
    };
    let _ = realtime::set_up(&wanted);
}
