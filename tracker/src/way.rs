//! How a robot moved, on a time line: by its own wheels, from what it says of them.

use std::collections::VecDeque;

use coloc_track::{Increment, Rate};
use nalgebra::{Matrix2, Matrix3, Vector3};

/// Longer than this nothing is kept \[ns\].
const LENGTH_NS: i64 = 5_000_000_000;

/// Two words that are farther apart do not follow each other \[ns\].
const LONGEST_GAP_NS: i64 = 500_000_000;

/// A word that begins so close to the end of the one before follows it \[ns\].
const SAME_NS: i64 = 1_000_000;

/// Where a robot was in the frame of its wheels.
#[derive(Copy, Clone, Debug)]
struct Sample {
    at_ns: i64,
    pose: Vector3<f64>,
    /// All covariances of its motion up to then, each in its own body frame.
    spent: Matrix3<f64>,
    /// Whether it follows the one before.
    follows: bool,
}

/// The last seconds of it.
#[derive(Clone, Debug, Default)]
pub struct Way(VecDeque<Sample>);

/// Seconds of so many nanoseconds.
#[must_use]
#[allow(clippy::cast_precision_loss)] // Seconds, to the nanosecond.
pub fn seconds(nanos: i64) -> f64 {
    nanos as f64 * 1e-9
}

impl Way {
    /// It is at `pose` in a frame that does not jump; `per_s` is the covariance of its motion in a second up to now.
    pub fn at(&mut self, at_ns: i64, pose: Vector3<f64>, per_s: &Matrix3<f64>) {
        let Some(last) = self.0.back().copied() else {
            return self.push(Sample {
                at_ns,
                pose,
                spent: Matrix3::zeros(),
                follows: false,
            });
        };
        let gap_ns = at_ns.saturating_sub(last.at_ns);
        if gap_ns > 0 {
            self.push(Sample {
                at_ns,
                pose,
                spent: last.spent + per_s * seconds(gap_ns),
                follows: gap_ns <= LONGEST_GAP_NS,
            });
        }
    }

    /// It moved by `increment` from `start_ns` to `end_ns`. What it has said of before counts.
    pub fn moved(&mut self, start_ns: i64, end_ns: i64, increment: &Increment) {
        let last = self.0.back().copied();
        let follows = last.is_some_and(|it| (start_ns - it.at_ns).abs() <= SAME_NS);
        if last.is_some_and(|it| !follows && start_ns < it.at_ns) || end_ns <= start_ns {
            return;
        }
        let begin = last.filter(|_| follows).unwrap_or(Sample {
            at_ns: start_ns,
            pose: Vector3::zeros(),
            spent: Matrix3::zeros(),
            follows: false,
        });
        if !follows {
            self.push(begin);
        }
        self.push(Sample {
            at_ns: end_ns,
            pose: moved(&begin.pose, &increment.displacement),
            spent: begin.spent + increment.covariance,
            follows: true,
        });
    }

    fn push(&mut self, sample: Sample) {
        self.0.push_back(sample);
        let oldest_ns = sample.at_ns - LENGTH_NS;
        while self.0.front().is_some_and(|it| it.at_ns < oldest_ns) {
            self.0.pop_front();
        }
    }

    /// Until when it is known \[ns\].
    #[must_use]
    pub fn end_ns(&self) -> Option<i64> {
        self.0.back().map(|it| it.at_ns)
    }

    /// How it moved between two moments; `None` where that is not known.
    #[must_use]
    pub fn between(&self, start_ns: i64, end_ns: i64) -> Option<Increment> {
        let (from, to) = (self.place(start_ns)?, self.place(end_ns)?);
        let breaks = |it: &&Sample| it.at_ns > start_ns && !it.follows;
        let mut later = self.0.iter().take_while(|it| it.at_ns <= end_ns);
        if later.any(|it| breaks(&it)) {
            return None;
        }
        Some(Increment {
            displacement: seen_from(&from.pose, &to.pose),
            covariance: to.spent - from.spent,
        })
    }

    /// The same as a rate.
    #[must_use]
    pub fn rate(&self, start_ns: i64, end_ns: i64) -> Option<Rate> {
        let increment = self.between(start_ns, end_ns)?;
        let took_s = seconds(end_ns - start_ns);
        (took_s > 0.0).then(|| Rate::of(&increment, took_s))
    }

    fn place(&self, at_ns: i64) -> Option<Sample> {
        let next = self.0.partition_point(|it| it.at_ns < at_ns);
        let after = *self.0.get(next)?;
        if after.at_ns == at_ns {
            return Some(after);
        }
        let before = *self.0.get(next.checked_sub(1)?)?;
        if !after.follows {
            return None;
        }
        let part = seconds(at_ns - before.at_ns) / seconds(after.at_ns - before.at_ns);
        let way = seen_from(&before.pose, &after.pose);
        Some(Sample {
            at_ns,
            pose: moved(&before.pose, &(way * part)),
            spent: before.spent + (after.spent - before.spent) * part,
            follows: true,
        })
    }
}

fn turn(by: f64) -> Matrix2<f64> {
    let (sin, cos) = by.sin_cos();
    Matrix2::new(cos, -sin, sin, cos)
}

fn moved(pose: &Vector3<f64>, by: &Vector3<f64>) -> Vector3<f64> {
    let position = pose.xy() + turn(pose.z) * by.xy();
    Vector3::new(position.x, position.y, pose.z + by.z)
}

fn seen_from(pose: &Vector3<f64>, other: &Vector3<f64>) -> Vector3<f64> {
    let between = turn(-pose.z) * (other.xy() - pose.xy());
    let turned = coloc_estimator::angle::wrap(other.z - pose.z);
    Vector3::new(between.x, between.y, turned)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn leg(x: f64, phi: f64) -> Increment {
        Increment {
            displacement: Vector3::new(x, 0.0, phi),
            covariance: Matrix3::from_diagonal_element(0.01),
        }
    }

    #[test]
    fn what_follows_is_put_together_in_the_frame_of_its_begin() {
        let mut way = Way::default();
        way.moved(0, 100 * MS, &leg(1.0, std::f64::consts::FRAC_PI_2));
        way.moved(100 * MS, 200 * MS, &leg(2.0, 0.0));
        let all = way.between(0, 200 * MS).expect("all of it");
        assert!(
            (all.displacement - Vector3::new(1.0, 2.0, std::f64::consts::FRAC_PI_2)).norm() < 1e-12
        );
        assert!((all.covariance.m11 - 0.02).abs() < 1e-12);
        let half = way.rate(100 * MS, 150 * MS).expect("half of it");
        assert!((half.velocity - Vector3::new(20.0, 0.0, 0.0)).norm() < 1e-9);
        assert!((half.covariance_per_s.m11 - 0.1).abs() < 1e-9);
    }

    #[test]
    fn over_a_gap_and_beyond_the_end_nothing_is_known() {
        let mut way = Way::default();
        way.moved(0, 100 * MS, &leg(1.0, 0.0));
        way.moved(200 * MS, 300 * MS, &leg(1.0, 0.0));
        assert!(way.between(50 * MS, 250 * MS).is_none());
        assert!(way.between(150 * MS, 160 * MS).is_none());
        assert!(way.between(250 * MS, 350 * MS).is_none());
        assert!(way.between(200 * MS, 300 * MS).is_some());
        way.moved(0, 100 * MS, &leg(1.0, 0.0));
        assert_eq!(way.end_ns(), Some(300 * MS), "what was said before counts");
    }

    #[test]
    fn a_frame_that_does_not_jump_is_a_way_too() {
        let mut way = Way::default();
        let per_s = Matrix3::from_diagonal_element(1.0);
        for (time, x) in [(0, 0.0), (20, 0.1), (40, 0.3), (1000, 9.0)] {
            way.at(time * MS, Vector3::new(x, 0.0, 0.0), &per_s);
        }
        let between = way.between(10 * MS, 30 * MS).expect("known");
        assert!((between.displacement.x - 0.15).abs() < 1e-12);
        assert!((between.covariance.m11 - 0.02).abs() < 1e-12);
        assert!(way.between(30 * MS, 1000 * MS).is_none());
    }
}
