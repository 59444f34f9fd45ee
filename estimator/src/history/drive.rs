//! What drives the robot between two stamps: a sample, a sample held, or nothing that is known.

use super::turns::{Expected, Turned};
use crate::covariance::Covariance3;
use crate::filter::Filter;
use crate::gyro::{Bias, Passage};
use crate::kind::OdometrySample;
use crate::motion::Motion;
use crate::output::OdometryState;
use crate::settings::{OdometrySettings, Settings};
use crate::stamp::{Span, Stamp};

/// The velocity in force at a moment.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) enum Drive {
    /// A sample covers the moment.
    Measured(Motion),
    /// No sample covers it; the last one ended at `since`.
    Held { motion: Motion, since: Stamp },
    /// No sample covers it and none ended less than the hold time ago.
    Unknown,
}

/// A stretch of time with one drive: from where it was asked for, to `until`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Leg {
    pub(crate) drive: Drive,
    pub(crate) until: Stamp,
}

impl Leg {
    /// The leg that begins at `from`, no longer than to `limit`.
    ///
    /// `last` is the latest sample that ended at or before `from`; `upcoming` are those that end after it, in the
    /// history's order. They may begin anywhere: the first of them that has begun drives.
    pub(crate) fn starting<'a>(
        from: Stamp,
        limit: Stamp,
        last: Option<&OdometrySample>,
        upcoming: impl Iterator<Item = &'a OdometrySample>,
        hold: Span,
    ) -> Self {
        let mut until = limit;
        for sample in upcoming.filter(|sample| sample.stamp > from) {
            if sample.start <= from {
                let drive = Drive::Measured(sample.motion);
                return Self {
                    drive,
                    until: until.min(sample.stamp),
                };
            }
            until = until.min(sample.start);
        }
        Self::unmeasured(from, until, last, hold)
    }

    fn unmeasured(from: Stamp, limit: Stamp, last: Option<&OdometrySample>, hold: Span) -> Self {
        match last {
            Some(sample) if from < sample.stamp + hold => Self {
                drive: Drive::Held {
                    motion: sample.motion,
                    since: sample.stamp,
                },
                until: limit.min(sample.stamp + hold),
            },
            _ => Self {
                drive: Drive::Unknown,
                until: limit,
            },
        }
    }

    /// What drives over the leg, from its beginning `from`.
    #[inline]
    pub(crate) fn motion(&self, from: Stamp, settings: &OdometrySettings) -> Motion {
        self.drive.motion(from, self.until, settings)
    }

    #[inline]
    pub(crate) fn is_measured(&self) -> bool {
        matches!(self.drive, Drive::Measured(_))
    }

    /// What passes over the leg, from its beginning `from`, where a gyro has `turned`.
    pub(crate) fn passage(
        &self,
        from: Stamp,
        turned: Option<Turned>,
        settings: &OdometrySettings,
    ) -> Passage {
        Passage {
            from,
            dt_s: (self.until - from).as_seconds(),
            motion: self.motion(from, settings),
            is_measured: self.is_measured(),
            turned,
        }
    }

    /// What the wheels expect a gyro of that bias to read over the leg, from its beginning `from`.
    #[cold]
    pub(crate) fn expected(
        &self,
        from: Stamp,
        bias: Option<&Bias>,
        settings: &OdometrySettings,
    ) -> Expected {
        if matches!(self.drive, Drive::Unknown) {
            return Expected::default();
        }
        let dt_s = (self.until - from).as_seconds();
        let ([_, _, turn], noise) = self.motion(from, settings).held_over(dt_s);
        let bias = bias.map_or(0.0, Bias::mean);
        Expected {
            rate: self.is_measured().then_some(turn / dt_s + bias),
            density: noise.pp / dt_s,
        }
    }

    /// Brings the filter from the leg's beginning `from` to its end.
    #[inline]
    pub(crate) fn predict(&self, filter: &mut Filter, from: Stamp, settings: &Settings) {
        let motion = self.motion(from, &settings.odometry);
        let dt_s = (self.until - from).as_seconds();
        filter.predict(&motion, dt_s, settings.propagation);
    }
}

impl Drive {
    pub(crate) fn state(&self) -> OdometryState {
        match self {
            Self::Measured(_) => OdometryState::Fresh,
            Self::Held { .. } => OdometryState::Held,
            Self::Unknown => OdometryState::Stale,
        }
    }

    /// `[v_x, v_y, ω]`
    pub(crate) fn velocity(&self) -> [f64; 3] {
        match self {
            Self::Measured(motion) | Self::Held { motion, .. } => motion.velocity(),
            Self::Unknown => [0.0; 3],
        }
    }

    /// Of the velocity's mean over a reference period that ends at `stamp`.
    pub(crate) fn covariance(&self, stamp: Stamp, settings: &OdometrySettings) -> Covariance3 {
        match self {
            Self::Measured(motion) => motion.covariance(),
            Self::Held { motion, since } => {
                let held = ratio(stamp - *since, settings.reference_period);
                let grown = motion.with_noise_scaled(1.0 + settings.hold_growth * held);
                grown.covariance()
            }
            Self::Unknown => Covariance3::clamped_diagonal(settings.outage_variance),
        }
    }

    /// Velocity and noise over `(from, until]`: Q · T/dt, times `1 + growth · t/T` while held, with t the mean
    /// time held. Both factors make the noise that a stretch of time adds independent of how it is cut.
    fn motion(&self, from: Stamp, until: Stamp, settings: &OdometrySettings) -> Motion {
        let period = settings.reference_period;
        let white = ratio(period, until - from);
        match self {
            Self::Measured(motion) => settings.measured(motion, until - from),
            Self::Held { motion, since } => {
                let held = 0.5 * (ratio(from - *since, period) + ratio(until - *since, period));
                motion.with_noise_scaled(white * (1.0 + settings.hold_growth * held))
            }
            Self::Unknown => Motion::standstill(settings.outage_variance).with_noise_scaled(white),
        }
    }
}

fn ratio(span: Span, unit: Span) -> f64 {
    span.as_seconds() / unit.as_seconds()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance2;
    use nalgebra::Matrix2;

    const HOLD: Span = Span::from_nanos(50);

    fn ns(nanos: i64) -> Stamp {
        Stamp::from_nanos(nanos)
    }

    fn sample(start: i64, stamp: i64, v: f64) -> OdometrySample {
        let noise = Covariance2::new(Matrix2::from_diagonal_element(v * v)).unwrap();
        let motion = Motion::Nonholonomic {
            velocity: [v, 0.0],
            noise,
        };
        OdometrySample {
            source: 0,
            start: ns(start),
            stamp: ns(stamp),
            motion,
        }
    }

    fn leg(
        from: i64,
        limit: i64,
        last: Option<OdometrySample>,
        upcoming: &[OdometrySample],
    ) -> (OdometryState, f64, i64) {
        let leg = Leg::starting(ns(from), ns(limit), last.as_ref(), upcoming.iter(), HOLD);
        (
            leg.drive.state(),
            leg.drive.velocity()[0],
            leg.until.as_nanos(),
        )
    }

    #[test]
    fn a_covering_sample_drives_to_the_limit() {
        assert_eq!(
            leg(10, 15, None, &[sample(0, 20, 2.0)]),
            (OdometryState::Fresh, 2.0, 15)
        );
    }

    #[test]
    fn the_covering_sample_that_ends_first_wins() {
        let overlapping = [sample(0, 20, 2.0), sample(0, 30, 3.0)];
        assert_eq!(
            leg(10, 20, None, &overlapping),
            (OdometryState::Fresh, 2.0, 20)
        );
    }

    #[test]
    fn a_longer_sample_drives_until_one_that_ends_earlier_begins() {
        let nested = [sample(15, 20, 2.0), sample(0, 30, 3.0)];
        assert_eq!(leg(10, 20, None, &nested), (OdometryState::Fresh, 3.0, 15));
        assert_eq!(leg(15, 20, None, &nested), (OdometryState::Fresh, 2.0, 20));
    }

    #[test]
    fn a_gap_is_held_until_the_next_sample_begins() {
        assert_eq!(
            leg(20, 60, Some(sample(0, 20, 2.0)), &[sample(40, 60, 3.0)]),
            (OdometryState::Held, 2.0, 40)
        );
    }

    #[test]
    fn holding_ends_with_the_hold_time_and_then_nothing_is_known() {
        let last = Some(sample(0, 20, 2.0));
        assert_eq!(leg(30, 200, last, &[]), (OdometryState::Held, 2.0, 70));
        assert_eq!(leg(70, 200, last, &[]), (OdometryState::Stale, 0.0, 200));
        assert_eq!(
            leg(70, 200, last, &[sample(100, 200, 1.0)]),
            (OdometryState::Stale, 0.0, 100)
        );
        assert_eq!(leg(0, 200, None, &[]), (OdometryState::Stale, 0.0, 200));
    }

    #[test]
    fn noise_over_a_whole_period_is_exactly_q() {
        let motion = sample(0, 1, 0.3).motion;
        let settings = OdometrySettings::default();
        let from = ns(1_234_567_891);
        assert_eq!(
            Drive::Measured(motion).motion(from, from + settings.reference_period, &settings),
            motion
        );
    }

    /// Noise times dt, the velocity's contribution to a position's variance per second of Q.
    fn energy(drive: &Drive, cuts: &[i64]) -> f64 {
        let settings = OdometrySettings::default();
        let pieces = cuts.iter().zip(cuts.iter().skip(1));
        pieces
            .map(|(&from, &until)| {
                let Motion::Nonholonomic { noise, .. } =
                    drive.motion(ns(from), ns(until), &settings)
                else {
                    return f64::NAN;
                };
                let dt = Span::from_nanos(until - from).as_seconds();
                noise.matrix()[(0, 0)] * dt * dt
            })
            .sum()
    }

    #[test]
    fn noise_does_not_depend_on_how_time_is_cut() {
        let motion = sample(0, 1, 0.3).motion;
        for drive in [
            Drive::Measured(motion),
            Drive::Held {
                motion,
                since: ns(-5_000_000),
            },
        ] {
            let whole = energy(&drive, &[0, 100_000_000]);
            let cut = energy(
                &drive,
                &[0, 1, 7_000_000, 20_000_000, 99_999_999, 100_000_000],
            );
            assert!((whole - cut).abs() < 1e-12 * whole, "{whole} != {cut}");
        }
    }

    #[test]
    fn held_noise_grows_with_the_mean_time_held() {
        let motion = sample(0, 1, 0.3).motion;
        let settings = OdometrySettings::default();
        let (since, period) = (ns(7), settings.reference_period);
        let held = Drive::Held { motion, since };
        let first = held.motion(since, since + period, &settings);
        assert_eq!(
            first,
            motion.with_noise_scaled(1.0 + 0.5 * settings.hold_growth)
        );
        let second = held.motion(since + period, since + period + period, &settings);
        assert_eq!(
            second,
            motion.with_noise_scaled(1.0 + 1.5 * settings.hold_growth)
        );
    }
}
