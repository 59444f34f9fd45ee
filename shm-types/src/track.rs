//! Where the robot was at a past moment: the pose at the time of a scan.
//!
//! Between two estimates the robot goes where the wheels take it, along an arc, as the daemon has it. What the second one has learnt
//! beyond that (a fix, a neighbour, somebody's word) is a correction at its own moment: until then the older belief is carried on, as
//! by a daemon that has not heard of it yet. With `λ` the part of the time that has passed, `r(λ)` the way driven up to then from the
//! heading that was believed, `κ` what an uncertain heading leaves of it in the mean, and `J` a turn by a right angle:
//!
//! ```text
//! p(λ) = p_a + κ r(λ)      P(λ) = P_a + λ L + S(λ)      δ = κ J r(λ)      s = P_a,φφ
//! S(λ) between position and heading    s δ
//!      of the position                 P_a,pφ δᵀ + δ P_a,pφᵀ + ½ (1 − e²)² r rᵀ + ½ (1 − e⁴) (J r)(J r)ᵀ      e = exp(−s/2)
//! ```
//!
//! `L` is what grows with the time. If nothing was learnt at its end, `p(1) = p_b` and `P(1) = P_b` give κ and L. Otherwise κ and L are those of
//! the nearest two estimates between which nothing was learnt, or else e and the velocity's covariance. A robot that looks for itself
//! publishes a guess that goes with its best hypothesis: between two guesses no farther apart than the way driven lies their mixture.
mod leg;

use std::collections::VecDeque;
use std::time::Duration;

use crate::Estimate;
use leg::{Growth, Leg};

/// Two estimates farther apart than this have nothing between them: too many were lost \[ns\].
const LONGEST_GAP_NS: i64 = 200_000_000;

/// A wall clock that came so much farther than the inner one was set \[ns\].
const STEP_NS: i64 = 500_000;

/// The estimates of the last seconds, of one robot. Memory is bounded by `length` and the rate of the daemon.
///
/// ```
/// # use std::time::Duration;
/// # use coloc_shm_types::{Estimate, RobotName, Space, Track};
/// # let root = tempfile::tempdir()?;
/// # let space = Space::open(root.path(), "doc", "scanner")?;
/// # let scan_boot_ns = 0;
/// let estimates = space.subscriber::<Estimate>(&RobotName::new("robot1")?)?;
/// let mut track = Track::new(Duration::from_secs(2));
/// while let Some(estimate) = estimates.receive()? {
///     track.note(&estimate);
/// }
/// match track.at_boot(scan_boot_ns) {
///     Ok(then) => println!("{:?} ± {:?}", then.pose, then.covariance),
///     Err(reason) => println!("{reason}"), // Such as: ask again after the next one.
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// It answers with what was believed then: by the last estimate up to the moment, carried on along the way that the wheels drove. What
/// the next estimate has learnt counts from its own moment on, also where a fix in it is of an earlier one.
#[derive(Clone, Debug)]
pub struct Track {
    length_ns: i64,
    estimates: VecDeque<Estimate>,
}

/// The belief at a moment.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PastPose {
    /// `[x, y, φ]` in the common frame, φ in (−π, π] \[m, m, rad\].
    pub pose: [f64; 3],
    /// `[x, y, φ]` in the odometry frame, likewise: no measurement moves it.
    pub odometry: [f64; 3],
    /// P of `pose`, 3×3, full row-major \[m², m·rad, rad²\].
    pub covariance: [f64; 9],
}

/// Why there is no pose of that moment.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoPose {
    /// No estimate has come.
    #[error("no estimate has come yet: does the robot's daemon run?")]
    Nothing,
    /// It is before the oldest estimate.
    #[error(
        "{stamp_ns} ns is before {oldest_ns} ns, the oldest estimate that is kept: keep them for longer, or ask sooner"
    )]
    TooOld {
        /// What was asked for.
        stamp_ns: i64,
        /// The oldest.
        oldest_ns: i64,
    },
    /// It is after the newest estimate.
    #[error(
        "{stamp_ns} ns is after {newest_ns} ns, the newest estimate: ask again after the next one"
    )]
    NotYet {
        /// What was asked for.
        stamp_ns: i64,
        /// The newest.
        newest_ns: i64,
    },
    /// The estimates before and after it are too far apart, or the clock was set between them.
    #[error(
        "{stamp_ns} ns is between two estimates that do not follow each other: some were lost, or the clock was set"
    )]
    Gap {
        /// What was asked for.
        stamp_ns: i64,
    },
}

/// Which stamp of an estimate is meant.
type Stamp = fn(&Estimate) -> i64;

impl Track {
    /// Keeps estimates for `length`.
    #[must_use]
    pub fn new(length: Duration) -> Self {
        Self {
            length_ns: i64::try_from(length.as_nanos()).unwrap_or(i64::MAX),
            estimates: VecDeque::new(),
        }
    }

    /// Takes in an estimate that is valid. Where it does not follow the last one (the daemon was started again), the track begins
    /// anew; one that was here before changes nothing.
    pub fn note(&mut self, estimate: &Estimate) {
        if let Some(last) = self.estimates.back() {
            let same = last.header.session == estimate.header.session;
            if same && estimate.boot_ns <= last.boot_ns {
                return;
            }
            if !same {
                self.estimates.clear();
            }
        }
        self.estimates.push_back(*estimate);
        let oldest_ns = estimate.boot_ns.saturating_sub(self.length_ns);
        // The one before the oldest moment is needed for it.
        while self
            .estimates
            .get(1)
            .is_some_and(|it| it.boot_ns <= oldest_ns)
        {
            self.estimates.pop_front();
        }
    }

    /// The pose at `stamp_ns` of the clock that the estimates' headers are stamped by.
    ///
    /// # Errors
    /// Why there is none.
    pub fn at(&self, stamp_ns: i64) -> Result<PastPose, NoPose> {
        self.by(|estimate| estimate.header.stamp_ns, stamp_ns)
    }

    /// The pose at `boot_ns` of `CLOCK_BOOTTIME`, which never steps.
    ///
    /// # Errors
    /// Why there is none.
    pub fn at_boot(&self, boot_ns: i64) -> Result<PastPose, NoPose> {
        self.by(|estimate| estimate.boot_ns, boot_ns)
    }

    /// Of several such moments, because the clock was set back, the newest.
    fn by(&self, stamp: Stamp, stamp_ns: i64) -> Result<PastPose, NoPose> {
        if let Some(own) = self.estimates.iter().rev().find(|it| stamp(it) == stamp_ns) {
            return Ok(told(own));
        }
        let around = |leg: &Leg| (stamp(leg.from)..=stamp(leg.to)).contains(&stamp_ns);
        let legs = (1..self.estimates.len()).rev();
        match legs
            .filter_map(|end| self.leg(end).map(|leg| (end, leg)))
            .find(|(_, leg)| around(leg))
        {
            Some((end, leg)) if follows(&leg, stamp) => {
                Ok(self.within(end, &leg, part(&leg, stamp, stamp_ns)))
            }
            Some(_) => Err(NoPose::Gap { stamp_ns }),
            None => Err(self.outside(stamp, stamp_ns)),
        }
    }

    /// The leg that ends with the estimate in that place.
    fn leg(&self, end: usize) -> Option<Leg<'_>> {
        let from = self.estimates.get(end.checked_sub(1)?)?;
        let to = self.estimates.get(end)?;
        Some(Leg { from, to })
    }

    fn within(&self, end: usize, leg: &Leg<'_>, part: f64) -> PastPose {
        if leg.is_guess() {
            return leg.mixed(part);
        }
        let by_velocity = leg.growth_of_velocity();
        let growth = leg.growth().or_else(|| self.growth_near(end, &by_velocity));
        let carried = growth.and_then(|growth| leg.at(part, &growth));
        carried
            .or_else(|| leg.at(part, &by_velocity))
            .unwrap_or_else(|| told(leg.from))
    }

    /// Of the nearest leg without anything learnt, sooner of an older one. κ is of the heading, which may have been learnt since.
    fn growth_near(&self, end: usize, by_velocity: &Growth) -> Option<Growth> {
        let growth_of = |end: usize| self.steady(end)?.growth();
        let just_before = growth_of(end.checked_sub(1)?);
        let before_that = end.checked_sub(2).and_then(growth_of);
        let trend = |growth: Growth| before_that.map_or(growth, |it| growth.after(&it));
        just_before.map(trend).or_else(|| {
            let older = (1..end).rev();
            let newer = end + 1..self.estimates.len();
            let growth = older.chain(newer).find_map(growth_of)?;
            Some(growth.with_mean_of(by_velocity))
        })
    }

    /// One without a gap.
    fn steady(&self, end: usize) -> Option<Leg<'_>> {
        self.leg(end)
            .filter(|leg| follows(leg, |estimate| estimate.boot_ns))
    }

    fn outside(&self, stamp: Stamp, stamp_ns: i64) -> NoPose {
        let (Some(oldest), Some(newest)) = (self.estimates.front(), self.estimates.back()) else {
            return NoPose::Nothing;
        };
        let (oldest_ns, newest_ns) = (stamp(oldest), stamp(newest));
        match stamp_ns {
            _ if stamp_ns > newest_ns => NoPose::NotYet {
                stamp_ns,
                newest_ns,
            },
            _ if stamp_ns < oldest_ns => NoPose::TooOld {
                stamp_ns,
                oldest_ns,
            },
            _ => NoPose::Gap { stamp_ns },
        }
    }
}

fn follows(leg: &Leg<'_>, stamp: Stamp) -> bool {
    let passed_ns = leg.to.boot_ns.saturating_sub(leg.from.boot_ns);
    let said_ns = stamp(leg.to).saturating_sub(stamp(leg.from));
    passed_ns <= LONGEST_GAP_NS && said_ns.abs_diff(passed_ns) <= STEP_NS.unsigned_abs()
}

#[expect(clippy::cast_precision_loss, reason = "a fifth of a second at most")]
fn part(leg: &Leg<'_>, stamp: Stamp, stamp_ns: i64) -> f64 {
    (stamp_ns - stamp(leg.from)) as f64 / (stamp(leg.to) - stamp(leg.from)) as f64
}

/// At its own moment.
fn told(estimate: &Estimate) -> PastPose {
    let [x, y, phi] = estimate.pose;
    let [driven_x, driven_y, driven_phi] = estimate.odometry;
    PastPose {
        pose: [x, y, wrapped(phi)],
        odometry: [driven_x, driven_y, wrapped(driven_phi)],
        covariance: estimate.total(),
    }
}

/// In (−π, π].
fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turns = ((angle - PI) / TAU).ceil();
    angle - turns * TAU
}

#[cfg(test)]
mod tests {
    #![expect(clippy::cast_precision_loss, reason = "seconds of a test")]
    use super::*;
    use crate::{BeliefState, Header};

    const MS: i64 = 1_000_000;

    /// By a wall clock that is a second ahead.
    fn estimate(boot_ms: i64, pose: [f64; 3]) -> Estimate {
        Estimate {
            header: Header {
                stamp_ns: 1000 * MS + boot_ms * MS,
                ..Header::default()
            },
            boot_ns: boot_ms * MS,
            pose,
            odometry: pose,
            state: BeliefState::Ok as u8,
            ..Estimate::default()
        }
    }

    fn track(estimates: &[Estimate]) -> Track {
        let mut track = Track::new(Duration::from_secs(1));
        for estimate in estimates {
            track.note(estimate);
        }
        track
    }

    /// A quarter of a circle of 1 m, over the heading ±π.
    #[test]
    fn between_two_estimates_lies_the_arc() {
        let at = |angle: f64| [angle.sin(), -angle.cos(), wrapped(angle)];
        let track = track(&[estimate(0, at(3.0)), estimate(20, at(3.5))]);
        for (ms, angle) in [(0, 3.0), (5, 3.125), (10, 3.25), (20, 3.5)] {
            let found = track.at_boot(ms * MS).unwrap().pose;
            let by_the_wall = track.at((1000 + ms) * MS).unwrap().pose;
            assert_eq!(by_the_wall.map(f64::to_bits), found.map(f64::to_bits));
            for (found, expected) in found.iter().zip(at(angle)) {
                assert!(
                    (found - expected).abs() < 1e-14,
                    "{ms} ms: {found}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn there_is_no_pose_before_nor_after_nor_of_what_was_lost() {
        let apart = LONGEST_GAP_NS / MS;
        let poses = [100, 120, 121 + apart].map(|ms| estimate(ms, [0.0; 3]));
        let track = track(&poses);
        let (oldest_ns, newest_ns) = (100 * MS, (121 + apart) * MS);
        let error = |stamp_ns| track.at_boot(stamp_ns).unwrap_err();
        let (before, after, within) = (oldest_ns - 1, newest_ns + 1, 121 * MS);
        assert_eq!(
            error(before),
            NoPose::TooOld {
                stamp_ns: before,
                oldest_ns
            }
        );
        assert_eq!(
            error(after),
            NoPose::NotYet {
                stamp_ns: after,
                newest_ns
            }
        );
        assert_eq!(error(within), NoPose::Gap { stamp_ns: within });
        assert!(track.at_boot(newest_ns).is_ok() && track.at_boot(110 * MS).is_ok());
        let none = Track::new(Duration::from_secs(1)).at_boot(0);
        assert_eq!(none, Err(NoPose::Nothing));
    }

    #[test]
    fn a_clock_that_was_set_between_two_estimates_says_nothing_there() {
        for step_ms in [-500, -1, 1, 500] {
            let mut set = estimate(120, [1.0, 0.0, 0.0]);
            set.header.stamp_ns += step_ms * MS;
            let mut later = estimate(140, [2.0, 0.0, 0.0]);
            later.header.stamp_ns += step_ms * MS;
            let track = track(&[estimate(100, [0.0; 3]), set, later]);
            let between = track.at_boot(110 * MS).unwrap();
            assert!((between.pose[0] - 0.5).abs() < 1e-12);
            let after = track.at(later.header.stamp_ns - 10 * MS).unwrap();
            assert!((after.pose[0] - 1.5).abs() < 1e-12);
            let moment = set.header.stamp_ns.min(1120 * MS) - MS / 2;
            let said = track.at(moment);
            assert!(said.is_err(), "{step_ms} ms: {said:?}");
        }
    }

    #[test]
    fn it_keeps_as_much_as_it_was_asked_to_and_begins_anew_with_the_daemon() {
        let mut track = Track::new(Duration::from_millis(100));
        for tick in 0..1000 {
            track.note(&estimate(20 * tick, [0.0; 3]));
        }
        let newest_ms = 20 * 999;
        assert!(track.at_boot((newest_ms - 100) * MS).is_ok());
        assert!(track.estimates.len() <= 7, "{}", track.estimates.len());
        track.note(&estimate(newest_ms, [9.0; 3]));
        let kept = track.at_boot(newest_ms * MS).unwrap();
        assert!(kept.pose[0] < 1.0, "it was here");
        let mut other = estimate(newest_ms + 20, [0.0; 3]);
        other.header.session = 7;
        track.note(&other);
        let found = track.at_boot((newest_ms + 10) * MS);
        assert!(matches!(found, Err(NoPose::TooOld { .. })), "{found:?}");
    }

    fn with_deviations(boot_ms: i64, pose: [f64; 3], [m, rad]: [f64; 2]) -> Estimate {
        Estimate {
            independent: [m * m, 0.0, 0.0, 0.0, m * m, 0.0, 0.0, 0.0, rad * rad],
            odometry: [0.001 * boot_ms as f64, 0.0, 0.0],
            velocity_covariance: [0.04, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01],
            ..estimate(boot_ms, pose)
        }
    }

    fn assert_covariance(found: &PastPose) {
        let covariance = crate::matrix::Matrix::<3>::from_row_major(found.covariance);
        assert_eq!(covariance.check_covariance(), Ok(()), "{found:?}");
    }

    /// As after `coloc pose`: until the estimate that has taken it, the robot believes what it believed.
    #[test]
    fn a_jump_is_at_the_moment_of_the_estimate_that_has_it() {
        let sure = [0.05, 0.01];
        let set = with_deviations(40, [100.04, 50.0, 1.0], sure);
        let track = track(&[
            with_deviations(0, [0.0; 3], sure),
            with_deviations(20, [0.02, 0.0, 0.0], sure),
            set,
        ]);
        for ns in [20 * MS + 1, 25 * MS, 30 * MS, 39 * MS, 40 * MS - 1] {
            let found = track.at_boot(ns).unwrap();
            let driven = 1e-9 * ns as f64;
            assert!((found.pose[0] - driven).abs() < 1e-12, "{found:?}");
            assert!(found.pose[1].abs() < 1e-12 && found.pose[2].abs() < 1e-12);
            assert!((found.covariance[0] - 0.0025).abs() < 1e-4, "{found:?}");
            assert_covariance(&found);
        }
        assert_eq!(track.at_boot(40 * MS).unwrap(), told(&set));
    }

    /// Whatever two estimates say one after the other.
    #[test]
    fn there_is_a_covariance_between_any_two_estimates() {
        let (positions, headings) = ([1e-3, 0.05, 10.0, 2e7], [0.0, 0.01, 1.0, 10.0, 60.0]);
        let deviations: Vec<_> = positions
            .into_iter()
            .flat_map(|m| headings.map(|rad| [m, rad]))
            .collect();
        for before in &deviations {
            for after in &deviations {
                for (pose, state) in [[0.02, 0.0, 0.0], [100.04, 50.0, 1.0]]
                    .into_iter()
                    .flat_map(|pose| [BeliefState::Ok, BeliefState::Finding].map(|it| (pose, it)))
                {
                    let said = |boot_ms, pose, deviations| Estimate {
                        state: state as u8,
                        ..with_deviations(boot_ms, pose, deviations)
                    };
                    let first = said(20, [0.0; 3], *before);
                    let track = track(&[first, said(40, pose, *after)]);
                    for ns in [20 * MS + 1, 30 * MS, 40 * MS - 1] {
                        assert_covariance(&track.at_boot(ns).unwrap());
                    }
                }
            }
        }
    }

    /// A receiver that repeats one place to a robot that stands there: the mean does not move, the doubt falls.
    #[test]
    fn what_only_makes_sure_is_learnt_as_well() {
        let still = |boot_ms, m| Estimate {
            odometry: [0.0; 3],
            velocity_covariance: [0.0; 9],
            ..with_deviations(boot_ms, [0.0; 3], [m, 0.01])
        };
        let track = track(&[still(0, 0.5), still(20, 0.5), still(40, 0.1)]);
        let found = track.at_boot(40 * MS - 1).unwrap();
        assert!((found.covariance[0] - 0.25).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn angles_are_wrapped_once() {
        use std::f64::consts::PI;
        for (angle, expected) in [(PI, PI), (-PI, PI), (0.0, 0.0), (7.0, 7.0 - 2.0 * PI)] {
            assert!((wrapped(angle) - expected).abs() < 1e-15);
        }
    }
}
