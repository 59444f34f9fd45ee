//! Where the robot was at a past moment: the pose at the time of a scan.
//!
//! Between two estimates the robot is taken to go along an arc, as the daemon takes it to. With `λ` the part of the time from
//! one to the other that has passed, `m` the way of the mean, `m(λ)` its part along the arc, and `J` a turn by a right angle:
//!
//! ```text
//! P(λ) = (1 − λ) P_a + λ P_b + what is curved:      δ = J (m(λ) − λ m)      s = P_a,φφ
//!   between position and heading    s δ
//!   of the position                 P_a,pφ δᵀ + δ P_a,pφᵀ + C(m(λ)) − λ C(m)
//! C(m) = (Ω_a m mᵀ + C_b (J m)(J m)ᵀ) / e²          e = exp(−s/2)   Ω_a = ½ (1 − e²)²   C_b = ½ (1 − e⁴)
//! ```
//!
//! `C` is what an uncertain heading adds with the square of the way.
use std::collections::VecDeque;
use std::time::Duration;

use crate::Estimate;

/// Two estimates farther apart than this have nothing between them: too many were lost \[ns\].
const LONGEST_GAP_NS: i64 = 200_000_000;

/// A wall clock that came so much farther than the inner one was set \[ns\].
const STEP_NS: i64 = 500_000;

/// Below this, `e` is too small to divide by: the way is that of the velocity then.
const SMALLEST_MEAN: f64 = 0.1;

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
/// It answers with what was believed then. What a late measurement has taught the robot since about that moment is not in it.
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
        let mut newest_first = self.estimates.iter().rev();
        if let Some(own) = newest_first.find(|it| stamp(it) == stamp_ns) {
            return Ok(between(own, own, 0.0));
        }
        let pairs = self.estimates.iter().zip(self.estimates.iter().skip(1));
        let around = |(a, b): &(&Estimate, &Estimate)| (stamp(a)..=stamp(b)).contains(&stamp_ns);
        match pairs.rev().find(around) {
            Some((a, b)) if follows(a, b, stamp) => Ok(between(a, b, part(a, b, stamp, stamp_ns))),
            Some(_) => Err(NoPose::Gap { stamp_ns }),
            None => Err(self.outside(stamp, stamp_ns)),
        }
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

fn follows(a: &Estimate, b: &Estimate, stamp: Stamp) -> bool {
    let passed_ns = b.boot_ns.saturating_sub(a.boot_ns);
    let said_ns = stamp(b).saturating_sub(stamp(a));
    passed_ns <= LONGEST_GAP_NS && said_ns.abs_diff(passed_ns) <= STEP_NS.unsigned_abs()
}

#[expect(clippy::cast_precision_loss, reason = "a fifth of a second at most")]
fn part(a: &Estimate, b: &Estimate, stamp: Stamp, stamp_ns: i64) -> f64 {
    (stamp_ns - stamp(a)) as f64 / (stamp(b) - stamp(a)) as f64
}

fn between(a: &Estimate, b: &Estimate, part: f64) -> PastPose {
    PastPose {
        pose: pose_between(a.pose, b.pose, part),
        odometry: pose_between(a.odometry, b.odometry, part),
        covariance: covariance(a, b, part),
    }
}

fn pose_between(a: [f64; 3], b: [f64; 3], part: f64) -> [f64; 3] {
    let turn = wrapped(b[2] - a[2]);
    let [x, y] = along_the_arc([b[0] - a[0], b[1] - a[1]], turn, part);
    [a[0] + x, a[1] + y, wrapped(a[2] + part * turn)]
}

/// Of a way to the end of an arc that turns by `turn`, that to a `part` of it: chords, each seen from the arc's beginning.
fn along_the_arc([x, y]: [f64; 2], turn: f64, part: f64) -> [f64; 2] {
    let (whole, here) = (0.5 * turn, 0.5 * part * turn);
    let length = part * sinc(here) / sinc(whole);
    let (sin, cos) = (here - whole).sin_cos();
    [length * (cos * x - sin * y), length * (sin * x + cos * y)]
}

fn sinc(half: f64) -> f64 {
    if half.abs() < 1e-4 {
        1.0 - half * half / 6.0
    } else {
        half.sin() / half
    }
}

fn covariance(a: &Estimate, b: &Estimate, part: f64) -> [f64; 9] {
    let (before, after) = (a.total(), b.total());
    let mut mixed: [f64; 9] = core::array::from_fn(|place| {
        let [before, after] = [before[place], after[place]];
        before + part * (after - before)
    });
    for (place, curved) in (0..9).zip(curvature(a, b, part)) {
        mixed[place] += curved;
    }
    mixed
}

/// What is curved of the covariance between `a` and `b`, row by row.
fn curvature(a: &Estimate, b: &Estimate, part: f64) -> [f64; 9] {
    let total = a.total();
    let (with_heading, s) = ([total[2], total[5]], total[8]);
    let (turn, whole) = (wrapped(b.pose[2] - a.pose[2]), moved(a, b));
    let here = along_the_arc(whole, turn, part);
    let [dx, dy] = [part * whole[1] - here[1], here[0] - part * whole[0]];
    let certain = [way(a, b), along_the_arc(way(a, b), turn, part)];
    let [[wxx, wxy, wyy], [hxx, hxy, hyy]] = certain.map(|way| squares(s, way));
    let xx = 2.0 * with_heading[0] * dx + hxx - part * wxx;
    let yy = 2.0 * with_heading[1] * dy + hyy - part * wyy;
    let xy = with_heading[0] * dy + with_heading[1] * dx + hxy - part * wxy;
    [xx, xy, s * dx, xy, yy, s * dy, s * dx, s * dy, 0.0]
}

fn moved(a: &Estimate, b: &Estimate) -> [f64; 2] {
    [b.pose[0] - a.pose[0], b.pose[1] - a.pose[1]]
}

/// `m/e`: the way if the heading were certain. Where nothing is left of the mean's, that of the velocity.
#[expect(clippy::cast_precision_loss, reason = "a fifth of a second at most")]
fn way(a: &Estimate, b: &Estimate) -> [f64; 2] {
    let mean = (-0.5 * a.total()[8]).exp();
    if mean > SMALLEST_MEAN {
        return moved(a, b).map(|way| way / mean);
    }
    let passed_s = 1e-9 * (b.boot_ns - a.boot_ns) as f64;
    let [forward, left, rate] = b.velocity;
    let (sin, cos) = (a.pose[2] + 0.5 * passed_s * rate).sin_cos();
    [
        passed_s * (cos * forward - sin * left),
        passed_s * (sin * forward + cos * left),
    ]
}

/// `C` of a heading's variance `s` and the way `m/e`, as `[xx, xy, yy]`.
fn squares(s: f64, [x, y]: [f64; 2]) -> [f64; 3] {
    let loss = -(-s).exp_m1();
    let (along, across) = (0.5 * loss * loss, 0.5 * loss * (2.0 - loss));
    [
        along * x * x + across * y * y,
        (along - across) * x * y,
        along * y * y + across * x * x,
    ]
}

/// In (−π, π].
fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turns = ((angle - PI) / TAU).ceil();
    angle - turns * TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Header;

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

    #[test]
    fn angles_are_wrapped_once() {
        use std::f64::consts::PI;
        for (angle, expected) in [(PI, PI), (-PI, PI), (0.0, 0.0), (7.0, 7.0 - 2.0 * PI)] {
            assert!((wrapped(angle) - expected).abs() < 1e-15);
        }
    }
}
