//! The wheels: buses drained, frames decoded, velocities with their noise.

use std::f64::consts::{PI, TAU};
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;

use coloc_drivers::can::{self, Bus, Filter};
use coloc_drivers::encoder::{
    FrameReject, GyroDecoder, OdometryConfig, OdometryCounters, OdometryDecoder, Rest,
    WheelOdometry,
};
use coloc_estimator::{Covariance3, Motion, OdometryNoise, OdometrySample, Span, Stamp};
use coloc_shm_types::{BusState, CanCounters, Input};
use tracing::warn;

use super::backlog;
use super::base::Base;
use super::drives::Drives;
use super::frames::Frames;
use super::way::{Via, Way};
use crate::account::Account;
use crate::clock::{Moment, TimeSource};
use crate::config::{Config, StandsBy};
use crate::event::Link;
use crate::start::StartError;

/// The buses and what is made of their frames.
#[derive(Debug)]
pub struct Wheels {
    buses: Vec<Bus>,
    frames: Option<Frames>,
    drives: Option<Drives>,
    /// Where it says what it hears.
    link: Arc<Link>,
    to_motion: ToMotion,
}

/// A velocity and its noise, in the words of the drive.
#[derive(Copy, Clone, Debug)]
pub struct ToMotion {
    noise: OdometryNoise,
    holonomic: bool,
    stands_by: StandsBy,
    /// Of a robot that stands.
    creep: Motion,
    reference_period_s: f64,
}

impl Wheels {
    /// Opens the buses of `[odometry]`; without that section there are none.
    ///
    /// # Errors
    /// A signal that the DBC file does not have, or a bus that cannot be opened.
    pub fn open(config: &Config, link: Arc<Link>) -> Result<Self, StartError> {
        let odometry = config.odometry.as_ref().filter(|it| it.is_on_can());
        let decoder = odometry.map(OdometryDecoder::new).transpose()?;
        let gyro = odometry.zip(config.gyro.on_can());
        let gyro = gyro.map(|(odometry, signal)| GyroDecoder::of(odometry, signal));
        let gyro = gyro.transpose()?;
        let specs = odometry
            .map(|odometry| odometry.buses.as_slice())
            .unwrap_or_default();
        let drives = Drives::open(config)?;
        let buses = specs.iter().zip(0_u8..).map(|(spec, number)| {
            let ids = decoder
                .iter()
                .flat_map(|decoder| decoder.wanted_ids(number));
            let turn = gyro.iter().filter_map(|gyro| gyro.wanted_id(number));
            let filter = Filter::ids(ids.chain(turn));
            let filter = match &drives {
                Some(drives) => drives.widen(number, filter),
                None => filter,
            };
            Bus::open(spec, number, filter)
        });
        let mut buses = buses.collect::<Result<Vec<_>, _>>()?;
        Bus::play_together(&mut buses);
        backlog::reserve(&mut buses, specs, decoder.as_ref());
        for (bus, spec) in buses.iter().zip(specs) {
            if let Some(report) = bus.log().filter(|report| !report.is_clean()) {
                warn!("{spec}: {report}");
            }
        }
        let clocks = buses.iter().map(Bus::stamp_clock);
        Ok(Self {
            frames: decoder.map(|decoder| Frames::new(decoder, clocks).with_gyro(gyro)),
            buses,
            drives,
            to_motion: ToMotion::new(config),
            link,
        })
    }

    /// Takes what one call brings off every bus; whether there is anything to decode.
    pub fn drain(&mut self, time: &dyn TimeSource) -> bool {
        let Some(frames) = &mut self.frames else {
            return false;
        };
        for (number, bus) in self.buses.iter_mut().enumerate() {
            if frames.has_room_for(number) {
                let drives = &mut self.drives;
                let drained = bus.receive(&mut |received| {
                    if drives.as_mut().is_some_and(|it| it.hear(received)) {
                        return;
                    }
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

    /// When the last frame came \[ns of the inner clock\].
    #[must_use]
    pub fn newest_ns(&self) -> i64 {
        self.frames.as_ref().map_or(i64::MIN, Frames::newest_ns)
    }

    /// Decodes what was drained before `moment`, as far as `way` has room; whether that is all.
    pub fn decode(&mut self, moment: &Moment, way: &mut Way, account: &mut Account) -> bool {
        let Some(frames) = &mut self.frames else {
            return true;
        };
        while way.has_room() {
            let made = frames.next(moment);
            match frames.turn() {
                Some(Ok(reading)) => way.turn(&reading, account),
                Some(Err(reason)) if is_wrong(reason) => account.undecodable(Input::Gyro),
                Some(Err(_)) | None => {}
            }
            match made {
                None => return true,
                Some(Ok(Some(odometry))) => {
                    way.push(self.to_motion.sample(0, &odometry), Via::Bus, account);
                }
                Some(Err(reason)) if is_wrong(reason) => account.undecodable(Input::Odometry),
                Some(Ok(None) | Err(_)) => {}
            }
        }
        false
    }

    /// Looks after the buses, and tells what is heard of them and of a `base` beside them.
    pub(super) fn supervise(
        &mut self,
        moment: &Moment,
        base: Option<&Base>,
        account: &mut Account,
    ) {
        for bus in &mut self.buses {
            bus.supervise(moment.stamp.as_nanos());
        }
        if let Some(drives) = &mut self.drives {
            drives.look(moment.stamp.as_nanos(), account);
        }
        let decoder = self.frames.as_ref().map(Frames::decoder);
        let own = decoder.map(OdometryDecoder::counters);
        let Some(counted) = sum(own, base.map(Base::counters)) else {
            return;
        };
        let hearing = &self.link.hearing;
        hearing.note(&counted);
        if let Some(base) = base {
            hearing.note_base(base.heard());
        }
        if let Some(decoder) = decoder {
            hearing.note_buses(&self.buses, decoder);
            let alone = base.is_none_or(|base| base.deaf().is_some());
            account.buses(worst(&self.buses), alone);
            account.slip(decoder.slip());
        }
        let [boot_ups, nodes_missing] = self.drives.as_ref().map_or([0; 2], Drives::counts);
        account.odometry(CanCounters {
            slips: decoder.map_or(0, OdometryDecoder::slips),
            boot_ups,
            nodes_missing,
            slipping: u64::from(decoder.is_some_and(|it| it.slip().is_some())),
            ..counters(&self.buses, &counted)
        });
    }

    /// The buses, to be waited on.
    pub fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.buses.iter().map(AsFd::as_fd)
    }
}

impl ToMotion {
    /// As `[motion]` and `[odometry]` say.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            noise: config.motion.noise(),
            stands_by: config.motion.stands_by,
            creep: Motion::standstill(config.motion.creep_variance()),
            holonomic: (config.odometry.as_ref()).is_some_and(OdometryConfig::moves_sideways),
            reference_period_s: config.motion.reference_period_s,
        }
    }

    /// With the noise that is configured.
    #[must_use]
    pub fn sample(self, source: u16, odometry: &WheelOdometry) -> OdometrySample {
        OdometrySample {
            source,
            start: Stamp::from_nanos(odometry.start_ns),
            stamp: Stamp::from_nanos(odometry.stamp_ns),
            motion: self
                .standing(odometry.rest)
                .unwrap_or_else(|| self.moving(odometry)),
        }
    }

    /// With what the kinematics add to the noise, which is that of the sample: the history takes noise as that of the reference
    /// period, and scales it back by the time that passed.
    pub(crate) fn moving(self, odometry: &WheelOdometry) -> Motion {
        let motion = self.motion(odometry.velocity);
        let [[xx, xy, xp], [_, yy, yp], [_, _, pp]] = odometry.spread;
        if xx == 0.0 && yy == 0.0 && pp == 0.0 {
            return motion;
        }
        let spread = Covariance3::from_row_major([xx, xy, xp, xy, yy, yp, xp, yp, pp]);
        // Three times its diagonal is larger than any covariance; what has no such diagonal is no number, and not believed.
        let spread = spread
            .or_else(|_| Covariance3::diagonal([xx, yy, pp].map(|it| 3.0 * it)))
            .unwrap_or_default();
        let ns = odometry.stamp_ns.saturating_sub(odometry.start_ns);
        let span_s = Span::from_nanos(ns).as_seconds();
        let moving = motion.with_noise_added(&spread.scaled(span_s / self.reference_period_s));
        without_whole_turns(moving, span_s)
    }

    /// The same where nobody knows in advance whether a robot moves sideways.
    pub(super) fn of_base(self, odometry: &WheelOdometry) -> Motion {
        let [_, sideways, _] = odometry.velocity;
        let holonomic = self.holonomic || sideways != 0.0;
        let moving = Self { holonomic, ..self };
        self.standing(odometry.rest)
            .unwrap_or_else(|| moving.moving(odometry))
    }

    /// Zero velocity with its allowance for creep, if that was measured.
    pub(crate) fn standing(&self, rest: Rest) -> Option<Motion> {
        let stands = match self.stands_by {
            StandsBy::Counts => rest == Rest::Counts,
            StandsBy::Speeds => rest != Rest::Moving,
            StandsBy::Nothing => false,
        };
        stands.then_some(self.creep)
    }

    /// `[v_x, v_y, ω]` with the noise of such a velocity.
    pub(crate) fn motion(self, velocity: [f64; 3]) -> Motion {
        let [v, sideways, omega] = velocity;
        if self.holonomic {
            return self.noise.holonomic(velocity);
        }
        let motion = self.noise.nonholonomic([v, omega]);
        if sideways == 0.0 {
            return motion;
        }
        // Of a car that is just being steered: it does not slip more for it.
        Motion::Holonomic {
            velocity,
            noise: motion.covariance(),
        }
    }
}

/// After a long silence: an arc that closes shows nothing of the spread of what is held along it.
fn without_whole_turns(motion: Motion, span_s: f64) -> Motion {
    match motion {
        Motion::Holonomic {
            velocity: [vx, vy, omega],
            noise,
        } if (omega * span_s).abs() > PI => {
            let turns = (omega * span_s / TAU).round();
            Motion::Holonomic {
                velocity: [vx, vy, omega - turns * TAU / span_s],
                noise,
            }
        }
        motion => motion,
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

/// What was counted of frames and of a base.
fn sum(
    one: Option<&OdometryCounters>,
    other: Option<&OdometryCounters>,
) -> Option<OdometryCounters> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.plus(other)),
        (one, other) => one.or(other).copied(),
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
        ..CanCounters::default()
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these results are exact")]
mod tests {
    use std::path::Path;

    use super::*;

    const ALL: [Rest; 3] = [Rest::Moving, Rest::Speeds, Rest::Counts];

    fn to_motion(lines: &str) -> ToMotion {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n[motion]\n{lines}");
        ToMotion::new(&Config::parse(&text, Path::new("a.toml")).unwrap())
    }

    #[test]
    fn standing_is_what_the_configuration_takes_for_it() {
        let stands = |lines| ALL.map(|rest| to_motion(lines).standing(rest).is_some());
        assert_eq!(stands(""), [false, false, true]);
        assert_eq!(stands("stands_by = \"speeds\""), [false, true, true]);
        assert_eq!(stands("stands_by = \"nothing\""), [false; 3]);
        assert_eq!(stands("preset = \"paper\""), [false; 3]);
    }

    /// In an hour of white noise a third of what was stated.
    #[test]
    fn what_stands_creeps_as_stated() {
        let to_motion = to_motion("creep_per_hour = [0.3, 0.6, 0.9]\nreference_period_s = 0.1");
        let creep = to_motion.standing(Rest::Counts).expect("it stands");
        assert_eq!(creep.velocity(), [0.0; 3]);
        let in_an_hour = creep.covariance().variances().map(|it| it * 0.1 * 3600.0);
        for (variance, sigma) in in_an_hour.into_iter().zip([0.1_f64, 0.2, 0.3]) {
            assert!(
                (variance - sigma * sigma).abs() < 1e-12,
                "{variance} {sigma}"
            );
        }
    }
}
