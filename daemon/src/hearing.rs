//! What the real-time thread hears of the wheels, for the telemetry thread to look at whenever it likes.
//!
//! Counters that only grow: the one thread stores, the other loads, and neither waits. Numbers of one tick may be read
//! beside those of the next.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use coloc_drivers::can::{Bus, BusState};
use coloc_drivers::encoder::{FrameReject, MAX_CHANNELS, OdometryCounters, OdometryDecoder};

const REASONS: usize = FrameReject::ALL.len();

/// As many as a configuration can have.
const BUSES: usize = 256;

/// The place where it is stored.
#[derive(Debug)]
pub struct Hearing {
    samples: AtomicU64,
    heard: [AtomicU64; MAX_CHANNELS],
    refused: [AtomicU64; REASONS],
    unsure: AtomicU64,
    base: [AtomicU64; 2],
    states: [AtomicU8; BUSES],
}

/// What is stored there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reception {
    /// Samples of odometry.
    pub samples: u64,
    /// Frames of each wanted message, in the order of [`coloc_drivers::encoder::Description::expected`].
    pub heard: [u64; MAX_CHANNELS],
    /// Frames that did not count, by reason.
    pub refused: [u64; REASONS],
    /// Times that frames were too far apart to tell how far a counter went.
    pub unsure: u64,
    /// Messages of a base, and those of them that were refused.
    pub base: [u64; 2],
}

impl Hearing {
    /// Nothing yet.
    #[must_use]
    pub fn new() -> Self {
        let counter = |_| AtomicU64::new(0);
        Self {
            samples: AtomicU64::new(0),
            heard: std::array::from_fn(counter),
            refused: std::array::from_fn(counter),
            unsure: AtomicU64::new(0),
            base: [AtomicU64::new(0), AtomicU64::new(0)],
            states: std::array::from_fn(|_| AtomicU8::new(BusState::Up as u8)),
        }
    }

    /// What was counted of odometry, wherever it came from, as it is at this tick; from the real-time thread alone, like the others.
    pub fn note(&self, counters: &OdometryCounters) {
        store(&self.samples, counters.samples);
        store(&self.unsure, counters.ambiguous + counters.gaps);
    }

    /// The buses, and the frames that came over them.
    pub fn note_buses(&self, buses: &[Bus], decoder: &OdometryDecoder) {
        for (place, count) in self.heard.iter().zip(decoder.heard()) {
            store(place, count);
        }
        for (place, count) in self.refused.iter().zip(decoder.counters().rejected) {
            store(place, count);
        }
        for (place, bus) in self.states.iter().zip(buses) {
            place.store(bus.health().state as u8, Ordering::Relaxed);
        }
    }

    /// Messages of a base on the channel `odometry`, and those of them that were refused.
    pub fn note_base(&self, messages: [u64; 2]) {
        for (place, count) in self.base.iter().zip(messages) {
            store(place, count);
        }
    }

    /// As it was at a tick that was not long ago.
    #[must_use]
    pub fn reception(&self) -> Reception {
        Reception {
            samples: load(&self.samples),
            heard: self.heard.each_ref().map(load),
            refused: self.refused.each_ref().map(load),
            unsure: load(&self.unsure),
            base: self.base.each_ref().map(load),
        }
    }

    /// How a bus is doing.
    #[must_use]
    pub fn state(&self, bus: usize) -> BusState {
        let byte = self.states.get(bus).map(|it| it.load(Ordering::Relaxed));
        let is_it = |state: &BusState| Some(*state as u8) == byte;
        BusState::ALL
            .into_iter()
            .find(is_it)
            .unwrap_or(BusState::Up)
    }
}

impl Default for Hearing {
    fn default() -> Self {
        Self::new()
    }
}

impl Reception {
    /// What has come since `before`.
    #[must_use]
    pub fn since(&self, before: &Self) -> Self {
        let difference = |(now, before): (&u64, &u64)| now.saturating_sub(*before);
        let mut since = self.clone();
        since.samples = difference((&self.samples, &before.samples));
        since.unsure = difference((&self.unsure, &before.unsure));
        for (to, pair) in since
            .base
            .iter_mut()
            .zip(self.base.iter().zip(&before.base))
        {
            *to = difference(pair);
        }
        for (to, pair) in since
            .heard
            .iter_mut()
            .zip(self.heard.iter().zip(&before.heard))
        {
            *to = difference(pair);
        }
        for (to, pair) in since
            .refused
            .iter_mut()
            .zip(self.refused.iter().zip(&before.refused))
        {
            *to = difference(pair);
        }
        since
    }
}

fn store(place: &AtomicU64, count: u64) {
    place.store(count, Ordering::Relaxed);
}

fn load(place: &AtomicU64) -> u64 {
    place.load(Ordering::Relaxed)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_drivers::can::{BusSpec, Filter, Frame, Received, StandardId};
    use coloc_drivers::encoder::{OdometryConfig, WheelFrames};

    use super::*;

    fn received(frame: Frame, ms: i64) -> Received {
        Received {
            frame,
            stamp_ns: ms * 1_000_000,
            bus: 0,
        }
    }

    #[test]
    fn what_is_stored_is_what_was_counted() {
        let directory = tempfile::tempdir().unwrap();
        let open = |directory: &Path, number| {
            let spec = BusSpec::Local {
                directory: directory.into(),
            };
            Bus::open(&spec, number, Filter::All).unwrap()
        };
        let here = open(directory.path(), 0);
        let config = OdometryConfig::differential("local:/x".parse().unwrap(), 0.3, 1e-4, 2.0);
        let mut decoder = OdometryDecoder::new(&config).unwrap();
        let hearing = Hearing::new();
        hearing.note(decoder.counters());
        hearing.note_buses(std::slice::from_ref(&here), &decoder);
        let before = hearing.reception();
        let mut wheels = WheelFrames::new(1e-4);
        for turn in 0..3_i32 {
            for frame in wheels.encode(0.01 * f64::from(turn), 0.0) {
                decoder
                    .push(&received(frame, 20 * i64::from(turn)))
                    .unwrap();
            }
        }
        let garbled = Frame::data_frame(StandardId::new(0x101).unwrap(), &[0; 6]).unwrap();
        decoder.push(&received(garbled, 60)).unwrap_err();
        hearing.note(decoder.counters());
        hearing.note_buses(&[here], &decoder);
        let since = hearing.reception().since(&before);
        assert_eq!(
            (since.samples, since.heard, since.unsure),
            (2, [3, 4, 0, 0], 0)
        );
        assert_eq!(since.refused[FrameReject::Checksum as usize], 1);
        assert_eq!(since.refused.iter().sum::<u64>(), 1);
        assert_eq!(hearing.state(0), BusState::Up);
    }
}
