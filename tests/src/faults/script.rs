//! What the faults do, a function each.

use coloc_drivers::can::{ErrorClass, Frame};
use coloc_drivers::encoder::{LEFT_ID, RIGHT_ID, encoder_frame};

use super::Count;
use crate::rig::{Rig, altered};

/// What happens before the ticks.
pub struct Script {
    /// Before the first.
    pub begin: fn(&mut Rig),
    /// Before each, with its number.
    pub each: fn(&mut Rig, u32),
    /// After the last, before the first good one.
    pub end: fn(&mut Rig),
}

impl Script {
    pub(super) const NOTHING: Self = Self {
        begin: |_| {},
        each: |_, _| {},
        end: |_| {},
    };

    pub(super) const fn each(each: fn(&mut Rig, u32)) -> Self {
        Self {
            each,
            ..Self::NOTHING
        }
    }
}

/// All is well with the frames.
pub(super) fn drive(rig: &mut Rig, _: u32) {
    let pair = rig.turn();
    rig.send(&pair);
}

pub(super) fn silence(rig: &mut Rig, _: u32) {
    rig.turn();
}

/// What was sent just before stays in the daemon's queue.
pub(super) fn unplug(rig: &mut Rig, tick: u32) {
    if tick == 1 {
        drive(rig, tick);
        rig.switch(false);
    } else {
        silence(rig, tick);
    }
}

pub(super) fn only_right(rig: &mut Rig, _: u32) {
    let [_, right] = rig.turn();
    rig.send(&[right]);
}

fn some(rig: &mut Rig, come: bool) {
    let pair = rig.turn();
    if come {
        rig.send(&pair);
    }
}

pub(super) fn every_other(rig: &mut Rig, tick: u32) {
    some(rig, tick.is_multiple_of(2));
}

pub(super) fn every_fifth(rig: &mut Rig, tick: u32) {
    some(rig, tick.is_multiple_of(5));
}

pub(super) fn every_tenth(rig: &mut Rig, tick: u32) {
    some(rig, tick.is_multiple_of(10));
}

pub(super) fn two_of_ten(rig: &mut Rig, tick: u32) {
    some(rig, (tick - 1) % 10 >= 8);
}

pub(super) fn three_late(rig: &mut Rig, _: u32) {
    let pair = rig.turn();
    rig.late.push_back(pair);
    if rig.late.len() > 3 {
        let arrived = rig.late.pop_front();
        rig.send(arrived.as_ref().map_or(&[], |pair| &pair[..]));
    }
}

pub(super) fn deliver_late(rig: &mut Rig) {
    while let Some(pair) = rig.late.pop_front() {
        rig.send(&pair);
    }
}

pub(super) fn twice(rig: &mut Rig, _: u32) {
    let pair = rig.turn();
    rig.send(&pair);
    rig.send(&pair);
}

pub(super) fn swapped(rig: &mut Rig, tick: u32) {
    let pair = rig.turn();
    if tick.is_multiple_of(2) {
        rig.send(&pair);
        deliver_late(rig);
    } else {
        rig.late.push_back(pair);
    }
}

pub(super) fn hang(rig: &mut Rig, tick: u32) {
    if tick == 1 {
        let last = rig.turn();
        rig.late.push_back(last);
    } else {
        rig.wheels.roll();
    }
    let stuck = rig.late[0];
    rig.send(&stuck);
}

pub(super) fn wrong_checksum(rig: &mut Rig, _: u32) {
    send_altered(rig, |data| data[5] ^= 0xFF);
}

pub(super) fn short(rig: &mut Rig, _: u32) {
    send_altered(rig, |data| data.truncate(4));
}

/// The same bytes in every run: a linear congruential generator's upper half, seeded with the tick.
pub(super) fn garbage(rig: &mut Rig, tick: u32) {
    let mut state = u64::from(tick);
    send_altered(rig, |data| {
        *data = (0..8)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                state.to_be_bytes()[0]
            })
            .collect();
    });
}

fn send_altered(rig: &mut Rig, mut change: impl FnMut(&mut Vec<u8>)) {
    let pair = rig.turn().map(|frame| altered(&frame, &mut change));
    rig.send(&pair);
}

/// The kernel's usual buffer, rather than one for a minute \[bytes\].
pub(super) fn usual_buffer(rig: &mut Rig) {
    rig.limit_socket(106_496);
}

/// More than the kernel keeps for a socket that nobody reads. What it dropped it says with a later frame.
pub(super) fn flood(rig: &mut Rig, tick: u32) {
    let pair = rig.turn();
    for _ in 0..if tick == 1 { 200 } else { 1 } {
        rig.send(&pair);
    }
}

/// Encoders that were switched off and on count from somewhere else.
pub(super) fn jump(rig: &mut Rig) {
    for said_m in &mut rig.wheels.said_m {
        *said_m += 1000.0;
    }
}

pub(super) fn mend_wheels(rig: &mut Rig) {
    rig.wheels.scale = [1.0; 2];
}

/// Far from our counts, and moving: counts that are near by chance are as good as true.
pub(super) fn second_node(rig: &mut Rig, tick: u32) {
    drive(rig, tick);
    let (ticks, alive) = (1_000_000_000 + 500 * tick, (tick % 16).to_le_bytes()[0]);
    rig.send(&[LEFT_ID, RIGHT_ID].map(|id| encoder_frame(id, ticks, alive)));
}

/// Receive overflow, for the class that needs details.
const OVERFLOW: [u8; 8] = [0, 0x01, 0, 0, 0, 0, 0, 0];

pub(super) fn error_frame(rig: &mut Rig, tick: u32) {
    let class = ErrorClass::ALL[tick as usize - 1];
    if !matches!(class, ErrorClass::BusOff | ErrorClass::Restarted) {
        rig.send(&[Frame::error_frame(class.bit(), OVERFLOW)]);
    }
    drive(rig, tick);
}

pub(super) fn error_warning(rig: &mut Rig) {
    controller_says(rig, 0x04);
}

pub(super) fn error_passive(rig: &mut Rig) {
    controller_says(rig, 0x10);
}

pub(super) fn error_active(rig: &mut Rig) {
    controller_says(rig, 0x40);
}

fn controller_says(rig: &mut Rig, problem: u8) {
    let details = [0, problem, 0, 0, 0, 0, 0, 0];
    rig.send(&[Frame::error_frame(ErrorClass::Controller.bit(), details)]);
}

pub(super) fn bus_off(rig: &mut Rig) {
    rig.send(&[Frame::error_frame(ErrorClass::BusOff.bit(), [0; 8])]);
}

pub(super) fn restarted(rig: &mut Rig) {
    rig.send(&[Frame::error_frame(ErrorClass::Restarted.bit(), [0; 8])]);
}

macro_rules! counts {
    ($($name:ident)*) => {
        pub(super) const COUNTERS: [fn(u64) -> Count; 8] = [$($name),*];
        $(
        pub(super) const fn $name(by: u64) -> Count {
            Count { name: stringify!($name), of: |can| can.$name, by, or_more: false }
        }
    )*};
}

counts!(alive_repeats alive_skips checksum_errors malformed implausible error_frames rx_overflows reopens);
