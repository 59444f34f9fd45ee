//! How each sensor is doing, decided at every tick from stamps alone.
//!
//! | at the tick | health |
//! | --- | --- |
//! | the source is broken (a CAN bus that cannot receive) | faulty |
//! | the newest valid sample is at most `stale` old | ok |
//! | else: something invalid came within `stale` | faulty |
//! | else: there was a valid sample once | stale |
//! | else | never seen |

use coloc_estimator::{Span, Stamp};
use coloc_shm_types::{BeliefState, Health, Input};

use crate::config;

/// Whether a robot whose inputs do like this knows where it is: with wheels that are heard it is taken to, without them not.
#[must_use]
pub fn belief_state(health: [Health; Input::COUNT]) -> BeliefState {
    match health.get(Input::Odometry as usize) {
        Some(Health::Ok) => BeliefState::Ok,
        _ => BeliefState::Finding,
    }
}

/// Watches all sensors.
#[derive(Clone, Debug)]
pub struct Watch {
    sensors: [Sensor; Input::COUNT],
}

#[derive(Clone, Debug)]
struct Sensor {
    stale: Span,
    valid: Option<Stamp>,
    invalid: Option<Stamp>,
    broken: bool,
}

impl Watch {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(config: &config::Health) -> Self {
        let thresholds = [
            config.odometry_stale_s,
            config.relative_pose_stale_s,
            config.position_stale_s,
            config.neighbours_stale_s,
        ];
        Self {
            sensors: thresholds.map(Sensor::new),
        }
    }

    /// A valid sample of `input`, measured at `stamp`.
    pub fn valid(&mut self, input: Input, stamp: Stamp) {
        let sensor = self.sensor(input);
        sensor.valid = sensor.valid.max(Some(stamp));
    }

    /// Something invalid arrived from `input` at `now`.
    pub fn invalid(&mut self, input: Input, now: Stamp) {
        self.sensor(input).invalid = Some(now);
    }

    /// Whether the source of `input` cannot deliver at all.
    pub fn broken(&mut self, input: Input, broken: bool) {
        self.sensor(input).broken = broken;
    }

    /// Everybody's health at the tick stamped `now`, by [`Input`].
    #[must_use]
    pub fn at(&self, now: Stamp) -> [Health; Input::COUNT] {
        self.sensors.each_ref().map(|sensor| sensor.at(now))
    }

    #[allow(clippy::indexing_slicing)] // One sensor for each of the inputs' numbers.
    fn sensor(&mut self, input: Input) -> &mut Sensor {
        &mut self.sensors[input as usize]
    }
}

impl Sensor {
    fn new(stale_s: f64) -> Self {
        let stale = Span::from_nanos(config::nanos(stale_s));
        Self {
            stale,
            valid: None,
            invalid: None,
            broken: false,
        }
    }

    fn at(&self, now: Stamp) -> Health {
        let recent = |stamp: Option<Stamp>| stamp.is_some_and(|stamp| now - stamp <= self.stale);
        match () {
            () if self.broken => Health::Faulty,
            () if recent(self.valid) || cfg!(coloc_break = "stale") => Health::Ok,
            () if recent(self.invalid) => Health::Faulty,
            () if self.valid.is_some() => Health::Stale,
            () => Health::NeverSeen,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(watch: &Watch, millis: i64) -> Health {
        watch.at(Stamp::default() + Span::from_millis(millis))[Input::Odometry as usize]
    }

    fn watch() -> Watch {
        Watch::new(&config::Health::default())
    }

    fn stamp(millis: i64) -> Stamp {
        Stamp::default() + Span::from_millis(millis)
    }

    #[test]
    fn stale_begins_right_after_the_threshold() {
        let mut watch = watch();
        assert_eq!(at(&watch, 1000), Health::NeverSeen);
        watch.valid(Input::Odometry, stamp(1000));
        assert_eq!(at(&watch, 1100), Health::Ok);
        assert_eq!(
            watch.at(stamp(1100) + Span::from_nanos(1))[0],
            Health::Stale
        );
    }

    #[test]
    fn garbage_alone_is_faulty_and_ends_when_it_ends() {
        let mut watch = watch();
        watch.invalid(Input::Odometry, stamp(1000));
        assert_eq!(at(&watch, 1000), Health::Faulty);
        assert_eq!(at(&watch, 1200), Health::NeverSeen);
    }

    #[test]
    fn garbage_among_good_samples_is_counted_elsewhere() {
        let mut watch = watch();
        watch.valid(Input::Odometry, stamp(1000));
        watch.invalid(Input::Odometry, stamp(1010));
        assert_eq!(at(&watch, 1020), Health::Ok);
    }

    #[test]
    fn a_broken_bus_is_faulty_at_once() {
        let mut watch = watch();
        watch.valid(Input::Odometry, stamp(1000));
        watch.broken(Input::Odometry, true);
        assert_eq!(at(&watch, 1000), Health::Faulty);
        watch.broken(Input::Odometry, false);
        assert_eq!(at(&watch, 1000), Health::Ok);
    }
}
