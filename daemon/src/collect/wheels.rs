//! The wheels: buses drained, frames decoded, velocities with their noise.

use std::os::fd::{AsFd, BorrowedFd};

use coloc_drivers::can::{self, Bus, Filter};
use coloc_drivers::encoder::{FrameReject, OdometryCounters, OdometryDecoder, WheelOdometry};
use coloc_estimator::{Measurement, Motion, OdometryNoise, OdometrySample, Span, Stamp, noise};
use coloc_shm_types::{BusState, CanCounters, Input};
use tracing::warn;

use super::backlog;
use super::list::List;
use crate::account::Account;
use crate::clock::Moment;
use crate::config::{self, Config};
use crate::start::StartError;

/// A tick takes in so many samples at most: 64 ticks' worth at the usual rate.
pub const SAMPLES: usize = 64;

/// The buses and what is made of their frames.
#[derive(Debug)]
pub struct Wheels {
    buses: Vec<Bus>,
    decoder: Option<OdometryDecoder>,
    to_motion: ToMotion,
    /// How many samples were decoded since the last tick.
    samples: usize,
    /// Frames that were read and not decoded yet, with the order in which they were.
    inbox: List<(usize, can::Received)>,
    /// Stamps of the newest sample and of the one before \[ns\]; 0 if there was none.
    newest_ns: [i64; 2],
    /// All steps of the configured clock so far. The decoder lives without them: its intervals span a step unharmed.
    steps: Span,
}

/// A velocity and its noise, in the words of the drive.
#[derive(Copy, Clone, Debug)]
pub(crate) struct ToMotion {
    noise: OdometryNoise,
    holonomic: bool,
}

impl Wheels {
    /// Opens the buses of `[odometry]`; without that section there are none.
    ///
    /// # Errors
    /// A signal that the DBC file does not have, or a bus that cannot be opened.
    pub fn open(config: &Config) -> Result<Self, StartError> {
        let decoder = config
            .odometry
            .as_ref()
            .map(OdometryDecoder::new)
            .transpose()?;
        let odometry = config.odometry.as_ref();
        let specs = odometry
            .map(|odometry| odometry.buses.as_slice())
            .unwrap_or_default();
        let buses = specs.iter().zip(0_u8..).map(|(spec, number)| {
            let ids = decoder
                .iter()
                .flat_map(|decoder| decoder.wanted_ids(number));
            Bus::open(spec, number, Filter::ids(ids))
        });
        let mut buses = buses.collect::<Result<Vec<_>, _>>()?;
        backlog::reserve(&mut buses, specs, decoder.as_ref());
        for (bus, spec) in buses.iter().zip(specs) {
            if let Some(report) = bus.log().filter(|report| !report.is_clean()) {
                warn!("{spec}: {report}");
            }
        }
        Ok(Self {
            inbox: List::with_capacity(can::FRAMES_PER_CALL * buses.len()),
            buses,
            to_motion: ToMotion::new(config),
            decoder,
            samples: 0,
            newest_ns: [0; 2],
            steps: Span::ZERO,
        })
    }

    /// Takes everything off the buses; whether there is anything to decode.
    pub fn drain(&mut self) -> bool {
        drain(&mut self.buses, &mut self.inbox);
        self.has_frames()
    }

    /// Whether there is anything to decode.
    #[must_use]
    pub fn has_frames(&self) -> bool {
        !self.inbox.is_empty()
    }

    /// Decodes what was drained before `moment`.
    pub fn decode(&mut self, moment: &Moment, into: &mut List<Measurement>, account: &mut Account) {
        let Some(decoder) = &mut self.decoder else {
            return;
        };
        for (_, received) in self.inbox.as_slice() {
            let stamp = Stamp::from_nanos(moment.of_frame(received.stamp_ns)) - self.steps;
            let received = can::Received {
                stamp_ns: stamp.as_nanos(),
                ..*received
            };
            match decoder.push(&received) {
                Ok(Some(odometry)) => {
                    let sample = self.to_motion.sample(&odometry, self.steps);
                    self.newest_ns = [sample.stamp.as_nanos(), self.newest_ns[0]];
                    account.valid(Input::Odometry, sample.stamp);
                    // More than fit come only after a stall; counters are cumulative, so the next sample covers them.
                    if self.samples < SAMPLES && into.push(sample.into()) {
                        self.samples += 1;
                    }
                }
                Err(reason) if is_wrong(reason) => account.unreadable(Input::Odometry),
                Ok(None) | Err(_) => {}
            }
        }
        self.inbox.clear();
    }

    /// Looks after the buses.
    pub fn supervise(&mut self, moment: &Moment, account: &mut Account) {
        let Some(decoder) = &self.decoder else {
            return;
        };
        for bus in &mut self.buses {
            bus.supervise(moment.reading.monotonic_ns);
        }
        account.buses(
            worst(&self.buses),
            counters(&self.buses, decoder.counters()),
        );
    }

    /// The buses, to be waited on.
    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.buses.iter().map(AsFd::as_fd)
    }

    /// How many samples there were since the last [`Self::clear`].
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// The samples have been used.
    pub fn clear(&mut self) {
        self.samples = 0;
    }

    /// Stamp of the newest sample up to `stamp` \[ns\]; 0 if there was none. The very newest may have come after the
    /// tick's stamp was read: it is the next tick's.
    #[must_use]
    pub fn newest_frame_ns(&self, stamp: Stamp) -> i64 {
        let [newest, before] = self.newest_ns;
        if newest <= stamp.as_nanos() {
            newest
        } else {
            before
        }
    }

    /// The clock was stepped.
    pub fn shift(&mut self, shift: Span) {
        self.steps = (Stamp::default() + self.steps + shift) - Stamp::default();
        let shifted = |stamp: i64| {
            if stamp == 0 {
                0
            } else {
                stamp.saturating_add(shift.as_nanos())
            }
        };
        self.newest_ns = self.newest_ns.map(shifted);
    }
}

/// Drains several buses as if they were one: a burst on both must not be decoded one bus after the other, or the
/// wheels' counts of different moments would make a pair.
fn drain(buses: &mut [Bus], inbox: &mut List<(usize, can::Received)>) {
    for bus in &mut *buses {
        bus.receive(&mut |received| {
            // There is room for all that the buses hand over in one call each.
            let _ = inbox.push((inbox.as_slice().len(), *received));
        });
    }
    // One bus keeps its order, whatever the clock of the stamps did meanwhile.
    if buses.len() > 1 {
        inbox.sort_by_key(|(position, received)| (received.stamp_ns, *position));
    }
}

impl ToMotion {
    pub(crate) fn new(config: &Config) -> Self {
        let body = config.odometry.iter().find_map(|it| it.body.as_ref());
        Self {
            noise: noise(&config.motion),
            holonomic: body.is_some_and(|body| body.sideways.is_some()),
        }
    }

    fn sample(self, odometry: &WheelOdometry, steps: Span) -> OdometrySample {
        OdometrySample {
            source: 0,
            start: Stamp::from_nanos(odometry.start_ns) + steps,
            stamp: Stamp::from_nanos(odometry.stamp_ns) + steps,
            motion: self.motion(odometry.velocity),
        }
    }

    /// `[v_x, v_y, ω]` with the noise of such a velocity.
    pub(crate) fn motion(self, velocity: [f64; 3]) -> Motion {
        let [v, _, omega] = velocity;
        if self.holonomic {
            self.noise.holonomic(velocity)
        } else {
            self.noise.nonholonomic([v, omega])
        }
    }
}

fn noise(motion: &config::Motion) -> OdometryNoise {
    let variance = |config::Variance { a, b, c }| noise::Variance { a, b, c };
    OdometryNoise {
        forward: variance(motion.forward),
        sideways: variance(motion.sideways),
        turning: variance(motion.turning),
    }
}

/// Whether the sensor is at fault, rather than the order in which its frames came.
fn is_wrong(reason: FrameReject) -> bool {
    match reason {
        FrameReject::Remote
        | FrameReject::Short
        | FrameReject::Checksum
        | FrameReject::Implausible
        | FrameReject::OutOfRange => true,
        FrameReject::Repeated | FrameReject::OutOfOrder | FrameReject::Backward => false,
    }
}

fn worst(buses: &[Bus]) -> BusState {
    buses
        .iter()
        .map(|bus| state(bus.health().state))
        .max()
        .unwrap_or_default()
}

fn state(state: can::BusState) -> BusState {
    match state {
        can::BusState::Up => BusState::Active,
        can::BusState::ErrorWarning => BusState::Warning,
        can::BusState::ErrorPassive => BusState::Passive,
        can::BusState::BusOff => BusState::Off,
        can::BusState::Down
        | can::BusState::Gone
        | can::BusState::Closed
        | can::BusState::Ended => BusState::Down,
    }
}

fn counters(buses: &[Bus], decoded: &OdometryCounters) -> CanCounters {
    let sum = |count: fn(&can::BusCounters) -> u64| {
        buses
            .iter()
            .map(|bus| count(&bus.health().counters))
            .sum::<u64>()
    };
    let wrong = [
        FrameReject::Remote,
        FrameReject::Short,
        FrameReject::Implausible,
        FrameReject::OutOfRange,
    ];
    CanCounters {
        frames: decoded.accepted + decoded.rejected.iter().sum::<u64>(),
        error_frames: sum(|counters| counters.error_frames),
        checksum_errors: decoded.of(FrameReject::Checksum),
        malformed: sum(|counters| counters.malformed)
            + wrong.map(|reason| decoded.of(reason)).iter().sum::<u64>(),
        alive_skips: decoded.skipped,
        alive_repeats: decoded.of(FrameReject::Repeated),
        rx_overflows: sum(|counters| counters.receive_drops + counters.controller_overflows),
        reopens: sum(|counters| counters.reopened),
    }
}

#[cfg(test)]
mod tests {
    use coloc_drivers::can::{BusSpec, Sender};
    use coloc_drivers::encoder::WheelFrames;

    use super::*;

    #[test]
    fn a_burst_on_two_buses_is_read_in_the_order_in_which_it_came() {
        let directory = tempfile::tempdir().unwrap();
        let specs = ["left", "right"].map(|side| BusSpec::Local {
            directory: directory.path().join(side),
        });
        let [left, right] = &specs;
        let mut buses: Vec<Bus> = specs
            .iter()
            .zip(0_u8..)
            .map(|(spec, number)| Bus::open(spec, number, Filter::All).unwrap())
            .collect();
        let mut senders = [left, right].map(|spec| Sender::open(spec).unwrap());
        let mut wheels = WheelFrames::new(1e-4);
        for turn in 0..5 {
            let frames = wheels.encode(0.01 * f64::from(turn), 0.02 * f64::from(turn));
            for (sender, frame) in senders.iter_mut().zip(frames) {
                sender.send(&frame).unwrap();
            }
        }
        let mut inbox = List::with_capacity(2 * can::FRAMES_PER_CALL);
        drain(&mut buses, &mut inbox);
        let seen: Vec<u8> = inbox
            .as_slice()
            .iter()
            .map(|(_, received)| received.bus)
            .collect();
        assert_eq!(seen, [0, 1, 0, 1, 0, 1, 0, 1, 0, 1]);
    }
}
