//! A base that says on the channel `odometry` how it moves: each of its senders decoded by itself.

use coloc_drivers::encoder::{
    BaseDecoder, BaseReading, FrameReject, OdometryCounters, WheelOdometry,
};
use coloc_estimator::{Covariance2, Covariance3, Motion, OdometrySample, Span, Stamp};
use coloc_shm_types::{Input, Odometry, OdometryKind, Reject, Sessions, Space};

use super::messages::not_a_covariance;
use super::port::Port;
use super::team::Team;
use super::way::{Via, Way};
use super::wheels::ToMotion;
use crate::account::Account;
use crate::clock::Moment;
use crate::config::{Config, nanos};
use crate::start::StartError;

/// A tick takes in so many messages at most, as many as wait of one sender.
const MESSAGES: usize = 256;

/// As many sources as there may be, with as many sessions each as live at once.
const LIVES: usize = 4 * Sessions::SENSORS;

/// The subscriber, and what each sender has said before.
#[derive(Debug)]
pub(super) struct Base {
    port: Port<Odometry>,
    team: Team,
    lives: Vec<Life>,
    /// Of a sender that has said nothing yet.
    unheard: BaseDecoder,
    noise: Noise,
    counters: OdometryCounters,
    /// Messages that came, and those of them that were refused.
    heard: [u64; 2],
    /// Of the last tick: what is newer is of use, however late it comes.
    before: Stamp,
}

/// A session of a source.
#[derive(Debug)]
struct Life {
    key: (u16, u64),
    decoder: BaseDecoder,
}

/// From velocities to motion.
#[derive(Debug)]
struct Noise {
    configured: ToMotion,
    /// Least variances of `[v_x, v_y, ω]`.
    floor: [f64; 3],
    reference: Span,
}

impl Base {
    /// Subscribes, if there is an `[odometry.base]`.
    ///
    /// # Errors
    /// If the port cannot be opened, or a setting is none.
    pub(super) fn open(config: &Config, space: &Space) -> Result<Option<Self>, StartError> {
        let Some((odometry, base)) = config
            .odometry
            .as_ref()
            .and_then(|it| it.base.as_ref().map(|base| (it, base)))
        else {
            return Ok(None);
        };
        let budget = (Input::Odometry, Sessions::SENSORS, MESSAGES);
        Ok(Some(Self {
            port: Port::open(space, &config.robot.name, budget)?,
            team: Team::new(config),
            lives: Vec::with_capacity(LIVES),
            unheard: BaseDecoder::new(odometry)?,
            noise: Noise {
                configured: ToMotion::new(config),
                floor: base.floor.map(|sigma| sigma * sigma),
                reference: Span::from_nanos(nanos(config.motion.reference_period_s)),
            },
            counters: OdometryCounters::default(),
            heard: [0; 2],
            before: Stamp::default(),
        }))
    }

    /// [`Input::Odometry`], if its channel has no place for this robot.
    pub(super) fn deaf(&self) -> Option<Input> {
        self.port.deaf()
    }

    /// Says who speaks on the channel.
    pub(super) fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        self.port.tell_sessions(now, account);
    }

    /// The tick at `now` is over: the next one takes in as many again.
    pub(super) fn clear(&mut self, now: Stamp) {
        self.before = now;
        self.port.clear();
    }

    /// What was counted of samples so far.
    pub(super) fn counters(&self) -> &OdometryCounters {
        &self.counters
    }

    /// Messages that came, and those of them that were refused.
    pub(super) fn heard(&self) -> [u64; 2] {
        self.heard
    }

    /// Takes in what has come until `moment`, as far as `way` has room; whether that is all.
    pub(super) fn decode(&mut self, moment: &Moment, way: &mut Way, account: &mut Account) -> bool {
        while way.has_room() {
            let limits = self.team.limits_since(self.before, moment.stamp);
            let check = |message: &Odometry| {
                message.validate(&limits)?;
                reading(message)
            };
            let Some((message, heard)) = self.port.next(moment, account, check) else {
                return true;
            };
            self.heard[0] += 1;
            let source = message.header.source;
            match heard.and_then(|reading| self.sample(&message, reading)) {
                Ok(Some(sample)) => way.push(sample, Via::Message, account),
                // It says where counting starts, or a part of a longer way.
                Ok(None) => {}
                Err(reason) => {
                    self.heard[1] += 1;
                    self.port.refuse(source, reason, account);
                }
            }
        }
        false
    }

    fn sample(
        &mut self,
        message: &Odometry,
        reading: BaseReading,
    ) -> Result<Option<OdometrySample>, Reject> {
        let Some(odometry) = self.velocity(message, reading)? else {
            return Ok(None);
        };
        let span_s =
            Span::from_nanos(odometry.stamp_ns.saturating_sub(odometry.start_ns)).as_seconds();
        Ok(Some(OdometrySample {
            source: message.header.source,
            start: Stamp::from_nanos(odometry.start_ns),
            stamp: Stamp::from_nanos(odometry.stamp_ns),
            motion: self.noise.motion(message, &odometry, span_s)?,
        }))
    }

    fn velocity(
        &mut self,
        message: &Odometry,
        reading: BaseReading,
    ) -> Result<Option<WheelOdometry>, Reject> {
        let stamp_ns = message.header.stamp_ns;
        let life = life(&mut self.lives, message, &self.unheard);
        let made = match (reading, message.start_ns) {
            (BaseReading::Velocity(velocity), start_ns) if start_ns != 0 => {
                let made = life.map(|it| it.decoder.over(velocity, (start_ns, stamp_ns)));
                self.counters.samples += u64::from(matches!(made, Some(Ok(_))));
                made.map(|made| made.map(Some))
            }
            _ => life.and_then(|it| it.decoder.push(reading, stamp_ns, &mut self.counters)),
        };
        made.ok_or(Reject::NotConfigured)?.map_err(reason)
    }
}

/// That of the sender; who was silent longest gives way.
fn life<'a>(
    lives: &'a mut Vec<Life>,
    message: &Odometry,
    unheard: &BaseDecoder,
) -> Option<&'a mut Life> {
    let key = (message.header.source, message.header.session);
    if let Some(known) = lives.iter().position(|it| it.key == key) {
        return lives.get_mut(known);
    }
    if lives.len() == lives.capacity() {
        let last_ns = |(_, life): &(usize, &Life)| life.decoder.last_ns();
        let (oldest, _) = lives.iter().enumerate().min_by_key(last_ns)?;
        lives.swap_remove(oldest);
    }
    lives.push(Life {
        key,
        decoder: *unheard,
    });
    lives.last_mut()
}

fn reading(message: &Odometry) -> Result<BaseReading, Reject> {
    let [first, second, third, _] = message.values;
    Ok(match message.kind()? {
        OdometryKind::Twist => BaseReading::Velocity([first, second, third]),
        OdometryKind::WheelDistances => BaseReading::Distances([first, second]),
        OdometryKind::WheelCounts => BaseReading::Counts([first, second].map(count)),
    })
}

/// Which it is was checked with the message.
#[expect(clippy::cast_possible_truncation, reason = "whole, and below 2^53")]
fn count(value: f64) -> i64 {
    value as i64
}

fn reason(refused: FrameReject) -> Reject {
    match refused {
        FrameReject::Backward | FrameReject::OutOfOrder | FrameReject::Repeated => {
            Reject::OutOfOrder
        }
        FrameReject::Implausible
        | FrameReject::OutOfRange
        | FrameReject::Remote
        | FrameReject::Short
        | FrameReject::Checksum => Reject::Implausible,
    }
}

impl Noise {
    /// A velocity that was the mean of `span_s` seconds.
    ///
    /// # Errors
    /// Its covariance is none.
    fn motion(
        &self,
        message: &Odometry,
        odometry: &WheelOdometry,
        span_s: f64,
    ) -> Result<Motion, Reject> {
        if message.has_configured_noise() {
            return Ok(self.configured.of_base(odometry));
        }
        // The history takes noise as that of the reference period, and scales it back by the time that passed.
        let factor = span_s / self.reference.as_seconds();
        let velocity @ [vx, vy, omega] = odometry.velocity;
        let [xx, .., pp] = message.covariance;
        let [_, _, xp, _, yy, _, px, ..] = message.covariance;
        let [fx, _, fp] = self.floor;
        if yy == 0.0 && vy == 0.0 {
            let noise = Covariance2::from_row_major([xx, xp, px, pp]).map_err(not_a_covariance)?;
            return Ok(Motion::Nonholonomic {
                velocity: [vx, omega],
                noise: noise.with_floor([fx, fp]).scaled(factor),
            });
        }
        let noise = Covariance3::from_row_major(message.covariance).map_err(not_a_covariance)?;
        Ok(Motion::Holonomic {
            velocity,
            noise: noise.with_floor(self.floor).scaled(factor),
        })
    }
}
