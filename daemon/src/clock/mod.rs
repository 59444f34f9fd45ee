//! One clock inside, and the only place where the clocks of frames and messages are converted to it and from it. (A saved
//! belief, which outlives the boot, is dated in `saved::clocks`; a log is given stamps by its player, in the drivers.)
//!
//! Everything inside runs on `CLOCK_BOOTTIME`: nobody sets it, NTP only slews it, and, unlike `CLOCK_MONOTONIC`, it also counts
//! while the computer is suspended, when a robot may be pushed and its last pose grows old. The kernel stamps frames with
//! `CLOCK_REALTIME`, drivers and other robots stamp messages with a clock that they name; these are read as the inner
//! clock once, here. So a step of a wall clock changes the conversion and nothing else.
//!
//! A wall clock's distance from the inner one is a *constant of an epoch* ([`WallClock`]): were it measured anew at each
//! tick, equal stamps would become unequal, and the estimate would depend on the tick in which a message arrived.

mod frame;
mod header;
mod kernel;
mod timeline;
mod wall;

pub use frame::FrameTime;
pub use kernel::KernelTime;
pub use timeline::{ClockStep, Drain, Moment, Timeline};
pub use wall::WallClock;

/// Where the time comes from; tests bring their own.
pub trait TimeSource: Send {
    /// All clocks at one moment.
    fn read(&self) -> Reading;

    /// The inner clock alone \[ns\].
    fn now_ns(&self) -> i64 {
        self.read().boot_ns
    }

    /// What `CLOCK_REALTIME` of this source was when the kernel stamped a frame with `stamp_ns`: the same, where it is the kernel's.
    fn of_kernel(&self, stamp_ns: i64) -> i64 {
        stamp_ns
    }
}

/// All clocks at one moment.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// `CLOCK_BOOTTIME`, the inner clock, read first.
    pub boot_ns: i64,
    /// `CLOCK_REALTIME`
    pub realtime_ns: i64,
    /// `CLOCK_TAI`
    pub tai_ns: i64,
    /// The other clocks were read no later than so long after the inner one.
    pub width_ns: i64,
}
