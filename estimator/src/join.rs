//! Many odometry samples as few: their motions one after the other, as one displacement.
//!
//! After a stall there are more samples than a tick, or the history, has room for. One mean velocity is not the same: in
//! a turn it cuts the corner, and its noise is that of one step. So the samples are gone through with Algorithm 1 itself,
//! from a pose that is certain; where that ends, and how uncertain, is the displacement of the joined sample and its
//! noise:
//!
//! ```text
//! t, Δ, D = mean and covariance of 0 ⊕ δ₁ ⊕ … ⊕ δ_N        velocity d/T, noise D_0/(T₀ T), T: time from end to end
//! ```
//!
//! with d and `D_0` those of the arc that leads there ([`crate::honest`]; of the paper's letter, t and D themselves). The
//! robot is then where the single steps would have taken it, as uncertain, to rounding, whatever it knew of its heading
//! (of the paper's letter, to the fourth order of its heading's σ). Which part of it is dependent, and the bend, differ by what the
//! joined samples' own noise bends. A measurement in the middle of a joined sample finds the robot on the arc from end to end,
//! so [`join`] makes no sample longer than it must be.

use crate::belief::Belief;
use crate::honest::Increments;
use crate::kind::OdometrySample;
use crate::motion::{Motion, propagate};
use crate::settings::{Propagation, Settings};
use crate::stamp::Span;

/// Puts `samples` into at most `most` places at the front, and says how many these are: neighbours are joined, evenly, until
/// they fit. More than `most` are left where samples do not follow one upon the other: across a gap, or from
/// one source to the next, nothing is joined.
///
/// `samples` are in the order of time; what is behind those that are left is of no use any more.
pub fn join(samples: &mut [OdometrySample], most: usize, settings: &Settings) -> usize {
    let each = samples.len().div_ceil(most.max(1)).max(1);
    let (mut taken, mut left) = (0, 0);
    while let Some(rest) = samples.get(taken..).filter(|rest| !rest.is_empty()) {
        let count = consecutive(rest).min(each);
        let one = rest.get(..count).and_then(|run| joined(run, settings));
        if let (Some(one), Some(place)) = (one, samples.get_mut(left)) {
            *place = one;
            left += 1;
        }
        taken += count;
    }
    left
}

/// How many of `samples`, from the first on, follow one upon the other.
fn consecutive(samples: &[OdometrySample]) -> usize {
    let pairs = samples.iter().zip(samples.iter().skip(1));
    1 + pairs.take_while(|(one, next)| follows(one, next)).count()
}

fn follows(one: &OdometrySample, next: &OdometrySample) -> bool {
    one.source == next.source && one.stamp == next.start
}

/// The one sample that moves a robot as `samples` do; `None` if there is none, or they do not follow one upon the other.
#[must_use]
pub fn joined(samples: &[OdometrySample], settings: &Settings) -> Option<OdometrySample> {
    let (first, last) = (samples.first()?, samples.last()?);
    if samples.len() == 1 {
        return Some(*first); // As it is, to the last bit.
    }
    if consecutive(samples) < samples.len() {
        return None;
    }
    Some(OdometrySample {
        start: first.start,
        motion: mean_motion(samples, last.stamp - first.start, settings),
        ..*last
    })
}

/// The velocity and noise that over `span` make the displacement of all the samples.
fn mean_motion(samples: &[OdometrySample], span: Span, settings: &Settings) -> Motion {
    let odometry = &settings.odometry;
    let mut turn = 0.0;
    let moved = samples.iter().fold(Belief::default(), |belief, sample| {
        let dt = sample.stamp - sample.start;
        let [.., omega] = sample.motion.velocity();
        turn += omega * dt.as_seconds(); // Beyond π too.
        let motion = odometry.measured(&sample.motion, dt);
        propagate(&belief, &motion, dt.as_seconds(), settings.propagation)
    });
    let whole = Increments {
        translation: [moved.pose.x, moved.pose.y],
        turn,
        noise: moved.total(),
    };
    let (held, noise) = match settings.propagation {
        Propagation::Honest => whole.held(),
        Propagation::Paper => ([moved.pose.x, moved.pose.y, turn], whole.noise),
    };
    let (period_s, span_s) = (odometry.reference_period.as_seconds(), span.as_seconds());
    Motion::Holonomic {
        velocity: held.map(|it| it / span_s),
        noise: noise.scaled(1.0 / (period_s * span_s)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::{Covariance2, Covariance3};
    use crate::parts::Parts;
    use crate::pose::Pose;
    use crate::stamp::Stamp;

    const PERIOD: Span = Span::from_millis(5);

    /// `count` samples of a robot that turns ever faster, of uneven lengths.
    fn winding<const N: usize>() -> [OdometrySample; N] {
        let mut start = Stamp::from_nanos(7);
        let mut wave = 0.0;
        core::array::from_fn(|index| {
            let uneven = Span::from_nanos(1 + 700_000 * i64::try_from(index % 3).unwrap());
            let stamp = start + PERIOD + uneven;
            wave += 0.1;
            let velocity = [1.0 + 0.5 * libm::sin(wave), 4.0 * libm::cos(0.3 * wave)];
            let noise = Covariance2::from_row_major([0.04, 0.002, 0.002, 0.01]).unwrap();
            let motion = Motion::Nonholonomic { velocity, noise };
            let sample = OdometrySample {
                source: 3,
                start,
                stamp,
                motion,
            };
            start = stamp;
            sample
        })
    }

    fn stepped(belief: Belief, samples: &[OdometrySample]) -> Belief {
        stepped_by(&Settings::default(), belief, samples)
    }

    fn stepped_by(settings: &Settings, belief: Belief, samples: &[OdometrySample]) -> Belief {
        samples.iter().fold(belief, |belief, sample| {
            let dt = sample.stamp - sample.start;
            let motion = settings.odometry.measured(&sample.motion, dt);
            propagate(&belief, &motion, dt.as_seconds(), settings.propagation)
        })
    }

    /// The largest difference of positions and headings, and of covariances' entries relative to the σ concerned.
    fn difference(one: &Belief, other: &Belief) -> [f64; 2] {
        let (a, b) = (one.pose, other.pose);
        let heading = crate::angle::wrap(a.phi - b.phi);
        let mean = [a.x - b.x, a.y - b.y, heading].into_iter();
        let mut relative: f64 = 0.0;
        let (p, q) = (one.total().matrix(), other.total().matrix());
        for i in 0..3 {
            for j in 0..3 {
                let scale = libm::sqrt(q[(i, i)] * q[(j, j)]);
                relative = relative.max((p[(i, j)] - q[(i, j)]).abs() / scale);
            }
        }
        [mean.fold(0.0, |m: f64, d| m.max(d.abs())), relative]
    }

    fn start(sigma: f64) -> Belief {
        let total = Covariance2::diagonal([0.01, sigma * sigma]).unwrap();
        let [xx, .., pp] = total.to_row_major();
        let covariance = Covariance3::diagonal([xx, xx, pp]).unwrap();
        let parts = Parts {
            independent: covariance.scaled(0.25),
            dependent: covariance.scaled(0.75),
        };
        Belief::gaussian(Pose::new(3.0, -2.0, 2.5), parts)
    }

    #[test]
    fn from_a_pose_that_is_certain_it_is_the_single_steps_to_rounding() {
        let samples = winding::<400>();
        let one = [joined(&samples, &Settings::default()).unwrap()];
        let [singly, at_once] = [&samples[..], &one].map(|way| stepped(Belief::default(), way));
        let [mean, spread] = difference(&at_once, &singly);
        assert!(mean < 1e-13 && spread < 1e-12, "{mean:e} {spread:e}");
        assert_eq!(
            (one[0].start, one[0].stamp),
            (samples[0].start, samples[399].stamp)
        );
    }

    /// 2.3 s and 2.6 m of way in sharp turns, as one sample and as forty. As forty but for what bends within each.
    #[test]
    fn from_one_that_is_not_it_is_them_to_rounding_too() {
        let samples = winding::<400>();
        for (sigma, most, allowed) in [
            (0.01, 1, 1e-11),
            (0.1, 1, 1e-11),
            (1.0, 1, 1e-11),
            (0.1, 40, 1e-7),
            (3.0, 7, 1e-9),
        ] {
            let mut few = samples;
            let count = join(&mut few, most, &Settings::default());
            let [singly, joined] =
                [&samples[..], &few[..count]].map(|way| stepped(start(sigma), way));
            let [mean, spread] = difference(&joined, &singly);
            assert!(
                mean < 1e-13 && spread < allowed,
                "{sigma}, {most}: {mean:e} {spread:e}"
            );
        }
    }

    #[test]
    fn on_paper_it_is_them_to_the_fourth_order_of_the_headings_sigma() {
        let (samples, paper) = (winding::<400>(), Settings::paper());
        for (sigma, most, allowed) in [
            (0.0, 1, [2e-8, 5e-5]),
            (0.01, 1, [2e-8, 5e-5]),
            (0.1, 1, [3e-5, 2e-2]),
            (0.1, 40, [3e-5, 2e-2]),
        ] {
            let mut few = samples;
            let count = join(&mut few, most, &paper);
            let [singly, joined] =
                [&samples[..], &few[..count]].map(|way| stepped_by(&paper, start(sigma), way));
            let found = difference(&joined, &singly);
            assert!(
                found[0] < allowed[0] && found[1] < allowed[1],
                "{sigma}, {most}: {found:?}"
            );
        }
    }

    #[test]
    fn one_mean_velocity_is_not_the_same() {
        let samples = winding::<400>();
        let way: f64 = samples
            .iter()
            .map(|s| s.motion.velocity()[0] * (s.stamp - s.start).as_seconds())
            .sum();
        let end = stepped(Belief::default(), &samples).pose;
        let straight = libm::hypot(end.x, end.y);
        assert!(straight < 0.9 * way, "{straight} m for {way} m");
    }

    #[test]
    fn samples_are_joined_evenly_until_they_fit() {
        let mut samples = winding::<10>();
        let before = samples;
        assert_eq!(join(&mut samples, 10, &Settings::default()), 10);
        assert_eq!(samples, before, "what fits is left alone to the bit");
        assert_eq!(join(&mut samples, 4, &Settings::default()), 4);
        let left = samples.get(..4).unwrap();
        assert!(
            left.iter()
                .zip(left.iter().skip(1))
                .all(|(a, b)| a.stamp == b.start)
        );
        assert_eq!(
            [left[0].start, left[3].stamp],
            [before[0].start, before[9].stamp]
        );
        let belief = start(0.0);
        let [mean, spread] = difference(&stepped(belief, left), &stepped(belief, &before));
        assert!(mean < 1e-13 && spread < 1e-9, "{mean:e} {spread:e}");
    }

    #[test]
    fn across_a_gap_or_from_source_to_source_nothing_is_joined() {
        let settings = Settings::default();
        let mut samples = winding::<6>();
        samples[2].start = samples[2].start + Span::from_nanos(1);
        samples[4].source = 9;
        samples[5].source = 9;
        assert_eq!(joined(&samples, &settings), None);
        assert_eq!(join(&mut samples, 1, &settings), 3);
        assert_eq!(join(&mut [], 1, &settings), 0);
        assert_eq!(joined(&[], &settings), None);
    }
}
