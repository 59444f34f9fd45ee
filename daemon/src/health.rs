//! How each input is doing, and whether the belief may be driven on: decided at every tick from stamps and from what became of the
//! last inputs.
//!
//! | at the tick | health |
//! | --- | --- |
//! | the source is broken (a CAN bus that cannot receive) | faulty |
//! | the newest valid sample is recent, and the last three changed nothing | refused |
//! | the newest valid sample is recent | ok |
//! | else: something invalid came within `stale` | faulty |
//! | else: there was a valid sample once | stale |
//! | else | never seen |
//!
//! Recent is what is not older than `stale`, or, but for wheels, than 2.5 of the source's own intervals, whichever is longer.

use coloc_estimator::{Belief, Span, Stamp};
use coloc_shm_types::{BeliefState, Health, Input};

use crate::config;

/// So many refusals in a row are no accident: of honest inputs a gate of 99 % refuses three in a row once in a million.
const REFUSALS: u32 = 3;

/// A source is stale after so many tenths of its own interval.
const PATIENCE_TENTHS: i64 = 25;

/// Of the newest interval, so much goes into the mean …
const NEWEST: i64 = 4;
/// … and no more than so many times the mean: an outage is no interval.
const OUTLIER: i64 = 4;
/// No source is waited for longer than for one with this interval \[ns\].
const LONGEST_INTERVAL_NS: i64 = 60_000_000_000;

/// What a robot may say of its belief.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    /// Whether it knows where it is.
    pub state: BeliefState,
    /// Whether it knows well enough to drive.
    pub fit: bool,
}

/// What came of one source, or of all of one kind.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Sensor {
    valid: Option<Stamp>,
    invalid: Option<Stamp>,
    /// From one valid sample to the next, in the mean; 0 while there was one alone.
    interval_ns: i64,
    /// Valid ones in a row that changed nothing.
    refused: u32,
    /// The newest of these was beyond the gate.
    gated: bool,
}

impl Sensor {
    /// A valid sample, measured at `stamp`.
    pub(crate) fn valid(&mut self, stamp: Stamp) {
        if let Some(before) = self.valid {
            self.keep_time((stamp - before).as_nanos());
        }
        self.valid = self.valid.max(Some(stamp));
    }

    /// Samples of one moment, and those that come late, say nothing about the interval.
    fn keep_time(&mut self, interval_ns: i64) {
        if interval_ns <= 0 {
            return;
        }
        self.interval_ns = match self.interval_ns {
            0 => interval_ns.min(LONGEST_INTERVAL_NS),
            mean_ns => {
                let newest_ns = interval_ns.min(mean_ns.saturating_mul(OUTLIER));
                (mean_ns + (newest_ns - mean_ns) / NEWEST).clamp(1, LONGEST_INTERVAL_NS)
            }
        };
    }

    /// A valid sample changed the belief, or was told on.
    pub(crate) fn passed(&mut self) {
        self.refused = 0;
    }

    /// A valid sample did not; `gated`: it was beyond the gate.
    pub(crate) fn refused(&mut self, gated: bool) {
        (self.refused, self.gated) = (self.refused.saturating_add(1), gated);
    }

    /// Something invalid arrived at `now`.
    pub(crate) fn invalid(&mut self, now: Stamp) {
        self.invalid = Some(now);
    }

    /// At the tick stamped `now`.
    pub(crate) fn at(&self, now: Stamp, Patience { least, adapts }: Patience) -> Health {
        let own = Span::from_nanos(self.interval_ns * PATIENCE_TENTHS / 10);
        let patience = if adapts { least.max(own) } else { least };
        let recent =
            |stamp: Option<Stamp>, span: Span| stamp.is_some_and(|stamp| now - stamp <= span);
        match () {
            () if recent(self.valid, patience) && self.refused >= REFUSALS => Health::Refused,
            () if recent(self.valid, patience) || cfg!(coloc_break = "stale") => Health::Ok,
            () if recent(self.invalid, least) => Health::Faulty,
            () if self.valid.is_some() => Health::Stale,
            () => Health::NeverSeen,
        }
    }
}

/// How long a source is waited for.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Patience {
    /// At least.
    least: Span,
    /// Longer for one with long intervals. Not for wheels: between their samples the robot goes on by itself, and how long that
    /// may take has nothing to do with how often they speak.
    adapts: bool,
}

/// Watches all inputs.
#[derive(Clone, Debug)]
pub struct Watch {
    inputs: [Sensor; Input::COUNT],
    broken: [bool; Input::COUNT],
    patience: [Patience; Input::COUNT],
    /// The largest σ to drive with \[m, rad\].
    fit: [f64; 2],
}

impl Watch {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(config: &config::Health) -> Self {
        Self {
            inputs: [Sensor::default(); Input::COUNT],
            broken: [false; Input::COUNT],
            patience: patience(config),
            fit: [config.fit_position_m, config.fit_heading_rad].map(asked),
        }
    }

    /// A valid sample of `input`, measured at `stamp`.
    pub fn valid(&mut self, input: Input, stamp: Stamp) {
        self.sensor(input).valid(stamp);
    }

    /// A valid sample of `input` changed the belief, or was told on.
    pub fn passed(&mut self, input: Input) {
        self.sensor(input).passed();
    }

    /// A valid sample of `input` did not; `gated`: it was beyond the gate.
    pub fn refused(&mut self, input: Input, gated: bool) {
        self.sensor(input).refused(gated);
    }

    /// Something invalid arrived from `input` at `now`.
    pub fn invalid(&mut self, input: Input, now: Stamp) {
        self.sensor(input).invalid(now);
    }

    /// Whether the source of `input` cannot deliver at all.
    #[allow(clippy::indexing_slicing)] // One place for each of the inputs' numbers.
    pub fn broken(&mut self, input: Input, broken: bool) {
        self.broken[input as usize] = broken;
    }

    /// Everybody's health at the tick stamped `now`, by [`Input`].
    #[must_use]
    #[allow(clippy::indexing_slicing)] // As above.
    pub fn at(&self, now: Stamp) -> [Health; Input::COUNT] {
        Input::ALL.map(|input| {
            let place = input as usize;
            if self.broken[place] {
                return Health::Faulty;
            }
            self.inputs[place].at(now, self.patience[place])
        })
    }

    /// What a robot with such inputs may say of its belief: without wheels it does not know where it is, and not if every fix is
    /// beyond the gate, or, where there are no fixes, every neighbour's word.
    #[must_use]
    pub fn standing(&self, health: [Health; Input::COUNT], belief: &Belief) -> Standing {
        let of = |input: Input| health.get(input as usize).copied().unwrap_or_default();
        let contradicts = |input: Input| of(input) == Health::Refused && self.is_gated(input);
        let state = match of(Input::Odometry) {
            Health::Ok if contradicts(Input::Position) => BeliefState::Contradicted,
            Health::Ok if contradicts(Input::Neighbour) && of(Input::Position) != Health::Ok => {
                BeliefState::Contradicted
            }
            Health::Ok => BeliefState::Ok,
            _ => BeliefState::Finding,
        };
        let [position_m, heading_rad] = sigmas(belief);
        let precise = position_m <= self.fit[0] && heading_rad <= self.fit[1];
        Standing {
            state,
            fit: state == BeliefState::Ok && precise,
        }
    }

    fn is_gated(&self, input: Input) -> bool {
        self.inputs
            .get(input as usize)
            .is_some_and(|sensor| sensor.gated)
    }

    #[allow(clippy::indexing_slicing)] // As above.
    fn sensor(&mut self, input: Input) -> &mut Sensor {
        &mut self.inputs[input as usize]
    }
}

/// A limit of zero asks for nothing.
fn asked(limit: f64) -> f64 {
    if limit > 0.0 { limit } else { f64::INFINITY }
}

/// How long a source of each [`Input`] is waited for.
pub(crate) fn patience(config: &config::Health) -> [Patience; Input::COUNT] {
    Input::ALL.map(|input| {
        let least_s = match input {
            Input::Odometry => config.odometry_stale_s,
            Input::RelativePose => config.relative_pose_stale_s,
            Input::Position => config.position_stale_s,
            Input::Neighbour => config.neighbours_stale_s,
        };
        Patience {
            least: Span::from_nanos(config::nanos(least_s)),
            adapts: input != Input::Odometry,
        }
    })
}

/// σ of the position in its worst direction, and of the heading \[m, rad\].
fn sigmas(belief: &Belief) -> [f64; 2] {
    let p = belief.total.to_row_major();
    let half = f64::midpoint(p[0], p[4]);
    let worst = half + f64::hypot((p[0] - p[4]) / 2.0, p[1]);
    [worst, p[8]].map(f64::sqrt)
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
    fn what_never_passes_is_refused_until_something_does() {
        let mut watch = watch();
        for millis in [1000, 1200, 1400] {
            assert_ne!(at(&watch, millis), Health::Refused);
            watch.valid(Input::Odometry, stamp(millis));
            watch.refused(Input::Odometry, true);
        }
        assert_eq!(at(&watch, 1400), Health::Refused);
        assert_eq!(at(&watch, 3000), Health::Stale, "nothing comes any more");
        watch.valid(Input::Odometry, stamp(3000));
        watch.passed(Input::Odometry);
        assert_eq!(at(&watch, 3000), Health::Ok);
    }

    #[test]
    fn a_slow_source_is_stale_after_its_own_interval_and_not_before() {
        let mut watch = watch();
        let fixes = |watch: &Watch, millis| watch.at(stamp(millis))[Input::Position as usize];
        watch.valid(Input::Position, stamp(0));
        for second in 1..30 {
            watch.valid(Input::Position, stamp(2000 * second));
            for millis in 1..=2000 {
                assert_eq!(fixes(&watch, 2000 * second + millis), Health::Ok);
            }
        }
        assert_eq!(fixes(&watch, 58_000 + 5000), Health::Ok);
        assert_eq!(fixes(&watch, 58_000 + 5001), Health::Stale);
    }

    #[test]
    fn an_outage_is_no_interval() {
        let mut sensor = Sensor::default();
        let patience = Patience {
            least: Span::from_millis(100),
            adapts: true,
        };
        (0..10).for_each(|k| sensor.valid(stamp(200 * k)));
        sensor.valid(stamp(3_600_000));
        assert_eq!(
            sensor.at(stamp(3_600_000 + 1000), patience),
            Health::Stale,
            "after an hour of silence as before"
        );
        // A burst says little, and what is late nothing.
        (0..5).for_each(|_| sensor.valid(stamp(3_600_000)));
        sensor.valid(stamp(3_500_000));
        assert_eq!(sensor.at(stamp(3_600_000 + 400), patience), Health::Ok);
    }

    fn standing(
        refused: &[Input],
        gated: bool,
        belief: &Belief,
        config: &config::Health,
    ) -> Standing {
        let mut watch = Watch::new(config);
        for input in [Input::Odometry, Input::Position, Input::Neighbour] {
            for _ in 0..REFUSALS {
                watch.valid(input, stamp(1000));
                if refused.contains(&input) {
                    watch.refused(input, gated);
                }
            }
        }
        watch.standing(watch.at(stamp(1000)), belief)
    }

    #[test]
    fn a_belief_that_everything_contradicts_says_so() {
        let state = |refused: &[Input], gated| {
            standing(
                refused,
                gated,
                &Belief::default(),
                &config::Health::default(),
            )
            .state
        };
        assert_eq!(state(&[], true), BeliefState::Ok);
        assert_eq!(state(&[Input::Position], true), BeliefState::Contradicted);
        assert_eq!(
            state(&[Input::Neighbour], true),
            BeliefState::Ok,
            "fixes pass"
        );
        let both = [Input::Position, Input::Neighbour];
        assert_eq!(state(&both, true), BeliefState::Contradicted);
        assert_eq!(
            state(&both, false),
            BeliefState::Ok,
            "late is no contradiction"
        );
        assert_eq!(state(&[Input::Odometry], false), BeliefState::Finding);
    }

    #[test]
    fn fit_is_who_knows_as_well_as_was_asked_for() {
        let config = config::Health {
            fit_position_m: 0.5,
            fit_heading_rad: 0.1,
            ..config::Health::default()
        };
        let fit = |xy: f64, correlation: f64, phi: f64, refused: &[Input]| {
            let [x, y] = [xy * xy; 2];
            let total = [
                x,
                correlation * x,
                0.0,
                correlation * x,
                y,
                0.0,
                0.0,
                0.0,
                phi * phi,
            ];
            let covariance = coloc_estimator::Covariance3::from_row_major(total).unwrap();
            let belief = Belief::independent(coloc_estimator::Pose::default(), covariance);
            standing(refused, true, &belief, &config).fit
        };
        assert!(fit(0.49, 0.0, 0.09, &[]));
        assert!(!fit(0.49, 0.9, 0.09, &[]), "worst in a diagonal direction");
        assert!(!fit(0.51, 0.0, 0.09, &[]));
        assert!(!fit(0.49, 0.0, 0.11, &[]));
        assert!(!fit(0.49, 0.0, 0.09, &[Input::Position]), "contradicted");
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
