//! Encoders of two wheels, 50 Hz, on one bus or two.

use std::time::{Duration, Instant};

use coloc_drivers::can::Sender;
use coloc_drivers::encoder::WheelFrames;

use super::robot::METRES_PER_TICK;
use super::support::Interface;

const PERIOD: Duration = Duration::from_millis(20);

/// The encoders, and how far their wheels have come.
pub(crate) struct Wheels {
    senders: [Sender; 2],
    frames: WheelFrames,
    way_m: [f64; 2],
    period: Duration,
    next: Instant,
}

impl Wheels {
    pub(crate) fn new(left: &Interface, right: &Interface) -> Self {
        Self::between([left.sender(), right.sender()])
    }

    /// Those that send the left and the right wheel's frames.
    pub(crate) fn between(senders: [Sender; 2]) -> Self {
        let frames = WheelFrames::new(METRES_PER_TICK);
        Self {
            senders,
            frames,
            way_m: [0.0; 2],
            period: PERIOD,
            next: Instant::now(),
        }
    }

    /// With frames that come so often.
    pub(crate) fn every(self, period: Duration) -> Self {
        Self { period, ..self }
    }

    /// How far the wheels have come, left and right \[m\].
    pub(crate) fn ways_m(&self) -> (f64, f64) {
        (self.way_m[0], self.way_m[1])
    }

    /// Sends by new sockets: the old ones have an error to tell when their interface was down.
    pub(crate) fn reconnect(&mut self, left: &Interface, right: &Interface) {
        self.senders = [left.sender(), right.sender()];
    }

    /// Turns the wheels by so many encoder ticks a frame, for `count` frames.
    pub(crate) fn turn(&mut self, ticks: [i32; 2], count: u32) {
        for _ in 0..count {
            self.way_m[0] += METRES_PER_TICK * f64::from(ticks[0]);
            self.way_m[1] += METRES_PER_TICK * f64::from(ticks[1]);
            self.send();
        }
    }

    fn send(&mut self) {
        std::thread::sleep(self.next.saturating_duration_since(Instant::now()));
        for (sender, frame) in self
            .senders
            .iter_mut()
            .zip(self.frames.encode(self.way_m[0], self.way_m[1]))
        {
            sender.send(&frame).unwrap();
        }
        // From the later frame on: where this machine lost time between the two, the next pair would follow at once, which no
        // encoder does.
        self.next = Instant::now() + self.period;
    }
}
