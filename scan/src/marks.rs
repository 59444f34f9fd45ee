//! Reflective marks: bright beams next to each other are one, and some of them lie as those of a pattern do.

use std::ops::Range;

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use crate::beams::Beams;
use crate::finder::Noise;
use crate::fit::{Fit, most_chi2};
use crate::shape::{Body, Pattern, cross, left_of};
use crate::view::Met;

/// As many marks of a scan are looked at.
pub(crate) const MOST_SEEN: usize = 32;
/// So many marks of a pattern must be seen: two would fit by chance.
const LEAST_MARKS: usize = 3;
/// What a pattern's other marks are off by is their own error and that of the guess, which two marks make: so much more.
const GUESSED: f64 = 1.25;
const SIGMAS: f64 = 4.0;
/// Beams next to each other on one mark end no farther apart \[m\].
const WIDEST_M: f64 = 0.05;

/// A mark that was seen.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Mark {
    /// Its middle beam, and so many there are.
    pub(crate) place: usize,
    pub(crate) beams: usize,
    pub(crate) point: Vector2<f64>,
    covariance: Matrix2<f64>,
}

impl Mark {
    fn sigma(&self) -> f64 {
        self.covariance.trace().sqrt()
    }
}

/// Finds the marks of a scan; those that `matters` does not care for are passed over. How many more there were than fit.
pub(crate) fn find(
    beams: &Beams,
    bright: f32,
    radius_m: f64,
    noise: &Noise,
    marks: &mut Vec<Mark>,
    matters: impl Fn(Vector2<f64>) -> bool,
) -> u64 {
    marks.clear();
    let mut left_out = 0;
    // Where the scanner sees all round, a mark may lie across the first beam: the round begins beside it.
    let is_dark = |place: &usize| beams.intensity(*place) < bright;
    let begin = (0..beams.count()).find(is_dark);
    let begin = begin.filter(|_| beams.is_round()).unwrap_or(0);
    let end = begin + beams.count();
    let mut place = begin;
    while place < end {
        let count = bright_from(beams, place..end, bright);
        if count == 0 {
            place += 1;
            continue;
        }
        match mark(beams, place, count, radius_m, noise).filter(|mark| matters(mark.point)) {
            Some(mark) if marks.len() < MOST_SEEN => marks.push(mark),
            Some(_) => left_out += 1,
            None => {}
        }
        place += count;
    }
    left_out
}

fn bright_from(beams: &Beams, rest: Range<usize>, bright: f32) -> usize {
    let mut before: Option<Vector2<f64>> = None;
    rest.take_while(|place| {
        let point = beams.point(*place);
        let is_near = before.is_none_or(|before| {
            point.is_some_and(|it| {
                (it - before).norm() < WIDEST_M.max(2.0 * beams.step_rad() * it.norm())
            })
        });
        before = point;
        point.is_some() && beams.intensity(*place) >= bright && is_near
    })
    .count()
}

fn mark(beams: &Beams, first: usize, count: usize, radius_m: f64, noise: &Noise) -> Option<Mark> {
    let last = first + count - 1;
    let (a, b) = (beams.point(first)?, beams.point(last)?);
    let ranges = (first..=last).filter_map(|place| match beams.met(place) {
        Met::Surface(range) => Some(range),
        _ => None,
    });
    #[allow(clippy::cast_precision_loss)] // At most 2048.
    let many = count as f64;
    // In the mean a beam meets a pole so much before its middle, and this far off that.
    let (depth, spread) = (std::f64::consts::FRAC_PI_4 * radius_m, 0.22 * radius_m);
    let range = ranges.sum::<f64>() / many + depth;
    let direction = (a.normalize() + b.normalize()).normalize();
    // Each end of it lies between two beams.
    let angle =
        beams.step_rad() * beams.step_rad() / 12.0 + noise.angle_sigma_rad * noise.angle_sigma_rad;
    let (along, across) = (
        (noise.range_sigma_m * noise.range_sigma_m + spread * spread) / many,
        // One that is half hidden has its middle elsewhere.
        range * range * angle + 0.08 * radius_m * radius_m,
    );
    let left = left_of(direction);
    Some(Mark {
        place: first + count / 2,
        beams: count,
        point: direction * range,
        covariance: direction * direction.transpose() * along + left * left.transpose() * across,
    })
}

/// A pattern that was found.
pub(crate) struct Found {
    pub(crate) fit: Fit,
    /// The middle beam of one of its marks, and the beams of all.
    pub(crate) middle: usize,
    pub(crate) beams: usize,
    /// Which marks of the scan are its own.
    pub(crate) of: [Option<usize>; crate::shape::MOST_MARKS],
}

/// Where a pattern stands, if enough of its marks were seen.
pub(crate) fn fit(marks: &[Mark], pattern: &Pattern, noise: &Noise) -> Option<Found> {
    let mut best: Option<(Matched, Fit)> = None;
    for (a, one) in marks.iter().enumerate() {
        for (_, other) in marks.iter().enumerate().filter(|(b, _)| *b != a) {
            for (i, j) in pairs(pattern.marks().len()) {
                let [from, to] = [i, j].map(|it| Vector2::from(pattern.marks()[it]));
                let apart = (other.point - one.point).norm();
                let slack = SIGMAS * (one.sigma() + other.sigma() + noise.shape_sigma_m);
                if (apart - (to - from).norm()).abs() > slack {
                    continue;
                }
                let guess = placed([one.point, other.point], [from, to]);
                let matched = matched(marks, pattern, guess, noise);
                let least = best.as_ref().map_or(LEAST_MARKS, |(it, _)| it.count);
                if matched.count < least {
                    continue;
                }
                let fit = refined(marks, pattern, &matched, noise)
                    .filter(|fit| fit.chi2 <= most_chi2(fit.freedom));
                let is_better = |fit: &Fit| {
                    best.as_ref()
                        .is_none_or(|(it, old)| matched.count > it.count || fit.chi2 < old.chi2)
                };
                if let Some(fit) = fit.filter(is_better) {
                    best = Some((matched, fit));
                }
            }
        }
    }
    let (matched, fit) = best?;
    let first = matched.of.iter().flatten().next()?;
    let beams = matched.of.iter().flatten().map(|it| marks[*it].beams).sum();
    Some(Found {
        fit,
        middle: marks[*first].place,
        beams,
        of: matched.of,
    })
}

fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    let all = (0..count).flat_map(move |i| (0..count).map(move |j| (i, j)));
    all.filter(|(i, j)| i < j)
}

/// The pose that brings a pair of a pattern to where a pair was seen.
fn placed(seen: [Vector2<f64>; 2], pair: [Vector2<f64>; 2]) -> Vector3<f64> {
    let (seen_way, way) = (seen[1] - seen[0], pair[1] - pair[0]);
    let heading = cross(way, seen_way).atan2(way.dot(&seen_way));
    let middle = (seen[0] + seen[1]) * 0.5 - turned((pair[0] + pair[1]) * 0.5, heading);
    Vector3::new(middle.x, middle.y, heading)
}

fn turned(point: Vector2<f64>, heading: f64) -> Vector2<f64> {
    let (sin, cos) = heading.sin_cos();
    Vector2::new(cos * point.x - sin * point.y, sin * point.x + cos * point.y)
}

/// Which mark of the scan is which of the pattern.
struct Matched {
    of: [Option<usize>; crate::shape::MOST_MARKS],
    count: usize,
    pose: Vector3<f64>,
}

fn matched(marks: &[Mark], pattern: &Pattern, pose: Vector3<f64>, noise: &Noise) -> Matched {
    let mut of = [None; crate::shape::MOST_MARKS];
    let mut count = 0;
    for (own, of) in pattern.marks().iter().zip(&mut of) {
        let expected = pose.xy() + turned(Vector2::from(*own), pose.z);
        let off = |mark: &Mark| (mark.point - expected).norm();
        let nearest = marks
            .iter()
            .enumerate()
            .min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
        let is_near =
            |mark: &Mark| off(mark) <= GUESSED * SIGMAS * (mark.sigma() + noise.shape_sigma_m);
        *of = nearest
            .filter(|(_, mark)| is_near(mark))
            .map(|(place, _)| place);
        count += usize::from(of.is_some());
    }
    Matched { of, count, pose }
}

fn refined(marks: &[Mark], pattern: &Pattern, matched: &Matched, noise: &Noise) -> Option<Fit> {
    let mut pose = matched.pose;
    let mut last = None;
    for _ in 0..4 {
        let (mut information, mut pull, mut chi2) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (own, of) in pattern.marks().iter().zip(matched.of) {
            let Some(mark) = of.map(|it| &marks[it]) else {
                continue;
            };
            let arm = turned(Vector2::from(*own), pose.z);
            let residual = mark.point - pose.xy() - arm;
            let swing = left_of(arm);
            let slope = Matrix2x3::new(1.0, 0.0, swing.x, 0.0, 1.0, swing.y);
            let shape = Matrix2::identity() * (noise.shape_sigma_m * noise.shape_sigma_m);
            let weight = (mark.covariance + shape).try_inverse()?;
            information += slope.transpose() * weight * slope;
            pull += slope.transpose() * weight * residual;
            chi2 += (residual.transpose() * weight * residual)[0];
        }
        let covariance = information.try_inverse()?;
        pose += covariance * pull;
        last = Some((covariance, chi2));
    }
    let (covariance, chi2) = last?;
    #[allow(clippy::cast_precision_loss)] // At most 8.
    let freedom = 2.0 * matched.count as f64 - 3.0;
    let reach = pattern
        .marks()
        .iter()
        .map(|[x, y]| x.hypot(*y))
        .fold(0.0, f64::max);
    Some(Fit {
        body: Body::Round {
            centre: pose.xy(),
            radius: reach,
        },
        covariance,
        heading: Some(pose.z),
        chi2,
        freedom,
        lone: None,
    })
}
