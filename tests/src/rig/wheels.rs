//! A robot that drives straight ahead, and what its encoders say about that.

use coloc_drivers::can::Frame;
use coloc_drivers::encoder::WheelFrames;

/// One tick of the encoders \[m\].
pub const METRES_PER_TICK: f64 = 1e-5;
/// Distance between the wheels \[m\].
pub const TRACK_M: f64 = 0.3;
/// Way of each wheel in one period \[m\]: 0.5 m/s at 50 Hz.
pub const WAY_PER_PERIOD_M: f64 = 0.01;

/// Two encoders and the truth behind them.
#[derive(Clone, Debug)]
pub struct Wheels {
    encoders: WheelFrames,
    /// What each encoder says, left and right \[m\].
    pub said_m: [f64; 2],
    /// How far the robot has come since its first frames, which only say where counting starts \[m\].
    pub way_m: f64,
    /// Factors from the way to what each encoder says.
    pub scale: [f64; 2],
}

impl Wheels {
    pub(super) fn new(first_ticks: u32) -> Self {
        Self {
            encoders: WheelFrames::starting_at(first_ticks, METRES_PER_TICK),
            said_m: [0.0; 2],
            way_m: -WAY_PER_PERIOD_M,
            scale: [1.0; 2],
        }
    }

    /// A period passes: what the encoders send, `[left, right]`.
    pub fn turn(&mut self) -> [Frame; 2] {
        self.roll();
        self.encoders.encode(self.said_m[0], self.said_m[1])
    }

    /// A period passes, and nothing is sent.
    pub fn roll(&mut self) {
        self.way_m += WAY_PER_PERIOD_M;
        for (said_m, scale) in self.said_m.iter_mut().zip(self.scale) {
            *said_m += scale * WAY_PER_PERIOD_M;
        }
    }
}

/// `frame` with its payload changed.
#[must_use]
pub fn altered(frame: &Frame, change: impl FnOnce(&mut Vec<u8>)) -> Frame {
    let mut data = frame.data().to_vec();
    change(&mut data);
    Frame::data_frame(frame.id().unwrap(), &data).unwrap()
}
