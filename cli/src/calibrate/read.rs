//! From a recording and its configuration to a drive and the robot that is to be found.

use coloc_calibrate::{Base, Coefficients, Drive, Fix, Gyro, Receiver, Robot, State, Way, Wheels};
use coloc_daemon::config::{self, Config};
use coloc_daemon::record::Recording;
use coloc_drivers::encoder::OdometryConfig;
use coloc_estimator::{Measurement, OdometrySample, PositionFix, Stamp};

use super::CalibrateError;
use super::turns::Turns;

/// A receiver that says nothing of a slow error is given one of this part of its σ, which lasts so long, to begin with.
const SLOW_PART: f64 = 0.5;
const SLOW_TIME_S: f64 = 60.0;

/// A drive, and what was believed of the robot. Its gyro reads what the daemon has made of it, and its fixes have the stamps that
/// the daemon gave them: both are as `[gyro]` and `[position]` say already.
#[derive(Clone, Debug)]
pub(super) struct Recorded {
    pub(super) drive: Drive,
    /// As configured: where nothing is said of slow errors there is none.
    pub(super) before: Robot,
    /// Where the search begins.
    pub(super) start: Robot,
    /// Numbers of the receivers on their channel.
    pub(super) sources: Vec<u16>,
    /// Whether what their messages say of lever and slow error differs from the configuration.
    pub(super) says_itself: Vec<bool>,
}

impl Recorded {
    pub(super) fn new(recording: &Recording, config: &Config) -> Result<Self, CalibrateError> {
        if (config.odometry.as_ref()).is_some_and(OdometryConfig::moves_sideways) {
            return Err(CalibrateError::Sideways);
        }
        let all = recording.ticks.iter().flat_map(|tick| &tick.measurements);
        let (mut samples, mut fixes, mut turns) = (Vec::new(), Vec::new(), Vec::new());
        for measurement in all {
            match measurement {
                Measurement::Odometry(sample) => samples.push(*sample),
                Measurement::Fix(fix) => fixes.push(*fix),
                Measurement::Gyro(sample) => turns.push(*sample),
                _ => {}
            }
        }
        let one = samples.first().ok_or(CalibrateError::NoOdometry)?.source;
        samples.retain(|sample| sample.source == one);
        let mut sources: Vec<u16> = fixes.iter().map(|fix| fix.origin.source).collect();
        sources.sort_unstable();
        sources.dedup();
        let wheels = wheels(config);
        let begin = recording.stamp;
        let gyro = config.gyro.settings().filter(|_| !turns.is_empty());
        let turns = gyro.map_or_else(Turns::default, |it| Turns::new(turns, &it, begin));
        let ways = samples.iter().map(|it| {
            let way = way(it, &wheels, config, begin);
            Way {
                gyro: turns.over([way.start_s, way.end_s]),
                ..way
            }
        });
        let said = fixes.iter().filter_map(|fix| {
            Some(Fix {
                receiver: sources.iter().position(|it| *it == fix.origin.source)?,
                stamp_s: seconds(fix.stamp, begin),
                position: fix.position,
            })
        });
        let receivers = sources.iter().map(|it| receiver(&fixes, *it, config));
        let gyro = gyro.map(|it| Gyro {
            scale: 1.0,
            bias_radps: recording.gyro.map_or(it.bias, |[bias, _]| bias),
            per_s: it.noise,
        });
        let before = Robot {
            gyro,
            ..robot(config, wheels, receivers.collect())
        };
        let start = Robot {
            receivers: before.receivers.iter().map(with_slow_error).collect(),
            ..before.clone()
        };
        let says_itself = sources.iter().zip(&before.receivers);
        let says_itself = says_itself.map(|(source, own)| says_itself_of(config, *source, own));
        Ok(Self {
            says_itself: says_itself.collect(),
            drive: Drive::new(ways.collect(), said.collect()),
            before,
            start,
            sources,
        })
    }
}

pub(super) fn seconds(stamp: Stamp, begin: Stamp) -> f64 {
    (stamp - begin).as_seconds()
}

/// Two wheels where a track is configured, a steered car where a wheel base is, else a body. Wheels that skid turn as if they were
/// farther apart.
fn wheels(config: &Config) -> Wheels {
    let odometry = config.odometry.as_ref();
    let axle = odometry.and_then(|it| {
        let wheels = it.wheels.as_ref()?;
        Some(wheels.track_m / wheels.turning_scale)
    });
    let base = odometry.and_then(|it| it.base.as_ref()?.track_m);
    let steered = odometry.and_then(|it| Some(it.bicycle.as_ref()?.wheel_base_m));
    match (axle.or(base), steered) {
        (Some(track_m), _) => Wheels::axle(track_m),
        (None, Some(wheel_base_m)) => Wheels {
            base: Base::Steered,
            ..Wheels::axle(wheel_base_m)
        },
        (None, None) => Wheels {
            base: Base::Body,
            ..Wheels::axle(1.0)
        },
    }
}

fn way(sample: &OdometrySample, wheels: &Wheels, config: &Config, begin: Stamp) -> Way {
    let (start_s, end_s) = (seconds(sample.start, begin), seconds(sample.stamp, begin));
    let [v, _, omega] = sample.motion.velocity();
    let [ahead, turn] = [v, omega].map(|it| it * (end_s - start_s));
    let half = 0.5 * turn * wheels.span_m;
    Way {
        start_s,
        end_s,
        read: match wheels.base {
            Base::Axle => [ahead - half, ahead + half],
            Base::Body => [ahead, turn],
            Base::Steered if ahead.abs() > 0.0 => [ahead, (turn * wheels.span_m / ahead).atan()],
            Base::Steered => [0.0; 2],
        },
        state: if stands(sample, config) {
            State::Standing
        } else {
            State::Rolling
        },
        gyro: None,
    }
}

/// What stands has the noise of what creeps.
fn stands(sample: &OdometrySample, config: &Config) -> bool {
    let still = sample.motion.velocity().iter().all(|it| it.abs() <= 0.0);
    let creep = config.motion.creep_variance();
    let noise = sample.motion.covariance().variances();
    let alike = noise.iter().zip(creep);
    still && alike.into_iter().all(|(a, b)| (a - b).abs() <= 1e-9 * b)
}

/// As its fixes say of themselves.
fn receiver(fixes: &[PositionFix], source: u16, config: &Config) -> Receiver {
    let own: Vec<&PositionFix> = fixes
        .iter()
        .filter(|it| it.origin.source == source)
        .collect();
    let mean = |of: &dyn Fn(&PositionFix) -> f64| {
        let count = f64::from(u32::try_from(own.len()).unwrap_or(u32::MAX));
        own.iter().map(|it| of(it)).sum::<f64>() / count
    };
    let floor = config.fusion.position_floor;
    let own_variance = |it: &PositionFix| {
        let [x, y] = it.covariance.variances();
        0.5 * (x.max(floor[0] * floor[0]) + y.max(floor[1] * floor[1]))
    };
    Receiver {
        sigma_m: mean(&own_variance).sqrt(),
        slow_sigma_m: mean(&|it| it.slow.variance).sqrt(),
        slow_time_s: mean(&|it| it.slow.memory.as_seconds()),
        lever_m: [0, 1].map(|axis: usize| mean(&|it| it.lever[axis])),
        delay_s: 0.0,
    }
}

/// To what a mean of equal numbers may be off.
fn says_itself_of(config: &Config, source: u16, said: &Receiver) -> bool {
    let all = &config.position;
    let own = all.receiver.iter().find(|it| it.source == source);
    let (lever_m, sigma_m) = own.map_or((all.lever_m, all.slow_sigma_m), |it| {
        (it.lever_m, it.slow_sigma_m)
    });
    let differs = |a: f64, b: f64| (a - b).abs() > 1e-6;
    let levers = lever_m.into_iter().zip(said.lever_m);
    differs(sigma_m, said.slow_sigma_m) || levers.into_iter().any(|(a, b)| differs(a, b))
}

fn with_slow_error(receiver: &Receiver) -> Receiver {
    if receiver.slow_sigma_m > 0.0 && receiver.slow_time_s > 0.0 {
        return *receiver;
    }
    Receiver {
        slow_sigma_m: SLOW_PART * receiver.sigma_m,
        slow_time_s: SLOW_TIME_S,
        ..*receiver
    }
}

fn robot(config: &Config, wheels: Wheels, receivers: Vec<Receiver>) -> Robot {
    let motion = &config.motion;
    let period_s = motion.reference_period_s;
    let coefficients = |it: config::Variance| Coefficients {
        per_s: it.per_s + it.a * period_s,
        per_m: it.per_m,
        per_rad: it.per_rad,
        squares: [it.b, it.c].map(|it| it * period_s),
    };
    Robot {
        wheels,
        noise: [motion.forward, motion.sideways, motion.turning].map(coefficients),
        standing: motion.creep_variance().map(|it| it * period_s),
        missing: motion.outage_variance.map(|it| it * period_s),
        gyro: None,
        receivers,
        heading_rad: 0.0,
    }
}
