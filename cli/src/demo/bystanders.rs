//! Threads that do nothing but wake, one on each processor: when they are late, the machine is, and no robot of ours.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use coloc_daemon::config::Realtime;
use coloc_daemon::realtime;

use super::clock::{now_ns, sleep_until};

/// How often they wake \[ns\].
const PERIOD_NS: i64 = 5_000_000;

/// What is later than that is noted \[ns\].
const NOTED_NS: i64 = 10_000_000;

/// The threads, while they run.
#[derive(Debug)]
pub(crate) struct Bystanders {
    end: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Vec<Stall>>>,
}

/// A time in which a processor did not serve a thread that was due \[ns of `CLOCK_BOOTTIME`\].
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) struct Stall {
    pub(crate) from_ns: i64,
    pub(crate) until_ns: i64,
}

impl Bystanders {
    /// As urgent as the robots are by default, where that is allowed. Where no thread is to be had, nobody watches.
    pub(crate) fn start() -> Self {
        let end = Arc::new(AtomicBool::new(false));
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let watch = |cpu| {
            let end = Arc::clone(&end);
            let thread = std::thread::Builder::new().name("bystander".into());
            thread.spawn(move || stand_by(cpu, &end)).ok()
        };
        let threads = (0..processors).filter_map(watch).collect();
        Self { end, threads }
    }

    /// Ends them; when the machine stood still, in the order of time.
    pub(crate) fn end(&mut self) -> Vec<Stall> {
        self.end.store(true, Ordering::Relaxed);
        let stalls = self.threads.drain(..).filter_map(|it| it.join().ok());
        union(stalls.flatten().collect())
    }
}

fn stand_by(cpu: usize, end: &AtomicBool) -> Vec<Stall> {
    // What is refused to them is refused to the robots too.
    let _ = realtime::set_up(&Realtime {
        cpus: vec![cpu],
        lock_memory: false,
        prefault_stack_kib: 16,
        ..Realtime::default()
    });
    let mut stalls = Vec::new();
    let mut due_ns = now_ns();
    while !end.load(Ordering::Relaxed) {
        due_ns = due_ns.max(now_ns() - PERIOD_NS) + PERIOD_NS;
        sleep_until(due_ns);
        let until_ns = now_ns();
        if until_ns - due_ns >= NOTED_NS {
            stalls.push(Stall {
                from_ns: due_ns,
                until_ns,
            });
        }
    }
    stalls
}

/// The same times, those that overlap as one.
fn union(mut stalls: Vec<Stall>) -> Vec<Stall> {
    stalls.sort_unstable_by_key(|stall| stall.from_ns);
    let mut union: Vec<Stall> = Vec::new();
    for stall in stalls {
        match union.last_mut() {
            Some(last) if stall.from_ns <= last.until_ns => {
                last.until_ns = last.until_ns.max(stall.until_ns);
            }
            _ => union.push(stall),
        }
    }
    union
}

/// For how long the machine stood still between two moments \[ns\].
pub(crate) fn stalled_ns(stalls: &[Stall], from_ns: i64, until_ns: i64) -> i64 {
    let within = |stall: &Stall| stall.until_ns.min(until_ns) - stall.from_ns.max(from_ns);
    stalls.iter().map(|stall| within(stall).max(0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stall(from_ns: i64, until_ns: i64) -> Stall {
        Stall { from_ns, until_ns }
    }

    #[test]
    fn processors_that_stall_together_stall_once() {
        let stalls = union(vec![stall(50, 70), stall(10, 30), stall(20, 40)]);
        assert_eq!(stalls, [stall(10, 40), stall(50, 70)]);
        assert_eq!(stalled_ns(&stalls, 0, 100), 50);
        assert_eq!(stalled_ns(&stalls, 35, 60), 15);
        assert_eq!(stalled_ns(&stalls, 41, 49), 0);
    }

    #[test]
    fn they_end_when_they_are_to() {
        let mut bystanders = Bystanders::start();
        assert!(!bystanders.threads.is_empty());
        bystanders.end();
    }
}
