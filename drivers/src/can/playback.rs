//! A recorded log played in real time: a timer takes the place of the interface.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::{Arc, OnceLock};

use rustix::io::Errno;
use rustix::time::{
    ClockId, Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, clock_gettime,
    timerfd_create, timerfd_settime,
};

use super::candump::{Log, LogFrame};
use super::filter::Filter;
use super::health::{BusHealth, BusState};
use super::log_report::LogReport;
use super::received::{Drained, FRAMES_PER_CALL, Received};
use super::socket_bus::accept;

/// Plays a log from the first call of `receive` on: waiting to be waited for costs no frames.
///
/// Stamps are the start's `CLOCK_BOOTTIME` plus the frame's offset in the log, so they keep the recorded spacing to the
/// nanosecond, whatever is done to the clock of the day.
#[derive(Debug)]
pub(super) struct Playback {
    log: Log,
    next: usize,
    timer: OwnedFd,
    /// The stamp in the log with which playing begins \[ns\].
    origin_ns: i64,
    /// When that is due \[ns\]; logs that are played together share it.
    start_ns: Arc<OnceLock<i64>>,
}

impl Playback {
    pub(super) fn new(log: Log) -> Result<Self, Errno> {
        let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
        let timer = timerfd_create(TimerfdClockId::Boottime, flags)?;
        let origin_ns = log.frames().first().map_or(0, |first| first.stamp_ns);
        let playback = Self {
            log,
            next: 0,
            timer,
            origin_ns,
            start_ns: Arc::default(),
        };
        playback.wake_at(1)?;
        Ok(playback)
    }

    /// Stamps of its first and its last frame \[ns\].
    pub(super) fn span_ns(&self) -> [i64; 2] {
        let frames = self.log.frames();
        [frames.first(), frames.last()].map(|frame| frame.map_or(0, |frame| frame.stamp_ns))
    }

    /// Plays logs of one time as one: with the earliest of their frames all begin.
    pub(super) fn join(logs: &mut [&mut Self]) {
        let Some(origin_ns) = logs.iter().map(|log| log.origin_ns).min() else {
            return;
        };
        let start_ns = Arc::default();
        for log in logs {
            (log.origin_ns, log.start_ns) = (origin_ns, Arc::clone(&start_ns));
        }
    }

    /// What was found in the log when it was read.
    pub(super) fn report(&self) -> &LogReport {
        self.log.report()
    }

    pub(super) fn receive(
        &mut self,
        number: u8,
        filter: &Filter,
        health: &mut BusHealth,
        sink: &mut impl FnMut(&Received),
    ) -> Drained {
        let now_ns = now_ns();
        let start_ns = *self.start_ns.get_or_init(|| now_ns);
        let mut frames = 0;
        while let Some((log, offset_ns)) = self.due(now_ns - start_ns) {
            if frames == FRAMES_PER_CALL {
                return Drained { frames, more: true };
            }
            self.next += 1;
            frames += 1;
            if accept(&log.frame, filter, health) {
                sink(&Received {
                    frame: log.frame,
                    stamp_ns: start_ns.saturating_add(offset_ns),
                    bus: number,
                });
            }
        }
        self.arm(start_ns, health);
        Drained {
            frames,
            more: false,
        }
    }

    /// The next frame and its offset from the origin, if it is due.
    fn due(&self, elapsed_ns: i64) -> Option<(LogFrame, i64)> {
        self.upcoming()
            .filter(|&(_, offset_ns)| offset_ns <= elapsed_ns)
    }

    fn upcoming(&self) -> Option<(LogFrame, i64)> {
        let next = self.log.frames().get(self.next)?;
        Some((*next, next.stamp_ns.saturating_sub(self.origin_ns)))
    }

    fn arm(&self, start_ns: i64, health: &mut BusHealth) {
        let due_ns = self
            .upcoming()
            .map(|(_, offset_ns)| start_ns.saturating_add(offset_ns));
        if due_ns.is_none() {
            health.state = BusState::Ended;
        }
        // Zero disarms. The only errors are a bad descriptor or time, and both are our own.
        let _ = self.wake_at(due_ns.unwrap_or(0));
    }

    fn wake_at(&self, at_ns: i64) -> Result<(), Errno> {
        let it_value = Timespec {
            tv_sec: at_ns / NS_PER_S,
            tv_nsec: at_ns % NS_PER_S,
        };
        let when = Itimerspec {
            it_interval: Timespec::default(),
            it_value,
        };
        timerfd_settime(&self.timer, TimerfdTimerFlags::ABSTIME, &when).map(drop)
    }
}

const NS_PER_S: i64 = 1_000_000_000;

fn now_ns() -> i64 {
    let now = clock_gettime(ClockId::Boottime);
    now.tv_sec
        .saturating_mul(NS_PER_S)
        .saturating_add(now.tv_nsec)
}

impl AsFd for Playback {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.timer.as_fd()
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use rustix::event::{PollFd, PollFlags, poll};

    use super::*;

    fn playback(lines: &str) -> Playback {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(lines.as_bytes()).unwrap();
        Playback::new(Log::read(file.path(), None, &Filter::All).unwrap()).unwrap()
    }

    #[test]
    fn frames_come_in_order_at_the_spacing_of_the_log() {
        let mut playback = playback(
            "(1.000000) can0 001#\n(1.000000) can0 002#\n(1.010000) can0 003#\n(1.025001) can0 004#\n",
        );
        let mut health = BusHealth::new(BusState::Up);
        let mut got: Vec<Received> = Vec::new();
        while health.state != BusState::Ended {
            poll(&mut [PollFd::new(&playback, PollFlags::IN)], None).unwrap();
            playback.receive(3, &Filter::All, &mut health, &mut |received| {
                got.push(*received);
            });
        }
        let offsets_ns: Vec<_> = got
            .iter()
            .map(|received| received.stamp_ns - got[0].stamp_ns)
            .collect();
        assert_eq!(offsets_ns, [0, 0, 10_000_000, 25_001_000]);
        assert_eq!(health.counters.frames, 4);
        assert!(got.iter().all(|received| received.bus == 3));
    }
}
