//! Odometry of a base that does not speak CAN: what it says goes the way of frames.

use crate::config_error::ConfigError;

use super::channel::{Channel, Measure};
use super::config::OdometryConfig;
use super::count::Counts;
use super::counter::Counter;
use super::counters::OdometryCounters;
use super::kinematics::{Kinematics, NO_SPREAD};
use super::merge::{MAX_CHANNELS, Merge, WheelOdometry};
use super::plan::positive;
use super::reject::FrameReject;
use super::said::Said;

/// What a base says at one moment.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum BaseReading {
    /// `[v_x, v_y, ω]`: its mean velocity since the reading before \[m/s, m/s, rad/s\].
    Velocity([f64; 3]),
    /// `[left, right]`: how far each wheel has come since some moment \[m\].
    Distances([f64; 2]),
    /// `[left, right]`: what each wheel's counter says; it does not wrap.
    Counts([i64; 2]),
}

/// Makes odometry of one sender's readings: jumps, restarts, late readings and speeds beyond the limit are treated as those of
/// encoders on a bus are. Nothing here allocates.
#[derive(Copy, Clone, Debug)]
pub struct BaseDecoder {
    velocity: Merge,
    distances: Option<Merge>,
    counts: Option<Merge>,
    /// Of the newest reading of any of these.
    last_ns: Option<i64>,
}

/// A distance is counted in these \[m\]: as finely as a double says it, up to nine million kilometres.
const NANOMETRE: f64 = 1e-9;

/// Counters as wide as an integer here can be.
const WIDE: Counts = Counts {
    bits: 64,
    signed: true,
    modulus: None,
    range: None,
};

impl BaseDecoder {
    /// By `[odometry]` and its `base`.
    ///
    /// # Errors
    /// [`ConfigError`], with the setting.
    pub fn new(config: &OdometryConfig) -> Result<Self, ConfigError> {
        let speed = positive("max_speed_mps", config.max_speed_mps)?;
        let turn = positive("max_turn_rate_radps", config.max_turn_rate_radps)?;
        let base = config.base.clone().unwrap_or_default();
        let track_m = checked(base.track_m, "base.track_m")?;
        let [left, right] = [0, 1].map(|wheel| base.metres_per_count.map(|it| it[wheel]));
        let left = checked(left, "base.metres_per_count")?;
        let counts = left.zip(checked(right, "base.metres_per_count")?);
        if counts.is_some() && track_m.is_none() {
            let problem = "is needed for counts of wheels, which base.metres_per_count is for";
            return Err(ConfigError::setting("base.track_m", problem));
        }
        let wheels = |metres| track_m.map(|track_m| axle(config, track_m, metres));
        Ok(Self {
            velocity: body(config, [speed, turn, speed]),
            distances: wheels([NANOMETRE; 2]),
            counts: counts.and_then(|(left, right)| wheels([left, right])),
            last_ns: None,
        })
    }

    /// Takes in what the base said of the moment `stamp_ns`, of a clock that nobody sets. Hands out a sample when that completes
    /// one; the first reading only says where counting starts. `None`, too, if the configuration does not say what is needed to
    /// make anything of it. What happens is added to `counters`.
    ///
    /// # Errors
    /// [`FrameReject`]: it does not count.
    pub fn push(
        &mut self,
        reading: BaseReading,
        stamp_ns: i64,
        counters: &mut OdometryCounters,
    ) -> Option<Result<Option<WheelOdometry>, FrameReject>> {
        let (merge, said) = match reading {
            BaseReading::Velocity(velocity) => (Some(&mut self.velocity), rates(velocity)),
            BaseReading::Distances(metres) => {
                let [left, right] = metres.map(|it| Some(nanometres(it)));
                (self.distances.as_mut(), [left, right, None, None])
            }
            BaseReading::Counts(counts) => {
                let [left, right] = counts.map(|it| Some(Said::Count(it.cast_unsigned())));
                (self.counts.as_mut(), [left, right, None, None])
            }
        };
        let merge = merge?;
        if self.last_ns.is_some_and(|last_ns| stamp_ns < last_ns) {
            return Some(Err(FrameReject::Backward));
        }
        let made = take(merge, said, stamp_ns);
        *counters = counters.plus(&std::mem::take(&mut merge.counters));
        if made.is_ok() {
            self.last_ns = Some(stamp_ns);
        }
        Some(made)
    }

    /// A velocity that says over which interval it is the mean: of those before it only tells for how long it stands.
    ///
    /// # Errors
    /// [`FrameReject::Implausible`]: the robot is never that fast.
    pub fn over(
        &mut self,
        velocity: [f64; 3],
        (start_ns, stamp_ns): (i64, i64),
    ) -> Result<WheelOdometry, FrameReject> {
        self.velocity.check(each(rates(velocity)), stamp_ns)?;
        Ok(WheelOdometry {
            start_ns,
            stamp_ns,
            velocity,
            rest: self.velocity.rest(velocity, start_ns),
            spread: NO_SPREAD,
        })
    }

    /// Stamp of the newest reading that counted.
    #[must_use]
    pub fn last_ns(&self) -> Option<i64> {
        self.last_ns
    }
}

fn checked(value: Option<f64>, setting: &str) -> Result<Option<f64>, ConfigError> {
    value.map(|value| positive(setting, value)).transpose()
}

fn body(config: &OdometryConfig, limits: [f64; 3]) -> Merge {
    let rate = |limit| Measure::Rate {
        scale: 1.0,
        limit,
        longest_s: config.tolerance.longest_rate_s,
    };
    let channels = limits.map(|limit| Channel::new(rate(limit)));
    Merge::new(channels, Kinematics::Body, config.tolerance)
}

fn axle(config: &OdometryConfig, track_m: f64, metres_per_count: [f64; 2]) -> Merge {
    let counter = |metres| Counter::new(WIDE, metres, config.max_speed_mps, &config.tolerance);
    let channels = metres_per_count.map(|metres| Channel::new(Measure::Counter(counter(metres))));
    let kinematics = Kinematics::Axle {
        track_m,
        turning_scale: 1.0,
    };
    Merge::new(channels, kinematics, config.tolerance)
}

/// Beyond what fits it stays at the end, where no way is believed.
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn nanometres(metres: f64) -> Said {
    Said::Count(((metres / NANOMETRE).round() as i64).cast_unsigned())
}

/// In the order of [`Kinematics::Body`].
fn rates([vx, vy, omega]: [f64; 3]) -> [Option<Said>; MAX_CHANNELS] {
    let [forward, turn, sideways] = [vx, omega, vy].map(|it| Some(Said::Rate(it)));
    [forward, turn, sideways, None]
}

fn each(
    said: [Option<Said>; MAX_CHANNELS],
) -> impl Iterator<Item = (usize, Result<Said, FrameReject>)> {
    said.into_iter().flatten().map(Ok).enumerate()
}

fn take(
    merge: &mut Merge,
    said: [Option<Said>; MAX_CHANNELS],
    stamp_ns: i64,
) -> Result<Option<WheelOdometry>, FrameReject> {
    let updates = merge.check(each(said), stamp_ns)?;
    merge.apply(updates, stamp_ns);
    merge.form_sample()
}

#[cfg(test)]
mod tests {
    use super::super::config::BaseConfig;
    use super::super::merge::Rest;
    use super::*;

    const MS: i64 = 1_000_000;

    /// That base alone.
    fn of(base: BaseConfig) -> Result<BaseDecoder, ConfigError> {
        let config = toml::from_str::<OdometryConfig>("max_speed_mps = 2.0").unwrap();
        BaseDecoder::new(&OdometryConfig {
            base: Some(base),
            ..config
        })
    }

    fn decoder() -> BaseDecoder {
        let base = BaseConfig {
            track_m: Some(0.5),
            metres_per_count: Some([1e-3, 2e-3]),
            ..BaseConfig::default()
        };
        of(base).unwrap()
    }

    fn push(decoder: &mut BaseDecoder, reading: BaseReading, ms: i64) -> Option<[f64; 3]> {
        let made = decoder
            .push(reading, ms * MS, &mut OdometryCounters::default())
            .expect("configured");
        made.unwrap().map(|it| it.velocity)
    }

    fn near(velocity: Option<[f64; 3]>, expected: [f64; 3]) -> bool {
        let close = |(a, b): (f64, f64)| (a - b).abs() < 1e-6;
        velocity.is_some_and(|it| it.into_iter().zip(expected).all(close))
    }

    #[test]
    fn distances_and_counts_are_ways_since_the_reading_before() {
        let mut decoder = decoder();
        let distances = |metres| BaseReading::Distances(metres);
        assert_eq!(push(&mut decoder, distances([7.0, -3.0]), 0), None);
        let came = push(&mut decoder, distances([7.01, -2.98]), 20);
        assert!(near(came, [0.75, 0.0, 1.0]), "{came:?}");
        let counts = |counts| BaseReading::Counts(counts);
        assert_eq!(push(&mut decoder, counts([-5, 5]), 20), None);
        let came = push(&mut decoder, counts([5, 15]), 40);
        assert!(near(came, [0.75, 0.0, 1.0]), "{came:?}");
    }

    #[test]
    fn what_was_lost_is_in_the_next_distance() {
        let mut decoder = decoder();
        push(&mut decoder, BaseReading::Distances([0.0; 2]), 0);
        let came = push(&mut decoder, BaseReading::Distances([3.0; 2]), 3000);
        assert!(near(came, [1.0, 0.0, 0.0]), "{came:?}");
    }

    #[test]
    fn a_velocity_is_that_since_the_reading_before_unless_too_long_ago() {
        let mut decoder = decoder();
        let velocity = BaseReading::Velocity([1.0, -0.5, 0.25]);
        assert_eq!(push(&mut decoder, velocity, 0), None);
        assert_eq!(push(&mut decoder, velocity, 20), Some([1.0, -0.5, 0.25]));
        let mut counters = OdometryCounters::default();
        let made = decoder.push(velocity, 3000 * MS, &mut counters);
        assert_eq!(
            (made, counters.gaps),
            (Some(Ok(None)), 3),
            "of each channel one"
        );
    }

    #[test]
    fn what_no_robot_does_and_what_is_older_is_refused() {
        let mut decoder = decoder();
        let far = BaseReading::Distances([1e300, 0.0]);
        push(&mut decoder, BaseReading::Distances([0.0; 2]), 100);
        assert_eq!(
            decoder.push(far, 120 * MS, &mut OdometryCounters::default()),
            Some(Err(FrameReject::Implausible))
        );
        let fast = BaseReading::Velocity([0.0, 0.0, 11.0]);
        assert_eq!(
            decoder.push(fast, 120 * MS, &mut OdometryCounters::default()),
            Some(Err(FrameReject::Implausible))
        );
        let older = BaseReading::Distances([0.0; 2]);
        assert_eq!(
            decoder.push(older, 80 * MS, &mut OdometryCounters::default()),
            Some(Err(FrameReject::Backward))
        );
        assert!(decoder.over([0.0, 3.0, 0.0], (0, MS)).is_err());
        assert!(decoder.over([2.0, 0.0, -10.0], (0, MS)).is_ok());
    }

    #[test]
    fn a_base_that_started_again_is_believed_after_three_readings() {
        let mut decoder = decoder();
        let mut reading = |metres, ms| {
            let made = decoder.push(
                BaseReading::Distances([metres; 2]),
                ms * MS,
                &mut OdometryCounters::default(),
            );
            made.expect("configured")
        };
        assert_eq!(reading(50.0, 0), Ok(None));
        assert_eq!(reading(0.0, 20), Err(FrameReject::Implausible));
        assert_eq!(reading(0.01, 40), Err(FrameReject::Implausible));
        assert_eq!(reading(0.02, 60), Ok(None));
        let came = reading(0.03, 80).unwrap().map(|it| it.velocity);
        assert!(near(came, [0.5, 0.0, 0.0]), "{came:?}");
    }

    /// What is said of standing after three seconds of samples.
    fn rest_of(mut push: impl FnMut(&mut BaseDecoder, i64) -> Option<WheelOdometry>) -> Rest {
        let mut decoder = decoder();
        let last = (0..8).filter_map(|time| push(&mut decoder, 400 * time * MS));
        last.last().expect("a sample").rest
    }

    #[test]
    fn ways_that_do_not_change_are_standing_and_so_may_be_speeds() {
        let said = |reading| {
            move |decoder: &mut BaseDecoder, ns| {
                let made = decoder.push(reading, ns, &mut OdometryCounters::default());
                made.expect("configured").unwrap()
            }
        };
        assert_eq!(
            rest_of(said(BaseReading::Distances([7.0, -3.0]))),
            Rest::Counts
        );
        assert_eq!(rest_of(said(BaseReading::Counts([7, -3]))), Rest::Counts);
        assert_eq!(rest_of(said(BaseReading::Velocity([0.0; 3]))), Rest::Speeds);
        let over = |velocity| {
            move |decoder: &mut BaseDecoder, ns| decoder.over(velocity, (ns, ns + 400 * MS)).ok()
        };
        assert_eq!(rest_of(over([0.0; 3])), Rest::Speeds);
        assert_eq!(rest_of(over([0.0, 0.0, 1e-3])), Rest::Moving);
    }

    #[test]
    fn without_its_measures_wheels_say_nothing() {
        let mut decoder = of(BaseConfig::default()).unwrap();
        assert_eq!(
            decoder.push(
                BaseReading::Distances([0.0; 2]),
                0,
                &mut OdometryCounters::default()
            ),
            None
        );
        assert_eq!(
            decoder.push(
                BaseReading::Counts([0; 2]),
                0,
                &mut OdometryCounters::default()
            ),
            None
        );
        assert!(
            decoder
                .push(
                    BaseReading::Velocity([0.0; 3]),
                    0,
                    &mut OdometryCounters::default()
                )
                .is_some()
        );
    }

    #[test]
    fn counts_without_a_track_are_refused() {
        let base = BaseConfig {
            metres_per_count: Some([1e-3; 2]),
            ..BaseConfig::default()
        };
        let refusal = of(base).unwrap_err().to_string();
        assert!(refusal.contains("base.track_m"), "{refusal}");
    }
}
