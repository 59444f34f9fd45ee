//! What the operating system is asked for, and what to do when it refuses.

use std::fmt;
use std::hint::black_box;
use std::io;

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CpuSet, sched_setaffinity};

use crate::config::{Realtime, Scheduler};

/// A request that the operating system refused.
#[derive(Debug)]
pub struct Refused {
    /// What was asked for.
    pub what: String,
    /// What it said.
    pub why: io::Error,
    /// What the person can do.
    pub remedy: &'static str,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} was refused ({}): {}",
            self.what, self.why, self.remedy
        )
    }
}

/// Makes the calling thread a real-time thread as far as the system lets it; the class comes last, so that the
/// slow part of the set-up does not run ahead of everybody.
#[must_use]
pub fn set_up(wanted: &Realtime) -> Vec<Refused> {
    let mut refused = Vec::new();
    refused.extend(pin(&wanted.cpus).err());
    if wanted.lock_memory {
        refused.extend(lock_memory().err());
    }
    prefault_stack(wanted.prefault_stack_kib);
    refused.extend(schedule(wanted).err());
    refused
}

fn pin(cpus: &[usize]) -> Result<(), Refused> {
    if cpus.is_empty() {
        return Ok(());
    }
    let mut set = CpuSet::new();
    for &cpu in cpus {
        set.set(cpu);
    }
    sched_setaffinity(None, &set).map_err(|errno| Refused {
        what: format!("realtime.cpus = {cpus:?}"),
        why: errno.into(),
        remedy: "name processors that are online and in this process's cpuset (see `nproc`, `taskset -p $$`)",
    })
}

/// Everything that is mapped now; everything to come as well only where no limit can be hit by it, because a
/// mapping beyond the limit would fail altogether.
fn lock_memory() -> Result<(), Refused> {
    let unlimited =
        rustix::process::geteuid().is_root() || getrlimit(Resource::Memlock).current.is_none();
    let flags = if unlimited {
        MlockAllFlags::CURRENT | MlockAllFlags::FUTURE
    } else {
        MlockAllFlags::CURRENT
    };
    mlockall(flags).map_err(|errno| Refused {
        what: "realtime.lock_memory".into(),
        why: errno.into(),
        remedy: "raise the limit: `memlock unlimited` in /etc/security/limits.conf, LimitMEMLOCK=infinity in the unit, \
                 or CAP_IPC_LOCK",
    })
}

/// Touches the stack below, so that no page of it is missing later.
fn prefault_stack(kib: usize) {
    #[inline(never)]
    fn touch(pages: usize) {
        let mut page = [0_u8; 4096];
        black_box(&mut page);
        if pages > 1 {
            touch(pages - 1);
        }
        black_box(&mut page); // Keeps the frame alive: without it the call above would reuse this page.
    }
    touch(kib.div_ceil(4));
}

#[allow(unsafe_code)] // No safe wrapper of sched_setscheduler is among the dependencies.
fn schedule(wanted: &Realtime) -> Result<(), Refused> {
    let (policy, name) = match wanted.scheduler {
        Scheduler::Other => return Ok(()),
        Scheduler::Fifo => (libc::SCHED_FIFO, "fifo"),
        Scheduler::Rr => (libc::SCHED_RR, "rr"),
    };
    let param = libc::sched_param {
        sched_priority: wanted.priority.into(),
    };
    // SAFETY: `param` is a valid sched_param for the duration of the call; 0 is the calling thread.
    let result = unsafe { libc::sched_setscheduler(0, policy, &raw const param) };
    if result == 0 {
        return Ok(());
    }
    Err(Refused {
        what: format!(
            "realtime.scheduler = \"{name}\" with realtime.priority = {}",
            wanted.priority
        ),
        why: io::Error::last_os_error(),
        remedy: "allow it: `rtprio 99` in /etc/security/limits.conf, LimitRTPRIO=99 in the unit, or CAP_SYS_NICE",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_processor_that_does_not_exist_is_refused_with_a_remedy() {
        let wanted = Realtime {
            cpus: vec![1023],
            scheduler: Scheduler::Other,
            lock_memory: false,
            ..Realtime::default()
        };
        let refused = std::thread::spawn(move || set_up(&wanted)).join().unwrap();
        let text = refused.first().expect("refused").to_string();
        assert!(
            text.contains("realtime.cpus = [1023]") && text.contains("online"),
            "{text}"
        );
    }

    #[test]
    fn nothing_asked_nothing_refused() {
        let wanted = Realtime {
            scheduler: Scheduler::Other,
            lock_memory: false,
            ..Realtime::default()
        };
        assert!(
            std::thread::spawn(move || set_up(&wanted))
                .join()
                .unwrap()
                .is_empty()
        );
    }
}
