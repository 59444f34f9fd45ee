//! Fits of a body to the points of a window, by Gauss–Newton on the distances from its surface.
//!
//! A point is off its surface by the noise of its range as far as its ray goes across the surface, and by the noise of its angle as far as
//! it goes along: what was grazed says little about where the surface is. Where both ends of a body were seen in front of something farther,
//! each end lies within one step of the scanner's angle; that tells where along a face its middle is.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::beams::Ray;
use crate::finder::Noise;
use crate::shape::{Body, cross, enter, left_of};

const STEPS: usize = 8;
/// What is farther off than so many σ belongs to something else.
const OUTLIER_SIGMAS: f64 = 3.5;
/// No surface is smoother, for a beam that grazes it \[m\].
const ROUGH_M: f64 = 0.001;
/// A step this small is the last \[m, rad\].
const SETTLED: f64 = 1e-5;

/// A point and the ray that met it.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Sample {
    pub(crate) ray: Ray,
    pub(crate) point: Vector2<f64>,
    pub(crate) range: f64,
}

/// An end of what is seen, in front of something farther: between two beams.
#[derive(Copy, Clone, Debug)]
pub(crate) struct End {
    /// Halfway between.
    pub(crate) ray: Ray,
    /// 1: it is the left end; −1: the right one.
    pub(crate) side: f64,
    /// Of its angle \[rad²\].
    pub(crate) variance: f64,
}

/// A body that was fitted.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) body: Body,
    /// Of x, y and the heading; those of a heading that was not seen are zero.
    pub(crate) covariance: Matrix3<f64>,
    /// Of its length, if it has one.
    pub(crate) heading: Option<f64>,
    /// Sum of squared residuals, each in its σ.
    pub(crate) chi2: f64,
    /// So many more residuals than unknowns.
    pub(crate) freedom: f64,
    /// Of the face that one beam alone met, which says nothing: it may have met two things at once.
    pub(crate) lone: Option<Vector2<f64>>,
}

impl Fit {
    /// Whether a point was used.
    fn uses(&self, sample: &Sample, noise: &Noise) -> bool {
        match self.body {
            Body::Round { centre, radius } => {
                let (off, _, variance) = off_round(sample, centre, radius, noise);
                is_used(off, variance, noise)
            }
            Body::Square {
                centre,
                half,
                along,
            } => {
                let place = Rectangle {
                    centre,
                    half,
                    along,
                    left: left_of(along),
                };
                let met = place.met(sample, noise);
                let is_lone = |lone: Vector2<f64>| lone.dot(&place.axes()[met.face]).abs() > 0.5;
                !self.lone.is_some_and(is_lone) && is_used(met.residual, met.variance, noise)
            }
        }
    }
}

/// Normal equations.
struct Sums {
    information: Matrix3<f64>,
    pull: Vector3<f64>,
    chi2: f64,
    count: f64,
}

impl Sums {
    fn new() -> Self {
        Self {
            information: Matrix3::zeros(),
            pull: Vector3::zeros(),
            chi2: 0.0,
            count: 0.0,
        }
    }

    /// Takes in a residual with its slope in x, y and the heading.
    fn add(&mut self, residual: f64, slope: Vector3<f64>, variance: f64) {
        let weight = 1.0 / variance;
        self.information += slope * slope.transpose() * weight;
        self.pull -= slope * (residual * weight);
        self.chi2 += residual * residual * weight;
        self.count += 1.0;
    }
}

/// Variance of how far a point is off its surface.
pub(crate) fn off_surface(
    noise: &Noise,
    range: f64,
    direction: Vector2<f64>,
    normal: Vector2<f64>,
) -> f64 {
    facing_variance(noise, range, normal.dot(&direction))
}

/// The same, of the cosine between the ray and the normal.
fn facing_variance(noise: &Noise, range: f64, facing: f64) -> f64 {
    let angle = range * noise.angle_sigma_rad;
    let range = noise.range_sigma_m;
    range * range * facing * facing + angle * angle * (1.0 - facing * facing) + ROUGH_M * ROUGH_M
}

/// Whether a point that is so far off its surface belongs to it.
fn is_used(residual: f64, variance: f64, noise: &Noise) -> bool {
    let least = noise.range_sigma_m * noise.range_sigma_m;
    residual * residual <= OUTLIER_SIGMAS * OUTLIER_SIGMAS * variance.max(least)
}

/// How far a point is off a circle, the normal there, and the variance of the first.
fn off_round(
    sample: &Sample,
    centre: Vector2<f64>,
    radius: f64,
    noise: &Noise,
) -> (f64, Vector2<f64>, f64) {
    let off = sample.point - centre;
    let distance = off.norm().max(1e-9);
    let normal = off / distance;
    let variance = off_surface(noise, sample.range, sample.ray.direction, normal);
    (distance - radius, normal, variance)
}

/// A cylinder of this radius.
pub(crate) fn cylinder(samples: &[Sample], radius: f64, noise: &Noise) -> Option<Fit> {
    let middle = samples[samples.len() / 2];
    let mut centre = middle.point + middle.ray.direction * radius;
    let mut is_settled = false;
    for step in 0..STEPS {
        let sums = round_sums(samples, centre, radius, noise, step > 1);
        let moved = plane(&sums)? * sums.pull.xy();
        centre += moved;
        is_settled = moved.norm() < SETTLED;
        if !moved.x.is_finite() || moved.norm() > 4.0 * radius || (is_settled && step > 1) {
            break;
        }
    }
    let sums = round_sums(samples, centre, radius, noise, true);
    let inverse = plane(&sums)?;
    let mut freedom = sums.count - 2.0;
    if freedom < 1.0 || !(is_settled || sums.chi2.is_finite()) {
        freedom = 1.0;
    }
    // A radius that is off moves the middle along the mean of the normals.
    let pushed = round_push(samples, centre, radius, noise);
    let push = inverse * pushed * noise.shape_sigma_m;
    let position = inverse * widened(sums.chi2, freedom) + push * push.transpose();
    let mut covariance = Matrix3::zeros();
    covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&position);
    Some(Fit {
        body: Body::Round { centre, radius },
        covariance,
        heading: None,
        chi2: sums.chi2,
        freedom,
        lone: None,
    })
}

/// Where residuals are larger than their σ, so is what comes of them.
fn widened(chi2: f64, freedom: f64) -> f64 {
    if freedom < 3.0 {
        return 1.0;
    }
    (chi2 / freedom).max(1.0)
}

fn plane(sums: &Sums) -> Option<Matrix2<f64>> {
    let information: Matrix2<f64> = sums.information.fixed_view::<2, 2>(0, 0).into_owned();
    information.try_inverse()
}

fn round_sums(
    samples: &[Sample],
    centre: Vector2<f64>,
    radius: f64,
    noise: &Noise,
    trims: bool,
) -> Sums {
    let mut sums = Sums::new();
    for sample in samples {
        let (residual, normal, variance) = off_round(sample, centre, radius, noise);
        if trims && !is_used(residual, variance, noise) {
            continue;
        }
        sums.add(residual, Vector3::new(-normal.x, -normal.y, 0.0), variance);
    }
    sums
}

fn round_push(
    samples: &[Sample],
    centre: Vector2<f64>,
    radius: f64,
    noise: &Noise,
) -> Vector2<f64> {
    let mut push = Vector2::zeros();
    for sample in samples {
        let (residual, normal, variance) = off_round(sample, centre, radius, noise);
        if is_used(residual, variance, noise) {
            push += normal / variance;
        }
    }
    push
}

/// A rectangle with these halves, along and across, whose length goes about along `start`.
pub(crate) fn rectangle(
    samples: &[Sample],
    ends: &[End],
    half: Vector2<f64>,
    start: (Vector2<f64>, f64),
    noise: &Noise,
) -> Option<Fit> {
    let (mut centre, mut heading) = start;
    for step in 0..STEPS {
        let place = Rectangle::new(centre, half, heading);
        let (sums, _) = place.sums(samples, ends, noise, step > 2, step > 1);
        let moved = sums.information.try_inverse()? * sums.pull;
        let far = moved.x.hypot(moved.y);
        if !far.is_finite() || far > 4.0 * half.norm() {
            return None;
        }
        centre += moved.xy();
        heading += moved.z.clamp(-0.3, 0.3);
        if far.max(moved.z.abs()) < SETTLED && step > 2 {
            break;
        }
    }
    let place = Rectangle::new(centre, half, heading);
    let (sums, lone) = place.sums(samples, ends, noise, true, true);
    let freedom = (sums.count - 3.0).max(1.0);
    let mut covariance = sums.information.try_inverse()? * widened(sums.chi2, freedom);
    let shape = noise.shape_sigma_m * noise.shape_sigma_m;
    covariance[(0, 0)] += shape;
    covariance[(1, 1)] += shape;
    Some(Fit {
        body: Body::Square {
            centre,
            half,
            along: place.along,
        },
        covariance,
        heading: Some(heading),
        chi2: sums.chi2,
        freedom,
        lone,
    })
}

/// A rectangle that stands somewhere.
#[derive(Copy, Clone, Debug)]
struct Rectangle {
    centre: Vector2<f64>,
    half: Vector2<f64>,
    /// Which way its length goes, and to the left of that.
    along: Vector2<f64>,
    left: Vector2<f64>,
}

/// Where a beam has met a rectangle.
#[derive(Copy, Clone, Debug)]
struct MetFace {
    /// Place of its axis.
    face: usize,
    /// −1: it looks the other way.
    sign: f64,
    /// How far the point is off the face, with its variance, and how far to the left of the middle of the axis' face.
    residual: f64,
    variance: f64,
    turn: f64,
}

/// What the points on both faces that look the same way, or the opposite one, say. All of them have the same normal but for its sign, so
/// that of the normal equations five sums are left.
#[derive(Copy, Clone, Debug, Default)]
struct FaceSums {
    /// So many points are on it, whether they are used or not.
    met: usize,
    used: f64,
    chi2: f64,
    weight: f64,
    turn: f64,
    turn_turn: f64,
    pull: f64,
    pull_turn: f64,
}

impl FaceSums {
    fn add(&mut self, met: &MetFace) {
        let MetFace {
            residual,
            sign,
            turn,
            variance,
            ..
        } = *met;
        let weight = 1.0 / variance;
        let (turned, pull) = (weight * turn, weight * sign * residual);
        self.used += 1.0;
        self.chi2 += weight * residual * residual;
        self.weight += weight;
        self.turn += turned;
        self.turn_turn += turned * turn;
        self.pull += pull;
        self.pull_turn += pull * turn;
    }

    /// Adds them to the normal equations: the slope of a residual is −`axis` and its turn.
    fn add_to(&self, sums: &mut Sums, axis: Vector2<f64>) {
        let (plane, mixed) = (axis * axis.transpose() * self.weight, axis * -self.turn);
        sums.information += Matrix3::new(
            plane.m11,
            plane.m12,
            mixed.x,
            plane.m21,
            plane.m22,
            mixed.y,
            mixed.x,
            mixed.y,
            self.turn_turn,
        );
        sums.pull += Vector3::new(axis.x * self.pull, axis.y * self.pull, -self.pull_turn);
        sums.chi2 += self.chi2;
        sums.count += self.used;
    }
}

impl Rectangle {
    fn new(centre: Vector2<f64>, half: Vector2<f64>, heading: f64) -> Self {
        let (sin, cos) = heading.sin_cos();
        let along = Vector2::new(cos, sin);
        Self {
            centre,
            half,
            along,
            left: left_of(along),
        }
    }

    fn own(&self, vector: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(vector.dot(&self.along), vector.dot(&self.left))
    }

    /// The normal equations of all points and ends, and which way the faces go of which one beam alone was met: its point is left out
    /// if `drops`, and those far off their face if `trims`.
    fn sums(
        &self,
        samples: &[Sample],
        ends: &[End],
        noise: &Noise,
        trims: bool,
        drops: bool,
    ) -> (Sums, Option<Vector2<f64>>) {
        let mut faces = [FaceSums::default(); 2];
        for sample in samples {
            let met = self.met(sample, noise);
            faces[met.face].met += 1;
            if !trims || is_used(met.residual, met.variance, noise) {
                faces[met.face].add(&met);
            }
        }
        let axes = self.axes();
        let lone = (0..2).find(|face| faces[*face].met == 1);
        let mut sums = Sums::new();
        for (face, axis) in axes.into_iter().enumerate() {
            if !drops || lone != Some(face) {
                faces[face].add_to(&mut sums, axis);
            }
        }
        for end in ends {
            add_end(&mut sums, end, self);
        }
        (sums, lone.map(|face| axes[face]))
    }

    fn axes(&self) -> [Vector2<f64>; 2] {
        [self.along, self.left]
    }

    #[inline]
    fn met(&self, sample: &Sample, noise: &Noise) -> MetFace {
        let off = self.own(sample.point - self.centre);
        let way = self.own(sample.ray.direction);
        let from = self.own(sample.ray.origin - self.centre);
        let (is_along, sign) = match enter(from, way, self.half) {
            Some(entry) => (entry.is_along, entry.sign),
            None => self.nearest_face(off),
        };
        let (face, depth, half, turn, facing) = if is_along {
            (0, off.x, self.half.x, off.y, way.x)
        } else {
            (1, off.y, self.half.y, -off.x, way.y)
        };
        MetFace {
            face,
            sign,
            turn,
            residual: sign * depth - half,
            variance: facing_variance(noise, sample.range, facing),
        }
    }

    /// To a point beside it.
    fn nearest_face(&self, off: Vector2<f64>) -> (bool, f64) {
        let is_along = off.x.abs() - self.half.x > off.y.abs() - self.half.y;
        let depth = if is_along { off.x } else { off.y };
        (is_along, depth.signum())
    }
}

/// The corner that is farthest to that side is where the end was seen.
fn add_end(sums: &mut Sums, end: &End, place: &Rectangle) {
    let Rectangle {
        centre,
        half,
        along,
        left,
    } = *place;
    let mut farthest: Option<(f64, Vector2<f64>)> = None;
    for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let arm = along * (x * half.x) + left * (y * half.y);
        let to = centre + arm - end.ray.origin;
        let aside = end.side * cross(end.ray.direction, to) / to.norm().max(1e-9);
        if farthest.is_none_or(|(most, _)| aside > most) {
            farthest = Some((aside, arm));
        }
    }
    let Some((_, arm)) = farthest else {
        return;
    };
    let to = centre + arm - end.ray.origin;
    let residual = cross(end.ray.direction, to).atan2(end.ray.direction.dot(&to));
    let slope = left_of(to) / to.norm_squared().max(1e-9);
    let turn = slope.dot(&left_of(arm));
    sums.add(residual, Vector3::new(slope.x, slope.y, turn), end.variance);
}

/// As many as there are.
pub(crate) const STARTS: usize = 4;

/// Where a rectangle may be that has these points: middle and heading, of each of the two ways in which its length may go.
pub(crate) fn rectangle_starts(
    samples: &[Sample],
    half: Vector2<f64>,
) -> impl Iterator<Item = (Vector2<f64>, f64)> {
    let headings = leanings(samples);
    headings.into_iter().flatten().flat_map(move |heading| {
        let (sin, cos) = heading.sin_cos();
        let axes = [Vector2::new(cos, sin), Vector2::new(-sin, cos)];
        let right = std::f64::consts::FRAC_PI_2;
        [
            (middle(samples, axes, [half.x, half.y]), heading),
            (middle(samples, axes, [half.y, half.x]), heading + right),
        ]
    })
}

const DIRECTIONS: usize = 12;

/// Which ways faces go that fit the points best and second best, within a right angle.
fn leanings(samples: &[Sample]) -> [Option<f64>; 2] {
    #[allow(clippy::cast_precision_loss)] // A few.
    let heading = |step: usize| step as f64 * std::f64::consts::FRAC_PI_2 / DIRECTIONS as f64;
    let costs: [f64; DIRECTIONS] = std::array::from_fn(|step| leaning_cost(samples, heading(step)));
    let mut best = [None; 2];
    for step in 0..DIRECTIONS {
        let [before, after] = [DIRECTIONS - 1, 1].map(|by| costs[(step + by) % DIRECTIONS]);
        if costs[step] > before || costs[step] >= after {
            continue;
        }
        let cost = |it: Option<usize>| it.map_or(f64::INFINITY, |it| costs[it]);
        if costs[step] < cost(best[0]) {
            best = [Some(step), best[0]];
        } else if costs[step] < cost(best[1]) {
            best[1] = Some(step);
        }
    }
    best.map(|step| step.map(heading))
}

fn leaning_cost(samples: &[Sample], heading: f64) -> f64 {
    let (sin, cos) = heading.sin_cos();
    let axes = [Vector2::new(cos, sin), Vector2::new(-sin, cos)];
    let spans = axes.map(|axis| span(samples, axis));
    let off = |sample: &Sample| {
        let off = |place: usize| {
            let [low, high] = spans[place];
            let at = sample.point.dot(&axes[place]);
            near(low, high).map_or(f64::INFINITY, |near| (at - near).abs())
        };
        let off = off(0).min(off(1)).min(0.1);
        off * off
    };
    samples.iter().map(off).sum()
}

/// From where to where the points go along an axis.
fn span(samples: &[Sample], axis: Vector2<f64>) -> [f64; 2] {
    let places = samples.iter().map(|it| it.point.dot(&axis));
    places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
        [low.min(it), high.max(it)]
    })
}

/// The end that faces the scanner, unless that stands between both.
fn near(low: f64, high: f64) -> Option<f64> {
    match () {
        () if low > 0.0 => Some(low),
        () if high < 0.0 => Some(high),
        () => None,
    }
}

fn middle(samples: &[Sample], axes: [Vector2<f64>; 2], halves: [f64; 2]) -> Vector2<f64> {
    let spans = axes.map(|axis| span(samples, axis));
    let faces = [0, 1].map(|place| near(spans[place][0], spans[place][1]));
    let off = |sample: &Sample, place: usize| {
        let at = sample.point.dot(&axes[place]);
        faces[place].map_or(f64::INFINITY, |near| (at - near).abs())
    };
    let on_first = samples
        .iter()
        .filter(|sample| off(sample, 0) < off(sample, 1))
        .count();
    let counts = [on_first, samples.len() - on_first];
    let mut middle = Vector2::zeros();
    for place in [0, 1] {
        let [low, high] = spans[place];
        let face = faces[place].filter(|_| counts[place] >= 2);
        let at = face.map_or(0.5 * (low + high), |near| {
            near + near.signum() * halves[place]
        });
        middle += axes[place] * at;
    }
    middle
}

/// How badly a straight line fits the points that a fit has used: its sum of squared residuals, each in its σ.
pub(crate) fn flatness(samples: &[Sample], fit: &Fit, noise: &Noise) -> f64 {
    let used = || samples.iter().filter(|it| fit.uses(it, noise));
    #[allow(clippy::cast_precision_loss)] // At most 2048.
    let count = used().count().max(1) as f64;
    let mean = used().map(|it| it.point).sum::<Vector2<f64>>() / count;
    let mut spread = Matrix2::zeros();
    for sample in used() {
        let off = sample.point - mean;
        spread += off * off.transpose();
    }
    let angle = 0.5 * (2.0 * spread[(0, 1)]).atan2(spread[(0, 0)] - spread[(1, 1)]);
    let normal = Vector2::new(-angle.sin(), angle.cos());
    let residual = |sample: &Sample| {
        let off = normal.dot(&(sample.point - mean));
        off * off / off_surface(noise, sample.range, sample.ray.direction, normal)
    };
    used().map(residual).sum()
}

/// About what one of a thousand good fits exceeds.
pub(crate) fn most_chi2(freedom: f64) -> f64 {
    freedom + 3.3 * (2.0 * freedom).sqrt() + 4.0
}
