//! Step 1 of the tick: the one place that blocks.
//!
//! `timer`: a timerfd with absolute deadlines, so that lateness does not add up. `encoder`: a frame's arrival. Half a
//! period after a frame that did not come the timer takes over, at the same rate, until frames come again; as long as they
//! do, nobody sets it. `auto`: one or the other, and where the deadlines are, as the [`pace`](crate::pace) of what comes has it.
//!
//! Waiting is sleeping, unless [`Wait::polling`] says otherwise: then the clock is asked and, where
//! frames start the ticks, the buses in turn.

use std::mem::MaybeUninit;
use std::os::fd::{BorrowedFd, OwnedFd};

use rustix::event::{Timespec, epoll};
use rustix::io::Errno;
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, timerfd_create, timerfd_settime,
};

use crate::clock::{KernelTime, TimeSource};
use crate::config::{Trigger, WaitMode};
use crate::pace::{Arrivals, Pace};

/// Why the wait ended.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Wake {
    /// A deadline came. Those that passed while nobody waited are `missed`: one tick makes up for all of them.
    Deadline {
        /// The first deadline that no tick has served \[ns of `CLOCK_BOOTTIME`\].
        deadline_ns: i64,
        /// Deadlines after that which have passed as well.
        missed: u64,
    },
    /// A CAN bus has something to read.
    Frame,
    /// The program is to end.
    Stop,
}

/// Waits for deadlines, frames and the end.
#[derive(Debug)]
pub struct Wait {
    /// For the timer and the end alone; and for frames as well.
    quiet: OwnedFd,
    epoll: OwnedFd,
    timer: OwnedFd,
    /// Kept open for as long as it is waited on.
    _stop: OwnedFd,
    trigger: Trigger,
    /// What decides, if the trigger leaves it open.
    pace: Option<Pace>,
    mode: WaitMode,
    period_ns: i64,
    /// Frames start ticks.
    by_frames: bool,
    /// A frame came too early: the deadline that is set takes it in.
    held: bool,
    /// Frames start no tick before.
    not_before_ns: i64,
    /// The timer is set: always, where it is the trigger.
    armed: bool,
    /// The first deadline that no tick has served.
    next_ns: i64,
}

const TIMER: u64 = 0;
const STOP: u64 = 1;
const FRAME: u64 = 2;

/// The kernel's waits are in whole milliseconds, where it is to be an old kernel too.
const MILLISECOND_NS: i64 = 1_000_000;
/// Who polls asks so rarely whether the program is to end: that takes a system call.
const TURNS_PER_LOOK: u64 = 64;

impl Wait {
    /// The first deadline is one period after `now_ns` of `CLOCK_BOOTTIME`. Readable `stop` ends the wait for good.
    ///
    /// # Errors
    /// What the kernel says: out of file descriptors, in practice.
    pub fn new(
        trigger: Trigger,
        period_ns: i64,
        now_ns: i64,
        stop: OwnedFd,
    ) -> Result<Self, Errno> {
        let timer = timerfd_create(
            TimerfdClockId::Boottime,
            TimerfdFlags::CLOEXEC | TimerfdFlags::NONBLOCK,
        )?;
        let mut wait = Self {
            quiet: waiting_for(&timer, &stop)?,
            epoll: waiting_for(&timer, &stop)?,
            timer,
            _stop: stop,
            trigger,
            pace: (trigger == Trigger::Auto).then(|| Pace::new(period_ns)),
            mode: WaitMode::Sleep,
            period_ns,
            by_frames: trigger == Trigger::Encoder,
            held: false,
            not_before_ns: i64::MIN,
            armed: false,
            next_ns: 0,
        };
        wait.arm(now_ns + period_ns)?;
        Ok(wait)
    }

    /// Asks again and again rather than sleep, if `mode` says so.
    #[must_use]
    pub fn polling(mut self, mode: WaitMode) -> Self {
        self.mode = mode;
        self
    }

    /// Whether it sleeps: then there may be time for something else before it does.
    #[must_use]
    pub fn sleeps(&self) -> bool {
        self.mode == WaitMode::Sleep
    }

    /// Lets frames on `bus` end the wait, if that may be the trigger.
    ///
    /// # Errors
    /// What the kernel says: the descriptor cannot be waited on.
    pub fn watch(&self, bus: BorrowedFd<'_>) -> Result<(), Errno> {
        if self.trigger == Trigger::Timer || self.mode == WaitMode::Poll {
            return Ok(());
        }
        match epoll::add(
            &self.epoll,
            bus,
            epoll::EventData::new_u64(FRAME),
            epoll::EventFlags::IN,
        ) {
            Err(Errno::EXIST) => Ok(()),
            result => result,
        }
    }

    /// Blocks until there is a reason for a tick, or to end. Who polls asks `has_frames`.
    ///
    /// # Errors
    /// What the kernel says; there is no going on without a clock.
    pub fn wait(&mut self, has_frames: impl FnMut() -> bool) -> Result<Wake, Errno> {
        match self.mode {
            WaitMode::Sleep => self.sleep(),
            WaitMode::Poll => self.poll(has_frames),
        }
    }

    fn sleep(&mut self) -> Result<Wake, Errno> {
        loop {
            let patience = self.patience()?;
            let mut storage = [MaybeUninit::<epoll::Event>::uninit(); 8];
            let by_frames = self.by_frames && !self.held;
            let epoll = if by_frames { &self.epoll } else { &self.quiet };
            let events = match epoll::wait(epoll, &mut storage, patience.as_ref()) {
                Ok((events, _)) => events,
                Err(Errno::INTR) => continue,
                Err(error) => return Err(error),
            };
            let has = |tag: u64| events.iter().any(|event| event.data.u64() == tag);
            let (stop, frame, timer) = (has(STOP), has(FRAME), has(TIMER));
            match (stop, frame, timer) {
                (true, ..) => return Ok(Wake::Stop),
                (_, true, _) if self.is_too_early() => self.hold()?,
                (_, true, _) => return Ok(Wake::Frame),
                (.., true) => {
                    if let Some(wake) = self.deadline()? {
                        return Ok(wake);
                    }
                }
                _ => {}
            }
        }
    }

    /// The rate is a promise, though frames may come at any moment.
    fn is_too_early(&self) -> bool {
        self.pace.is_some() && KernelTime.now_ns() < self.not_before_ns
    }

    /// The frame waits in the kernel until it is time for a tick.
    fn hold(&mut self) -> Result<(), Errno> {
        self.held = true;
        self.arm(self.not_before_ns)
    }

    /// For how long to wait for frames alone; without end once the timer is set, which is done when little is left.
    fn patience(&mut self) -> Result<Option<Timespec>, Errno> {
        if self.armed {
            return Ok(None);
        }
        let left_ns = self.next_ns - KernelTime.now_ns();
        if left_ns < MILLISECOND_NS {
            self.arm(self.next_ns)?;
            return Ok(None);
        }
        Ok(Some(timespec(left_ns - left_ns % MILLISECOND_NS)))
    }

    fn poll(&mut self, mut has_frames: impl FnMut() -> bool) -> Result<Wake, Errno> {
        for turn in 1_u64.. {
            let now_ns = KernelTime.now_ns();
            if self.by_frames && now_ns >= self.not_before_ns && has_frames() {
                return Ok(Wake::Frame);
            }
            let late_ns = now_ns - self.next_ns;
            if late_ns >= 0 {
                return Ok(self.passed(1 + (late_ns / self.period_ns).unsigned_abs()));
            }
            if turn.is_multiple_of(TURNS_PER_LOOK) && self.is_to_stop()? {
                break;
            }
        }
        Ok(Wake::Stop)
    }

    fn is_to_stop(&self) -> Result<bool, Errno> {
        let mut storage = [MaybeUninit::<epoll::Event>::uninit(); 8];
        match epoll::wait(&self.epoll, &mut storage, Some(&timespec(0))) {
            Ok((events, _)) => Ok(events.iter().any(|event| event.data.u64() == STOP)),
            Err(Errno::INTR) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// A tick followed this wake-up, was stamped so and took in what has arrived: there the next one will start.
    ///
    /// # Errors
    /// What the kernel says.
    pub fn ticked(&mut self, wake: Wake, tick_ns: i64, arrivals: &Arrivals) -> Result<(), Errno> {
        let is_frame = wake == Wake::Frame;
        let Some(pace) = &mut self.pace else {
            return if is_frame {
                self.frame_came(tick_ns)
            } else {
                Ok(())
            };
        };
        pace.ticked(tick_ns, arrivals);
        self.not_before_ns = tick_ns + self.period_ns / 2;
        let before = std::mem::replace(&mut self.by_frames, pace.follows_frames());
        match (self.by_frames, before) {
            (true, true) if !is_frame => Ok(()),
            (true, _) => self.frame_came(tick_ns),
            (false, true) => self.arm(tick_ns + self.period_ns),
            (false, false) => match pace.shift_ns(self.next_ns) {
                0 => Ok(()),
                shift_ns => self.arm(self.next_ns + shift_ns),
            },
        }
    }

    /// A frame started a tick at `now_ns`: moves the fallback behind the frame after it.
    fn frame_came(&mut self, now_ns: i64) -> Result<(), Errno> {
        self.next_ns = now_ns + self.period_ns + self.period_ns / 2;
        if std::mem::take(&mut self.armed) {
            self.set_timer(0, 0)?;
        }
        Ok(())
    }

    fn arm(&mut self, first_ns: i64) -> Result<(), Errno> {
        self.next_ns = first_ns;
        self.armed = true;
        self.set_timer(first_ns, self.period_ns)
    }

    /// All zero: never.
    fn set_timer(&self, first_ns: i64, period_ns: i64) -> Result<(), Errno> {
        let timer = Itimerspec {
            it_interval: timespec(period_ns),
            it_value: timespec(first_ns),
        };
        timerfd_settime(&self.timer, TimerfdTimerFlags::ABSTIME, &timer).map(drop)
    }

    fn deadline(&mut self) -> Result<Option<Wake>, Errno> {
        let mut count = [0; 8];
        match rustix::io::read(&self.timer, &mut count) {
            Ok(_) => {}
            Err(Errno::AGAIN | Errno::INTR) => return Ok(None),
            Err(error) => return Err(error),
        }
        self.held = false;
        Ok(Some(self.passed(u64::from_ne_bytes(count).max(1))))
    }

    /// So many deadlines have passed.
    fn passed(&mut self, count: u64) -> Wake {
        let deadline_ns = self.next_ns;
        let periods = i64::try_from(count).unwrap_or(i64::MAX);
        self.next_ns += self.period_ns.saturating_mul(periods);
        Wake::Deadline {
            deadline_ns,
            missed: count - 1,
        }
    }
}

/// An epoll of these two.
fn waiting_for(timer: &OwnedFd, stop: &OwnedFd) -> Result<OwnedFd, Errno> {
    let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
    for (fd, tag) in [(timer, TIMER), (stop, STOP)] {
        epoll::add(
            &epoll,
            fd,
            epoll::EventData::new_u64(tag),
            epoll::EventFlags::IN,
        )?;
    }
    Ok(epoll)
}

fn timespec(nanos: i64) -> Timespec {
    Timespec {
        tv_sec: nanos / 1_000_000_000,
        tv_nsec: nanos % 1_000_000_000,
    }
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsFd;
    use std::os::unix::net::UnixDatagram;

    use rustix::event::{EventfdFlags, eventfd};

    use super::*;
    use crate::clock::{KernelTime, TimeSource};
    use crate::pace::Arrival;

    const PERIOD: i64 = 2_000_000;

    fn wait(trigger: Trigger, start: i64) -> (Wait, OwnedFd) {
        let stop = eventfd(0, EventfdFlags::CLOEXEC).unwrap();
        let theirs = stop.try_clone().unwrap();
        (Wait::new(trigger, PERIOD, start, theirs).unwrap(), stop)
    }

    #[test]
    fn deadlines_stay_on_their_grid_and_are_never_early() {
        let start = KernelTime.now_ns();
        let (mut wait, _stop) = wait(Trigger::Timer, start);
        let mut expected = start + PERIOD;
        for _ in 0..20 {
            let Wake::Deadline {
                deadline_ns,
                missed,
            } = wait.wait(|| false).unwrap()
            else {
                panic!("a deadline was due")
            };
            assert_eq!(deadline_ns, expected);
            assert!(KernelTime.now_ns() >= deadline_ns);
            expected += PERIOD * (1 + i64::try_from(missed).unwrap());
        }
    }

    #[test]
    fn deadlines_missed_are_one_wake_and_counted() {
        let start = KernelTime.now_ns();
        let (mut wait, _stop) = wait(Trigger::Timer, start - 10 * PERIOD - PERIOD / 2);
        let Wake::Deadline {
            deadline_ns,
            missed,
        } = wait.wait(|| false).unwrap()
        else {
            panic!("deadlines have passed")
        };
        assert_eq!(deadline_ns, start - 9 * PERIOD - PERIOD / 2);
        assert!(missed >= 9);
    }

    #[test]
    fn a_frame_ends_the_wait_only_where_it_is_the_trigger() {
        for (trigger, frame_ends_it) in [(Trigger::Timer, false), (Trigger::Encoder, true)] {
            let (mut wait, _stop) = wait(trigger, KernelTime.now_ns());
            let (bus, sender) = UnixDatagram::pair().unwrap();
            wait.watch(bus.as_fd()).unwrap();
            sender.send(&[0]).unwrap();
            assert_eq!(wait.wait(|| false).unwrap() == Wake::Frame, frame_ends_it);
        }
    }

    #[test]
    fn the_timer_takes_over_when_frames_stop() {
        let (mut wait, _stop) = wait(Trigger::Encoder, KernelTime.now_ns());
        let now = KernelTime.now_ns();
        wait.frame_came(now).unwrap();
        let Wake::Deadline { deadline_ns, .. } = wait.wait(|| false).unwrap() else {
            panic!("nothing else can come")
        };
        assert_eq!(deadline_ns, now + PERIOD + PERIOD / 2);
    }

    #[test]
    fn when_frames_come_again_the_timer_is_silent() {
        let (mut wait, _stop) = wait(Trigger::Encoder, KernelTime.now_ns());
        for _ in 0..3 {
            let came = KernelTime.now_ns();
            wait.frame_came(came).unwrap();
            assert!(!wait.armed);
            let fallback = wait.wait(|| false).unwrap();
            let deadline_ns = came + PERIOD + PERIOD / 2;
            assert!(
                matches!(fallback, Wake::Deadline { deadline_ns: at, .. } if at == deadline_ns)
            );
            assert!(wait.armed);
        }
    }

    /// A wait that frames end, as they came regularly until `now_ns`.
    fn following_frames(now_ns: i64) -> (Wait, OwnedFd) {
        let (mut wait, stop) = wait(Trigger::Auto, now_ns);
        let mut arrivals = Arrivals::default();
        for number in -20..=0 {
            let at_ns = now_ns + number * PERIOD;
            arrivals.push(Arrival {
                at_ns,
                by_bus: true,
            });
            wait.ticked(Wake::Frame, at_ns, &arrivals).unwrap();
        }
        assert!(wait.by_frames && !wait.armed);
        (wait, stop)
    }

    #[test]
    fn frames_that_come_regularly_end_the_wait_and_no_earlier_than_half_a_period_after_the_last_tick()
     {
        let now_ns = KernelTime.now_ns();
        let (mut wait, _stop) = following_frames(now_ns);
        let (bus, sender) = UnixDatagram::pair().unwrap();
        wait.watch(bus.as_fd()).unwrap();
        sender.send(&[0]).unwrap();
        // Unless this thread was kept from running for so long that it is not too early any more.
        let wake = wait.wait(|| false).unwrap();
        let Wake::Deadline { deadline_ns, .. } = wake else {
            assert!(KernelTime.now_ns() >= now_ns + PERIOD / 2);
            return;
        };
        assert_eq!(deadline_ns, now_ns + PERIOD / 2);
        assert!(!wait.held, "the frame is for that tick");
        assert_eq!(wait.wait(|| false).unwrap(), Wake::Frame);
    }

    #[test]
    fn the_deadlines_take_over_where_frames_stop_or_others_speak() {
        let now_ns = KernelTime.now_ns();
        let (mut wait, _stop) = following_frames(now_ns);
        let fallback = wait.wait(|| false).unwrap();
        let expected_ns = now_ns + PERIOD + PERIOD / 2;
        assert!(
            matches!(fallback, Wake::Deadline { deadline_ns, .. } if deadline_ns == expected_ns)
        );
        let mut arrivals = Arrivals::default();
        for _ in 0..22 {
            arrivals.push(Arrival {
                at_ns: now_ns,
                by_bus: false,
            });
        }
        wait.ticked(fallback, expected_ns, &arrivals).unwrap();
        assert!(!wait.by_frames && wait.armed);
        assert_eq!(wait.next_ns, expected_ns + PERIOD);
    }

    #[test]
    fn polling_finds_the_same_deadlines() {
        let start = KernelTime.now_ns();
        let (wait, _stop) = wait(Trigger::Timer, start - 3 * PERIOD);
        let mut wait = wait.polling(WaitMode::Poll);
        let Wake::Deadline {
            deadline_ns,
            missed,
        } = wait.wait(|| true).unwrap()
        else {
            panic!("deadlines have passed")
        };
        assert_eq!(deadline_ns, start - 2 * PERIOD);
        assert!(missed >= 2);
        let next_ns = deadline_ns + PERIOD * (1 + i64::try_from(missed).unwrap());
        let next = wait.wait(|| true).unwrap();
        assert!(matches!(next, Wake::Deadline { deadline_ns, .. } if deadline_ns == next_ns));
        assert!(KernelTime.now_ns() >= next_ns);
    }

    #[test]
    fn polling_finds_frames_where_they_are_the_trigger() {
        let (wait, stop) = wait(Trigger::Encoder, KernelTime.now_ns() + 1000 * PERIOD);
        let mut wait = wait.polling(WaitMode::Poll);
        let mut asked = 0;
        let mut on_the_third = || {
            asked += 1;
            asked == 3
        };
        assert_eq!(wait.wait(&mut on_the_third).unwrap(), Wake::Frame);
        rustix::io::write(&stop, &1_u64.to_ne_bytes()).unwrap();
        assert_eq!(wait.wait(|| false).unwrap(), Wake::Stop);
    }

    #[test]
    fn stop_comes_before_everything_else() {
        let (mut wait, stop) = wait(Trigger::Timer, 1);
        rustix::io::write(&stop, &1_u64.to_ne_bytes()).unwrap();
        assert_eq!(wait.wait(|| false).unwrap(), Wake::Stop);
    }
}
