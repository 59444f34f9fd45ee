//! The wheels: buses drained, frames decoded, velocities with their noise.

use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;

use coloc_drivers::can::{self, Bus, Filter};
use coloc_drivers::encoder::{FrameReject, OdometryCounters, OdometryDecoder, WheelOdometry};
use coloc_estimator::{
    Measurement, Motion, OdometryNoise, OdometrySample, Span, Stamp, TickInputs, noise,
};
use coloc_shm_types::{BusState, CanCounters, Input};
use tracing::warn;

use super::backlog;
use super::frames::Frames;
use super::list::List;
use crate::account::Account;
use crate::clock::{Moment, TimeSource};
use crate::config::{self, Config};
use crate::event::Link;
use crate::start::StartError;

/// The estimator takes so many samples at once: 64 ticks' worth at the usual rate. If there are more, it takes the next
/// ones in another step, before the tick's own.
pub const SAMPLES: usize = 64;

/// The buses and what is made of their frames.
#[derive(Debug)]
pub struct Wheels {
    buses: Vec<Bus>,
    frames: Option<Frames>,
    /// Where it says what it hears.
    link: Arc<Link>,
    to_motion: ToMotion,
    /// Samples that wait for the estimator.
    samples: List<Measurement>,
    /// They wait no longer, or the history might begin after them.
    patience: Span,
    /// There was one since the last tick.
    had_samples: bool,
    /// Stamps of the newest sample and of the one before \[ns\]; 0 if there was none.
    newest_ns: [i64; 2],
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
    pub fn open(config: &Config, link: Arc<Link>) -> Result<Self, StartError> {
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
        let clocks = buses.iter().map(Bus::stamp_clock);
        Ok(Self {
            frames: decoder.map(|decoder| Frames::new(decoder, clocks)),
            buses,
            to_motion: ToMotion::new(config),
            link,
            samples: List::with_capacity(SAMPLES),
            patience: Span::from_nanos(config::nanos(config.history.length_s) / 4),
            had_samples: false,
            newest_ns: [0; 2],
        })
    }

    /// Takes what one call brings off every bus; whether there is anything to decode.
    pub fn drain(&mut self, time: &dyn TimeSource) -> bool {
        let Some(frames) = &mut self.frames else {
            return false;
        };
        for (number, bus) in self.buses.iter_mut().enumerate() {
            if frames.has_room_for(number) {
                let drained = bus.receive(&mut |received| {
                    frames.take(&can::Received {
                        stamp_ns: time.of_kernel(received.stamp_ns),
                        ..*received
                    });
                });
                frames.drained(number, drained.more);
            }
        }
        !frames.is_empty()
    }

    /// Whether the last drain left nothing behind.
    #[must_use]
    pub fn emptied(&self) -> bool {
        self.frames.as_ref().is_none_or(Frames::emptied)
    }

    /// Whether there is anything to decode.
    #[must_use]
    pub fn has_frames(&self) -> bool {
        self.frames
            .as_ref()
            .is_some_and(|frames| !frames.is_empty())
    }

    /// Decodes what was drained before `moment`; whether all that waits now can wait for the tick.
    pub fn decode(&mut self, moment: &Moment, account: &mut Account) -> bool {
        let Some(frames) = &mut self.frames else {
            return true;
        };
        while !self.samples.is_full() && !spans_more_than(self.patience, &self.samples) {
            match frames.next(moment) {
                None => return !self.are_old(moment.stamp),
                Some(Ok(Some(odometry))) => {
                    let sample = self.to_motion.sample(&odometry);
                    self.newest_ns = [sample.stamp.as_nanos(), self.newest_ns[0]];
                    account.valid(Input::Odometry, sample.source, sample.stamp);
                    self.had_samples |= self.samples.push(sample.into());
                }
                Some(Err(reason)) if is_wrong(reason) => account.undecodable(Input::Odometry),
                Some(Ok(None) | Err(_)) => {}
            }
        }
        false
    }

    /// Looks after the buses.
    pub fn supervise(&mut self, moment: &Moment, account: &mut Account) {
        let Some(frames) = &self.frames else {
            return;
        };
        for bus in &mut self.buses {
            bus.supervise(moment.stamp.as_nanos());
        }
        self.link.hearing.note(&self.buses, frames.decoder());
        account.buses(
            worst(&self.buses),
            counters(&self.buses, frames.decoder().counters()),
        );
    }

    /// The buses, to be waited on.
    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.buses.iter().map(AsFd::as_fd)
    }

    fn are_old(&self, now: Stamp) -> bool {
        let oldest = self.samples.as_slice().first();
        oldest.is_some_and(|oldest| now - oldest.stamp() > self.patience)
    }

    /// How many samples wait for the estimator.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples.as_slice().len()
    }

    /// Whether there was a sample since the last tick.
    #[must_use]
    pub fn had_samples(&self) -> bool {
        self.had_samples
    }

    /// The samples that wait, as inputs up to the newest of them; `None` if there are none.
    #[must_use]
    pub fn way(&self) -> Option<TickInputs<'_>> {
        let measurements = self.samples.as_slice();
        Some(TickInputs {
            stamp: measurements.last()?.stamp(),
            measurements,
        })
    }

    /// Puts the samples that wait into a list that has room for [`SAMPLES`]; how many there are.
    pub fn gather(&mut self, into: &mut List<Measurement>) -> usize {
        let samples = self.samples();
        for sample in self.samples.as_slice() {
            let _ = into.push(*sample);
        }
        self.taken();
        samples
    }

    /// The estimator has taken the samples.
    pub fn taken(&mut self) {
        self.samples.clear();
    }

    /// The tick is over.
    pub fn clear(&mut self) {
        self.had_samples = false;
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
}

/// From the first sample to the last.
fn spans_more_than(limit: Span, samples: &List<Measurement>) -> bool {
    match samples.as_slice() {
        [first, .., last] => last.stamp() - first.stamp() > limit,
        _ => false,
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

    fn sample(self, odometry: &WheelOdometry) -> OdometrySample {
        OdometrySample {
            source: 0,
            start: Stamp::from_nanos(odometry.start_ns),
            stamp: Stamp::from_nanos(odometry.stamp_ns),
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
    let of =
        |reasons: [FrameReject; 2]| reasons.map(|reason| decoded.of(reason)).iter().sum::<u64>();
    CanCounters {
        frames: decoded.accepted + decoded.rejected.iter().sum::<u64>(),
        samples: decoded.samples,
        error_frames: sum(|counters| counters.error_frames),
        checksum_errors: decoded.of(FrameReject::Checksum),
        malformed: sum(|counters| counters.malformed)
            + of([FrameReject::Remote, FrameReject::Short]),
        out_of_range: decoded.of(FrameReject::OutOfRange),
        implausible: decoded.of(FrameReject::Implausible),
        alive_skips: decoded.skipped,
        alive_repeats: decoded.of(FrameReject::Repeated),
        out_of_order: of([FrameReject::OutOfOrder, FrameReject::Backward]),
        rx_overflows: sum(|counters| counters.receive_drops + counters.controller_overflows),
        reopens: sum(|counters| counters.reopened),
        resynchronised: decoded.resynchronised,
        ambiguous: decoded.ambiguous,
        other_wraps: decoded.other_wraps,
        late_ways: decoded.late_ways,
        gaps: decoded.gaps,
        spare: [0; 7],
    }
}
