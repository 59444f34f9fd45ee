//! Two wheels that turn as they like, and what their encoders say.

use coloc_drivers::can::{BusSpec, Frame};
use coloc_drivers::encoder::{OdometryConfig, WheelFrames};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// One tick of the encoders \[m\].
const METRES_PER_TICK: f64 = 1e-4;
/// Distance between the wheels \[m\].
pub(super) const TRACK_M: f64 = 0.5;
/// No wheel is faster \[m/s\].
pub(super) const MAX_SPEED_MPS: f64 = 2.0;
/// They stay below that, so that rounding to whole ticks does not go beyond it.
const SPEED_MPS: f64 = 1.7;

pub(super) fn config() -> OdometryConfig {
    let bus = BusSpec::Local {
        directory: "nowhere".into(),
    };
    OdometryConfig::differential(bus, TRACK_M, METRES_PER_TICK, MAX_SPEED_MPS)
}

/// The wheels.
#[derive(Debug)]
pub(super) struct Encoders {
    frames: WheelFrames,
    speeds_mps: [f64; 2],
    /// Since the start, in whole ticks of the encoders.
    ticks: [f64; 2],
    fraction: [f64; 2],
}

impl Encoders {
    pub(super) fn new(random: &mut ChaCha8Rng) -> Self {
        Self {
            frames: WheelFrames::starting_at(random.random(), METRES_PER_TICK),
            speeds_mps: [0.0; 2],
            ticks: [0.0; 2],
            fraction: [0.0; 2],
        }
    }

    /// Now and then the speeds change.
    pub(super) fn drive(&mut self, random: &mut ChaCha8Rng) {
        if random.random_bool(0.05) {
            self.speeds_mps = [0; 2].map(|_| random.random_range(-SPEED_MPS..SPEED_MPS));
        }
    }

    pub(super) fn stand(&mut self) {
        self.speeds_mps = [0.0; 2];
    }

    /// So much time passes; what they send then, `[left, right]`.
    pub(super) fn turn(&mut self, dt_s: f64) -> [Frame; 2] {
        for wheel in 0..2 {
            let way = self.fraction[wheel] + self.speeds_mps[wheel] * dt_s / METRES_PER_TICK;
            self.ticks[wheel] += way.trunc();
            self.fraction[wheel] = way.fract();
        }
        let [left, right] = self.ways_m();
        self.frames.encode(left, right)
    }

    /// How far they have come \[m\].
    pub(super) fn ways_m(&self) -> [f64; 2] {
        self.ticks.map(|ticks| ticks * METRES_PER_TICK)
    }
}
