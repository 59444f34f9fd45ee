//! coloc's own encoder frames: what a simulator sends.

use crate::can::{Frame, StandardId};

use super::guard::checksum;

/// Identifier of the left wheel's message, `WheelLeft` in `coloc.dbc`.
pub const LEFT_ID: StandardId = standard(0x100);
/// Identifier of the right wheel's message, `WheelRight` in `coloc.dbc`.
pub const RIGHT_ID: StandardId = standard(0x101);

/// Encodes the way of two wheels as frames.
///
/// | byte | content |
/// | --- | --- |
/// | 0–3 | ticks since the start, `u32` little-endian, wraps |
/// | 4 | alive counter 0–15 in the low nibble |
/// | 5 | CRC-8 SAE J1850 over the identifier (two bytes, low byte first) and bytes 0–4 |
#[derive(Clone, Debug)]
pub struct WheelFrames {
    metres_per_tick: f64,
    first_ticks: u32,
    alive: u8,
}

impl WheelFrames {
    /// Encoders that start at zero ticks, `metres_per_tick` apart \[m\].
    #[must_use]
    pub fn new(metres_per_tick: f64) -> Self {
        Self::starting_at(0, metres_per_tick)
    }

    /// Encoders that start at `first_ticks`, as after a long run.
    #[must_use]
    pub fn starting_at(first_ticks: u32, metres_per_tick: f64) -> Self {
        Self {
            metres_per_tick,
            first_ticks,
            alive: 0,
        }
    }

    /// The frames `[left, right]` for wheels that have come `left_m` and `right_m` since the start \[m\].
    pub fn encode(&mut self, left_m: f64, right_m: f64) -> [Frame; 2] {
        let frames = [self.frame(LEFT_ID, left_m), self.frame(RIGHT_ID, right_m)];
        self.alive = (self.alive + 1) & 0x0F;
        frames
    }

    fn frame(&self, id: StandardId, way_m: f64) -> Frame {
        encoder_frame(
            id,
            self.first_ticks.wrapping_add(self.ticks(way_m)),
            self.alive,
        )
    }

    /// Whole ticks, wrapped to 32 bits.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "wrapping is what the counter does"
    )]
    fn ticks(&self, way_m: f64) -> u32 {
        (way_m / self.metres_per_tick).round() as i64 as u32
    }
}

/// One encoder frame, as it stands on the bus.
#[must_use]
pub fn encoder_frame(id: StandardId, ticks: u32, alive: u8) -> Frame {
    let [a, b, c, d] = ticks.to_le_bytes();
    let covered = [a, b, c, d, alive & 0x0F];
    let payload = [a, b, c, d, alive & 0x0F, checksum(id.into(), &covered)];
    Frame::classic(id.into(), payload)
}

const fn standard(id: u16) -> StandardId {
    match StandardId::new(id) {
        Some(id) => id,
        None => StandardId::MAX,
    }
}
