//! A belief in which fixes are linear whatever the heading is.
//!
//! `X = (p, u, b)`: position, direction `u = (cos φ, sin φ)`, and the slow error of the one source that feeds it. Given the
//! wheels, a fix `z = p + b + noise` is linear in X, and the second moments of the wheels' noise are known exactly, so that one
//! Kalman filter on six numbers keeps an exact covariance at any heading: an unknown one is `u ~ (0, ½ I)`.
//!
//! ```text
//! U ∝ C_uu + ū ūᵀ, tr U = 1    T = [[t_x, −t_y], [t_y, t_x]]    T_d: likewise of d    D = [[D_tt, d], [dᵀ, q]]
//! p⁺ = p + T u       u⁺ = e^(−q/2) R(Δ) u             b⁺ = a b              C⁺ = F C Fᵀ + N
//! N_pp = U₁₁ D_tt + U₁₂ (J D_tt + D_tt Jᵀ) + U₂₂ J D_tt Jᵀ
//! N_uu = R(Δ) [½ (1 − e^(−2q)) I + (e^(−2q) − e^(−q)) U] R(Δ)ᵀ
//! N_pu = e^(−q/2) T_d U (J R(Δ))ᵀ                     N_bb = σ_s² (1 − a²) I
//! ```
//!
//! The direction has length one, whatever length the filter has come to, and N is the covariance of what the wheels' noise does to such
//! a one: all blocks of one and the same U, or N is none and C loses its sign.
//!
//! The blocks of C are kept as moments of complex numbers ([`super::moments`]), in which T and R are products.
//!
//! An antenna at `l` in the body frame is at `p + l_x u + l_y J u`, as linear: a fix of it is `z = [I, L, I] X + noise`, `L` made of l as
//! T of t. To move X to the antenna and back is the same, and exact.
//!
//! A heading z with noise of variance σ² tells u, in the frame in which z is ahead, `(e, 0)` with the variances of a direction
//! `Ω_a` and `C_b` and `e = exp(−σ²/2)`: what is known of `u` if nothing but z is. Where the direction is known better than that, it tells what
//! lies across it alone, `Jᵀû z/e = Jᵀû u + noise` of variance `sinh σ²`.

use nalgebra::{Matrix2, Matrix2x6, Matrix6, Vector2, Vector6};

use super::circle::Joint;
use super::columns::Columns;
use super::moments::{Crossed, Point, Squared, left};
use super::stride::Stride;
use crate::angle::wrap;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::honest::Circle;
use crate::lever;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::Symmetric3;

/// A heading of which nothing is known: σ of the uniform distribution on the circle, π/√3 \[rad\].
pub(crate) const UNKNOWN_HEADING: f64 = 1.813_799_364_234_217_8;

pub(crate) const UNKNOWN_VARIANCE: f64 = UNKNOWN_HEADING * UNKNOWN_HEADING;

/// What the length of u may miss of one because the wheels' scale is not exact.
const SCALE: f64 = 0.05;

/// What it does if they are calibrated.
const CALIBRATED: f64 = 0.02;

/// A direction whose length is known as well as this tells whether it is one.
const TELLING: f64 = 0.25;

/// A heading known as well as this is a heading \[rad\].
const RESOLVED: f64 = 0.25;

/// A mean and a covariance of `(p, u, b)`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Lifted {
    p: Point,
    u: Point,
    b: Point,
    pp: Squared,
    uu: Squared,
    bb: Squared,
    pu: Crossed,
    pb: Crossed,
    ub: Crossed,
}

/// The slow error of a source over a stretch of time: what is left of it, and what comes.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Wandering {
    /// `a = e^(−dt/τ)`
    pub(crate) kept: f64,
    /// `σ_s² (1 − a²)` \[m²\]
    pub(crate) added: f64,
}

/// A direction, and how well it is known.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Direction {
    /// Of unit length.
    along: Point,
    /// r
    length: f64,
    /// Variance along it.
    radial: f64,
    /// Variance across it.
    across: f64,
}

impl Lifted {
    /// At a position with its covariance \[m, m²\], looking anywhere; nothing is known of the source that will feed it but the
    /// variance of its slow error \[m²\].
    pub(crate) fn placed([x, y]: [f64; 2], covariance: &Matrix2<f64>) -> Self {
        Self {
            p: Point::new(x, y),
            u: Point::new(0.0, 0.0),
            b: Point::new(0.0, 0.0),
            pp: Squared::of(covariance),
            uu: Squared::round(0.5),
            bb: Squared::ZERO,
            pu: Crossed::ZERO,
            pb: Crossed::ZERO,
            ub: Crossed::ZERO,
        }
    }

    /// At a fix with white noise `white` and a slow error of variance `slow`, looking anywhere; the antenna is at `lever`.
    pub(crate) fn at_fix(
        position: [f64; 2],
        lever: [f64; 2],
        white: &Matrix2<f64>,
        slow: f64,
    ) -> Self {
        let error = slow * Matrix2::identity();
        let lifted = Self {
            bb: Squared::of(&error),
            pb: Crossed::of(&-error),
            ..Self::placed(position, &(white + error))
        };
        lifted.at(lever::back(lever))
    }

    /// Of the place at `lever` in the body frame: u and b stay what they are.
    pub(crate) fn at(mut self, lever: [f64; 2]) -> Self {
        if lever::is_none(lever) {
            return self;
        }
        let [forward, left] = lever;
        let away = Point::new(forward, left);
        let (uu, pu, ub) = (self.uu, self.pu, self.ub);
        self.p += away * self.u;
        self.pp.length += 2.0 * (pu.with_conjugate * away.conj()).re + away.norm_sqr() * uu.length;
        self.pp.plain += away * (2.0 * pu.plain + away * uu.plain);
        self.pu.with_conjugate += uu.length * away;
        self.pu.plain += away * uu.plain;
        self.pb.with_conjugate += away * ub.with_conjugate;
        self.pb.plain += away * ub.plain;
        self
    }

    /// Exact moments of a belief. What its bend has in common with the heading itself is none of a direction: it is taken out, of
    /// the position too.
    pub(crate) fn of(belief: &Belief) -> Self {
        let total = belief.total().symmetric();
        let circle = Circle::of(total.pp, 0.0);
        let (sin, cos) = libm::sincos(belief.pose.phi);
        let ahead = Point::new(cos, sin);
        let by_heading = |with_heading: f64| {
            if total.pp > 0.0 {
                with_heading / total.pp
            } else {
                0.0
            }
        };
        let straight = |[x, y, with_heading]: [f64; 3]| {
            let by = by_heading(with_heading);
            [x - by * total.xp, y - by * total.yp]
        };
        let [[ax, ay], [bx, by]] = [belief.bend.along, belief.bend.across].map(straight);
        let linear = circle.mean * Point::new(total.xp, total.yp);
        let (along, across) = (Point::new(ax, ay), Point::new(bx, by) + linear);
        let position = Matrix2::new(total.xx, total.xy, total.xy, total.yy);
        Self {
            u: circle.mean * ahead,
            uu: Squared {
                length: circle.along + circle.sine,
                plain: (circle.along - circle.sine) * (ahead * ahead),
            },
            pu: Crossed {
                with_conjugate: (along - left(across)) * ahead.conj(),
                plain: (along + left(across)) * ahead,
            },
            ..Self::placed([belief.pose.x, belief.pose.y], &position)
        }
    }

    /// The same for another source, of whose slow error only the variance is known \[m²\].
    pub(crate) fn for_source(&self, slow: f64) -> Self {
        Self {
            b: Point::new(0.0, 0.0),
            bb: Squared::round(slow),
            pb: Crossed::ZERO,
            ub: Crossed::ZERO,
            ..*self
        }
    }

    /// A motion passes: `X⁺ = F X`, `C⁺ = F C Fᵀ + N` with `F = [[I, E t, 0], [0, E g, 0], [0, 0, a I]]`.
    #[inline]
    pub(crate) fn step(&mut self, stride: &Stride, wandering: Wandering) {
        let (way, turn, kept) = (stride.way, stride.mean_turn(), wandering.kept);
        let (length, plain) = self.unit();
        let (uu, pu, ub) = (self.uu, self.pu, self.ub);
        self.p += way * self.u;
        self.u *= turn;
        self.b *= kept;
        self.pp = self.translated(stride, length, plain);
        self.uu = Squared {
            length: stride.kept * stride.kept * uu.length + stride.lost * length,
            plain: turn * turn * uu.plain + stride.turn_scatter() * plain,
        };
        self.pu = Crossed {
            with_conjugate: (pu.with_conjugate + uu.length * way) * turn.conj()
                + length * stride.crossed.with_conjugate,
            plain: (pu.plain + way * uu.plain) * turn + plain * stride.crossed.plain,
        };
        self.pb = Crossed {
            with_conjugate: kept * (self.pb.with_conjugate + way * ub.with_conjugate),
            plain: kept * (self.pb.plain + way * ub.plain),
        };
        self.ub = Crossed {
            with_conjugate: kept * (turn * ub.with_conjugate),
            plain: kept * (turn * ub.plain),
        };
        self.bb = Squared {
            length: kept * kept * self.bb.length + 2.0 * wandering.added,
            plain: kept * kept * self.bb.plain,
        };
    }

    /// U: the second moments of u, of a direction of length one.
    #[inline]
    fn unit(&self) -> (f64, Point) {
        let length = self.uu.length + self.u.norm_sqr();
        if length > 0.0 {
            (1.0, (self.uu.plain + self.u * self.u) / length)
        } else {
            (0.0, Point::new(0.0, 0.0))
        }
    }

    /// `C_pp` after a motion; `length` and `plain` are U.
    #[inline]
    fn translated(&self, stride: &Stride, length: f64, plain: Point) -> Squared {
        let Stride { way, added, .. } = stride;
        let (pp, uu, pu) = (self.pp, self.uu, self.pu);
        Squared {
            length: pp.length
                + 2.0 * (pu.with_conjugate * way.conj()).re
                + way.norm_sqr() * uu.length
                + length * added.length,
            plain: pp.plain + way * (2.0 * pu.plain + way * uu.plain) + plain * added.plain,
        }
    }

    /// After a motion in which the source said nothing: what is known of its error stays.
    #[inline]
    pub(crate) fn moved(&self, stride: &Stride) -> Self {
        let mut moved = *self;
        moved.step(stride, Wandering::NONE);
        moved
    }

    /// d² of an own fix with white noise `white`, of the antenna at `lever`.
    pub(crate) fn distance(
        &self,
        position: [f64; 2],
        lever: [f64; 2],
        white: &Matrix2<f64>,
    ) -> f64 {
        let antenna = self.at(lever);
        let innovation = antenna.innovation(position);
        quadratic(&(antenna.seen_by_source() + white), innovation)
    }

    /// After an own fix with white noise `white`, of the antenna at `lever`: `H = [I, L, I]`.
    pub(crate) fn correct(
        &mut self,
        position: [f64; 2],
        [forward, left]: [f64; 2],
        white: &Matrix2<f64>,
    ) {
        let mut observed = Matrix2x6::zeros();
        observed.fixed_columns_mut::<2>(0).fill_diagonal(1.0);
        observed.fixed_columns_mut::<2>(4).fill_diagonal(1.0);
        let turned = Matrix2::new(forward, -left, left, forward);
        observed.fixed_columns_mut::<2>(2).copy_from(&turned);
        let antenna = self.at([forward, left]);
        self.learn(&observed, antenna.innovation(position), white);
    }

    /// After a measurement `H X` with `noise`, off by `innovation`.
    fn learn(&mut self, observed: &Matrix2x6<f64>, innovation: Vector2<f64>, noise: &Matrix2<f64>) {
        let Some(learnt) = Columns::of(&self.covariance()).learn(observed, noise) else {
            return;
        };
        self.add_to_mean(&(learnt.gain * innovation));
        self.set_covariance(&learnt.covariance);
    }

    fn add_to_mean(&mut self, change: &Vector6<f64>) {
        let [px, py, ux, uy, bx, by] = (*change).into();
        self.p += Point::new(px, py);
        self.u += Point::new(ux, uy);
        self.b += Point::new(bx, by);
    }

    /// d² of a heading with noise of variance `error`, one degree of freedom; nothing contradicts a direction that is none.
    pub(crate) fn turn_distance(&self, heading: f64, error: f64) -> f64 {
        let direction = self.direction();
        if !direction.is_resolved() {
            return 0.0;
        }
        let apart = wrap(heading - direction.heading());
        apart * apart / (direction.variance() + error)
    }

    /// After a heading with noise of `variance`.
    pub(crate) fn turn(&mut self, heading: f64, variance: f64) {
        let (sin, cos) = libm::sincos(heading);
        let direction = self.direction();
        let circle = Circle::of(variance, 0.0);
        if direction.variance() < variance {
            let said = Point::new(cos, sin) / circle.mean;
            self.turn_across(left(direction.along), said, libm::sinh(variance));
            return;
        }
        let frame = Matrix2::new(cos, -sin, sin, cos);
        let squares = Matrix2::new(circle.along, 0.0, 0.0, circle.sine);
        let noise = frame * squares * frame.transpose();
        let innovation = circle.mean * Vector2::new(cos, sin) - Vector2::new(self.u.re, self.u.im);
        let mut observed = Matrix2x6::zeros();
        observed.fixed_columns_mut::<2>(2).fill_diagonal(1.0);
        self.learn(&observed, innovation, &noise);
    }

    /// After what was said of the direction `across` the own one, with noise of `variance`.
    fn turn_across(&mut self, across: Point, said: Point, variance: f64) {
        let mut observed = Matrix2x6::zeros(); // The second row is of nothing.
        (observed.m13, observed.m14) = (across.re, across.im);
        let innovation = Vector2::new((across.conj() * (said - self.u)).re, 0.0);
        let noise = Matrix2::new(variance, 0.0, 0.0, 1.0);
        self.learn(&observed, innovation, &noise);
    }

    /// C
    fn covariance(&self) -> Matrix6<f64> {
        let mut all = Matrix6::zeros();
        let mut set = |row: usize, column: usize, block: Matrix2<f64>| {
            all.fixed_view_mut::<2, 2>(row, column).copy_from(&block);
            let other = block.transpose();
            all.fixed_view_mut::<2, 2>(column, row).copy_from(&other);
        };
        set(0, 0, self.pp.matrix());
        set(0, 2, self.pu.matrix());
        set(0, 4, self.pb.matrix());
        set(2, 2, self.uu.matrix());
        set(2, 4, self.ub.matrix());
        set(4, 4, self.bb.matrix());
        all
    }

    fn set_covariance(&mut self, all: &Matrix6<f64>) {
        let block = |row, column| all.fixed_view::<2, 2>(row, column).into_owned();
        self.pp = Squared::of(&block(0, 0));
        self.pu = Crossed::of(&block(0, 2));
        self.pb = Crossed::of(&block(0, 4));
        self.uu = Squared::of(&block(2, 2));
        self.ub = Crossed::of(&block(2, 4));
        self.bb = Squared::of(&block(4, 4));
    }

    /// `H C Hᵀ`, `H = [I, 0, I]`.
    fn seen_by_source(&self) -> Matrix2<f64> {
        let (pp, pb, bb) = (self.pp, self.pb, self.bb);
        let seen = Squared {
            length: pp.length + 2.0 * pb.with_conjugate.re + bb.length,
            plain: pp.plain + 2.0 * pb.plain + bb.plain,
        };
        seen.matrix()
    }

    fn innovation(&self, [x, y]: [f64; 2]) -> Vector2<f64> {
        let seen = self.p + self.b;
        Vector2::new(x - seen.re, y - seen.im)
    }

    /// p
    pub(crate) fn position(&self) -> [f64; 2] {
        [self.p.re, self.p.im]
    }

    /// How far it is from a pose \[m\].
    pub(crate) fn distance_from(&self, pose: &Pose) -> f64 {
        let [x, y] = self.position();
        libm::hypot(x - pose.x, y - pose.y)
    }

    /// `C_pp`
    pub(crate) fn position_covariance(&self) -> Matrix2<f64> {
        self.pp.matrix()
    }

    /// u
    pub(crate) fn direction(&self) -> Direction {
        let length = libm::sqrt(self.u.norm_sqr());
        let along = if length > 0.0 {
            self.u / length
        } else {
            Point::new(1.0, 0.0)
        };
        let [radial, across] = self.uu.along_and_across(along);
        Direction {
            along,
            length,
            radial,
            across,
        }
    }

    /// The mean pose.
    pub(crate) fn pose(&self) -> Pose {
        Pose::new(self.p.re, self.p.im, self.direction().heading())
    }

    /// Of the pose, `L C Lᵀ` with `L = [p; across(u)/min(r, 1)]`.
    pub(crate) fn pose_covariance(&self) -> Symmetric3 {
        let direction = self.direction();
        let aside = left(direction.along);
        let turned = self.pu.plain * aside.conj() + self.pu.with_conjugate * aside;
        let crossed = 0.5 * turned / direction.scale();
        Symmetric3 {
            xp: crossed.re,
            yp: crossed.im,
            ..self.unturned_covariance(direction.variance())
        }
    }

    /// Of a pose whose heading has nothing in common with the position.
    pub(crate) fn unturned_covariance(&self, heading: f64) -> Symmetric3 {
        let pp = self.pp.matrix();
        Symmetric3 {
            xx: pp.m11,
            yy: pp.m22,
            xy: pp.m21,
            pp: heading,
            ..Symmetric3::ZERO
        }
    }

    /// What is to be believed of it: a heading that is none may be any. Nothing of it is independent.
    pub(crate) fn as_belief(&self) -> Belief {
        let covariance = if self.direction().is_resolved() {
            self.pose_covariance()
        } else {
            self.unturned_covariance(UNKNOWN_VARIANCE)
        };
        let parts = Parts::dependent(Covariance3::trusted(&covariance));
        Belief::gaussian(self.pose(), parts)
    }

    /// What is to be believed of it now that its direction, which has length one, is known: `None` as long as it is not.
    pub(crate) fn as_found(&self) -> Option<Belief> {
        let direction = self.direction();
        if !direction.is_resolved() {
            return None;
        }
        let along = Vector2::new(direction.along.re, direction.along.im);
        let joint = Joint {
            position: Vector2::new(self.p.re, self.p.im),
            direction: Vector2::new(self.u.re, self.u.im),
            pp: self.pp.matrix(),
            pu: self.pu.matrix(),
            uu: self.uu.matrix() + CALIBRATED * CALIBRATED * along * along.transpose(),
        };
        let Some(belief) = joint.on_circle(direction.heading(), direction.sigma()) else {
            return Some(self.as_belief());
        };
        (belief.heading_variance() <= RESOLVED * RESOLVED).then_some(belief)
    }

    /// Whether all of it are numbers.
    pub(crate) fn is_finite(&self) -> bool {
        let crossed = [self.pu, self.pb, self.ub];
        let squared = [self.pp, self.uu, self.bb];
        let points = crossed.map(|it| it.with_conjugate + it.plain);
        let sum = self.p + self.u + self.b + points.iter().sum::<Point>();
        squared
            .iter()
            .fold(sum, |sum, it| sum + it.plain + it.length)
            .is_finite()
    }

    /// tr of `C_pp`, and of a heading that is as far away as `lever` \[m²\].
    pub(crate) fn size(&self, lever: f64) -> f64 {
        self.pp.length + lever * lever * self.direction().variance()
    }
}

impl Direction {
    /// \[rad\]
    pub(crate) fn heading(&self) -> f64 {
        libm::atan2(self.along.im, self.along.re)
    }

    /// σ of the heading \[rad\].
    pub(crate) fn sigma(&self) -> f64 {
        libm::sqrt(self.variance())
    }

    /// σ² of the heading \[rad²\]. A u that is too long is so by selection, not because it is known better.
    pub(crate) fn variance(&self) -> f64 {
        let scale = self.scale();
        let variance = self.across / (scale * scale);
        if variance < UNKNOWN_VARIANCE {
            variance
        } else {
            UNKNOWN_VARIANCE
        }
    }

    /// No direction at all is one of next to no length.
    fn scale(&self) -> f64 {
        self.length.clamp(f64::MIN_POSITIVE, 1.0)
    }

    /// Whether it is a heading that a belief may begin with.
    pub(crate) fn is_resolved(&self) -> bool {
        self.variance() <= RESOLVED * RESOLVED && self.is_off_by_less(3.0)
    }

    /// Whether the fixes do not move as the wheels do.
    pub(crate) fn contradicts_wheels(&self) -> bool {
        self.radial < TELLING * TELLING && !self.is_off_by_less(4.0)
    }

    fn is_off_by_less(&self, sigmas: f64) -> bool {
        (self.length - 1.0).abs() < sigmas * libm::sqrt(self.radial + SCALE * SCALE)
    }
}

impl Wandering {
    /// Of a source without a slow error.
    pub(crate) const NONE: Self = Self {
        kept: 1.0,
        added: 0.0,
    };

    /// Over `dt_s` of an error of variance `slow` \[m²\] that is forgotten within `memory_s`.
    pub(crate) fn over(dt_s: f64, slow: f64, memory_s: f64) -> Self {
        if slow <= 0.0 || memory_s <= 0.0 {
            return Self::NONE;
        }
        let left = libm::expm1(-2.0 * dt_s / memory_s);
        Self {
            kept: libm::exp(-dt_s / memory_s),
            added: -left * slow,
        }
    }
}

/// `vᵀ S⁻¹ v`; what is not a number accepts nothing.
pub(crate) fn quadratic(covariance: &Matrix2<f64>, v: Vector2<f64>) -> f64 {
    let inverse = covariance.try_inverse();
    inverse.map_or(f64::NAN, |inverse| v.dot(&(inverse * v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::Belief;
    use crate::covariance::Covariance3;
    use crate::motion::{Motion, propagate};
    use crate::settings::Propagation;

    fn motion(k: u32) -> Motion {
        let k = f64::from(k);
        Motion::Holonomic {
            velocity: [
                1.0 + 0.3 * libm::sin(k),
                0.1 * libm::cos(k),
                libm::sin(0.37 * k),
            ],
            noise: Covariance3::from_row_major([
                0.05, 0.01, 0.002, 0.01, 0.02, 0.001, 0.002, 0.001, 0.04,
            ])
            .unwrap(),
        }
    }

    fn believed(sigma: f64) -> Belief {
        let covariance = Covariance3::from_row_major([
            0.04,
            0.01,
            0.02 * sigma,
            0.01,
            0.09,
            -0.03 * sigma,
            0.02 * sigma,
            -0.03 * sigma,
            sigma * sigma,
        ]);
        Belief::independent(Pose::new(3.0, -2.0, 2.5), covariance.unwrap())
    }

    fn assert_close(a: f64, b: f64, what: &str) {
        assert!(
            (a - b).abs() < 1e-9 * (1.0 + b.abs()),
            "{what}: {a} is not {b}"
        );
    }

    /// Both have exact first and second moments of the position: at any heading, and however far it is driven.
    #[test]
    fn its_position_is_as_uncertain_as_that_of_honest_dead_reckoning() {
        for sigma in [0.01, 0.3, 1.0, 3.0] {
            let mut belief = believed(sigma);
            let mut lifted = Lifted::of(&belief);
            for k in 0..400 {
                let motion = motion(k);
                belief = propagate(&belief, &motion, 0.05, Propagation::Honest);
                lifted.step(&Stride::of(&motion, 0.05), Wandering::NONE);
            }
            let p = belief.total().symmetric();
            let [x, y] = lifted.position();
            let covariance = lifted.position_covariance();
            assert_close(x, belief.pose.x, "x");
            assert_close(y, belief.pose.y, "y");
            assert_close(covariance.m11, p.xx, "xx");
            assert_close(covariance.m12, p.xy, "xy");
            assert_close(covariance.m22, p.yy, "yy");
        }
    }

    /// E|u|² is one, whatever the noise.
    #[test]
    fn a_direction_stays_a_direction() {
        let mut lifted = Lifted::of(&believed(0.5));
        for k in 0..1000 {
            lifted.step(&Stride::of(&motion(k), 0.1), Wandering::NONE);
            assert_close(lifted.uu.length + lifted.u.norm_sqr(), 1.0, "E|u|²");
        }
    }

    fn least_eigenvalue(lifted: &Lifted) -> f64 {
        let covariance = lifted.covariance();
        covariance.symmetric_eigenvalues().min() / covariance.trace()
    }

    /// A fix leaves the bend something in common with the heading itself.
    #[test]
    fn what_a_belief_becomes_is_a_covariance_whatever_its_bend() {
        let mut normal = normals();
        for life in 0..3000 {
            let parts = Parts::dependent(believed(libm::exp(normal())).total());
            let mut belief = Belief::gaussian(Pose::default(), parts);
            for k in 0..6 {
                let turning = Motion::Holonomic {
                    velocity: [5.0 * normal(), normal(), normal()],
                    noise: Covariance3::ZERO,
                };
                belief = propagate(&belief, &turning, 2.0, Propagation::Honest);
                let [a, b] = [(); 2].map(|()| libm::exp(3.0 * normal()));
                let noise = crate::covariance::Covariance2::diagonal([a * a, b * b]).unwrap();
                let [x, y] = [belief.pose.x + a * normal(), belief.pose.y + b * normal()];
                belief = crate::fix::update(&belief, [x, y], &noise, f64::INFINITY).belief;
                let least = least_eigenvalue(&Lifted::of(&belief));
                assert!(least > -1e-14, "{life} {k}: {least}");
            }
        }
    }

    #[test]
    fn who_was_told_where_he_is_and_has_not_driven_believes_that() {
        let noise = [0.01, 0.02, 0.004];
        for k in 0..200 {
            let pose = Pose::new(3.0, -2.0, 0.1 * f64::from(k));
            let told = Belief::independent(pose, Covariance3::diagonal(noise).unwrap());
            let found = Lifted::of(&told).as_found().unwrap();
            let variances = found.total().variances();
            let close = |(a, b): (f64, f64)| (a - b).abs() < 1e-4; // Its length is known too.
            assert!(
                variances.into_iter().zip(noise).all(close),
                "{k}: {variances:?}"
            );
        }
    }

    /// The filter has come to a direction that is too long, and the noise of its way is the noise of its turn.
    #[test]
    fn what_a_motion_adds_is_a_covariance_whatever_the_length_of_the_direction() {
        let column = nalgebra::Vector3::new(0.2, 0.1, 0.3);
        let motion = Motion::Holonomic {
            velocity: [0.0; 3],
            noise: Covariance3::new(column * column.transpose()).unwrap(),
        };
        for length in [0.5, 1.0, 1.5] {
            let mut lifted = Lifted::placed([0.0; 2], &Matrix2::zeros());
            (lifted.u, lifted.uu) = (Point::new(length, 0.0), Squared::ZERO);
            lifted.step(&Stride::of(&motion, 1.0), Wandering::NONE);
            let least = least_eigenvalue(&lifted);
            assert!(least > -1e-14, "{length}: {least}");
        }
    }

    /// Far from where it began, looking anywhere, and then known to a hundredth of a millimetre.
    #[test]
    fn what_a_good_fix_leaves_of_much_is_a_covariance() {
        let noise = Matrix2::identity() * 1e-10;
        for k in 0..50_u32 {
            let mut lifted = Lifted::at_fix([0.0; 2], [0.3, -0.2], &noise, 0.0);
            let ahead = Motion::Nonholonomic {
                velocity: [100.0, 0.1 * f64::from(k)],
                noise: crate::covariance::Covariance2::ZERO,
            };
            lifted.step(&Stride::of(&ahead, 1.0), Wandering::NONE);
            let sharp = Matrix2::new(1e-10, 0.0, 0.0, 1e-16);
            lifted.correct([70.0, 60.0], [0.3, -0.2], &sharp);
            let position = lifted.position_covariance();
            let least = position.symmetric_eigenvalues().min() / position.trace();
            assert!(least > -1e-14, "{k}: {least}");
        }
    }

    #[test]
    fn who_drives_and_has_fixes_finds_its_heading() {
        let noise = Matrix2::identity() * 0.01;
        let mut lifted = Lifted::at_fix([0.0; 2], [0.0; 2], &noise, 0.0);
        assert!(!lifted.direction().is_resolved());
        let heading = 2.0;
        let motion = Motion::Nonholonomic {
            velocity: [1.0, 0.0],
            noise: crate::covariance::Covariance2::diagonal([1e-3, 1e-3]).unwrap(),
        };
        for k in 1..=50 {
            lifted.step(&Stride::of(&motion, 0.2), Wandering::NONE);
            let way = 0.2 * f64::from(k);
            let fix = [way * libm::cos(heading), way * libm::sin(heading)];
            assert!(lifted.distance(fix, [0.0; 2], &noise) < 1.0);
            lifted.correct(fix, [0.0; 2], &noise);
            assert!(least_eigenvalue(&lifted) > -1e-15);
        }
        let direction = lifted.direction();
        assert!(direction.is_resolved() && !direction.contradicts_wheels());
        assert!((direction.heading() - heading).abs() < 3.0 * direction.sigma());
        let believed = lifted.as_belief();
        assert!(believed.total().variances()[2] < 0.01);
    }

    /// The fixes stand while the wheels turn: that is no direction.
    #[test]
    fn fixes_that_do_not_move_as_the_wheels_do_contradict_them() {
        let noise = Matrix2::identity() * 0.01;
        let mut lifted = Lifted::at_fix([0.0; 2], [0.0; 2], &noise, 0.0);
        for k in 0..50 {
            lifted.step(&Stride::of(&motion(k), 0.2), Wandering::NONE);
            lifted.correct([0.0; 2], [0.0; 2], &noise);
        }
        assert!(lifted.direction().contradicts_wheels());
    }

    /// All legs of a way at once, or one after the other.
    #[test]
    fn a_way_of_many_legs_is_one_step() {
        let mut lifted = Lifted::of(&believed(0.5));
        let (whole, mut way) = (lifted, Stride::NONE);
        for k in 0..60 {
            let leg = Stride::of(&motion(k), 0.02);
            lifted.step(&leg, Wandering::NONE);
            way = way.then(&leg);
        }
        let moved = whole.moved(&way);
        assert_close(moved.p.re, lifted.p.re, "x");
        assert_close(moved.u.im, lifted.u.im, "the direction");
        let (a, b) = (moved.covariance(), lifted.covariance());
        a.iter()
            .zip(&b)
            .for_each(|(a, b)| assert_close(*a, *b, "C"));
    }

    /// All of it is forgotten in time and no more than all comes back.
    #[test]
    fn a_slow_error_wanders_within_its_variance() {
        let mut lifted = Lifted::at_fix([0.0; 2], [0.0; 2], &Matrix2::identity(), 4.0);
        let still = Motion::standstill([0.0; 3]);
        for _ in 0..1000 {
            let wandering = Wandering::over(1.0, 4.0, 60.0);
            lifted.step(&Stride::of(&still, 1.0), wandering);
        }
        let error = lifted.bb.matrix();
        assert!((error.m11 - 4.0).abs() < 1e-9 && (error.m22 - 4.0).abs() < 1e-9);
        assert!(lifted.pb.matrix().norm() < 1e-6);
        assert_eq!(Wandering::over(1.0, 0.0, 60.0), Wandering::NONE);
    }

    /// Of mean zero and variance one; splitmix64, Box and Muller.
    fn normals() -> impl FnMut() -> f64 {
        let mut state = 5_u64;
        let mut uniform = move || {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            f64::from(((z ^ (z >> 31)) >> 32) as u32) / 4_294_967_296.0
        };
        move || {
            let (length, turn) = (uniform(), uniform());
            libm::sqrt(-2.0 * libm::log(1.0 - length)) * libm::cos(core::f64::consts::TAU * turn)
        }
    }

    fn mean_of(lifted: &Lifted) -> Vector6<f64> {
        let Lifted { p, u, b, .. } = lifted;
        Vector6::new(p.re, p.im, u.re, u.im, b.re, b.im)
    }

    /// Of many robots drawn from what a belief says, and of what `tells` makes each of them know: the mean square of the error
    /// in units of what is claimed, for position and direction.
    fn mean_square_error(
        sigma: f64,
        tells: impl Fn(&mut Lifted, [f64; 3], &mut dyn FnMut() -> f64),
    ) -> [f64; 4] {
        let mut normal = normals();
        let count = 20_000;
        let mut sums = [0.0; 4];
        for _ in 0..count {
            let [x, y, phi] = [0.2 * normal(), 0.3 * normal(), 2.5 + sigma * normal()];
            let variances = [0.04, 0.09, sigma * sigma];
            let belief = Belief::independent(
                Pose::new(0.0, 0.0, 2.5),
                Covariance3::diagonal(variances).unwrap(),
            );
            let mut lifted = Lifted::of(&belief);
            tells(&mut lifted, [x, y, phi], &mut normal);
            let truth = [x, y, libm::cos(phi), libm::sin(phi)];
            for (at, sum) in sums.iter_mut().enumerate() {
                let error = mean_of(&lifted)[at] - truth[at];
                *sum += error * error / (lifted.covariance()[(at, at)] * f64::from(count));
            }
        }
        sums
    }

    /// The best linear estimate of position and direction: its covariance is that of its error, at any heading.
    #[test]
    fn a_fix_of_an_antenna_off_the_axle_leaves_the_error_that_is_claimed() {
        let (lever, white) = ([1.2, -0.7], Matrix2::identity() * 0.01);
        for sigma in [0.02, 0.3, 1.0] {
            let squares = mean_square_error(sigma, |lifted, [x, y, phi], normal| {
                let (sin, cos) = libm::sincos(phi);
                let at = [x + cos * 1.2 + sin * 0.7, y + sin * 1.2 - cos * 0.7];
                let fix = at.map(|it| it + 0.1 * normal());
                assert!(lifted.distance(fix, lever, &white) < 40.0);
                lifted.correct(fix, lever, &white);
            });
            for square in squares {
                assert!((square - 1.0).abs() < 0.04, "{sigma}: {squares:?}");
            }
        }
    }

    #[test]
    fn a_heading_leaves_the_error_that_is_claimed_to_the_second_order() {
        for (sigma, noise) in [
            (0.02, 0.05),
            (0.3, 0.05),
            (1.0, 0.05),
            (1.0, 0.3),
            (0.1, 0.3),
        ] {
            let squares = mean_square_error(sigma, |lifted, [_, _, phi], normal| {
                lifted.turn(phi + noise * normal(), noise * noise);
            });
            let [x, y, ..] = squares;
            assert!((x - 1.0).abs() < 0.04 && (y - 1.0).abs() < 0.04);
            let [.., cos, sin] = squares;
            assert!(
                cos < 1.25 && sin < 1.25 && cos + sin > 1.5,
                "{sigma} {noise}: {squares:?}"
            );
        }
    }

    /// The same as with `H = [I, L, I]`.
    #[test]
    fn a_lever_only_moves_what_is_seen() {
        let noise = Matrix2::identity() * 0.01;
        let lever = [0.8, 0.3];
        let before = Lifted::at_fix([1.0, 2.0], lever, &noise, 0.25);
        assert_close(
            before.pp.matrix().m11,
            0.01 + 0.25 + 0.5 * (0.64 + 0.09),
            "xx",
        );
        let mut observed = Matrix2x6::zeros();
        observed.fixed_columns_mut::<2>(0).fill_diagonal(1.0);
        observed.fixed_columns_mut::<2>(4).fill_diagonal(1.0);
        observed
            .fixed_columns_mut::<2>(2)
            .copy_from(&Matrix2::new(0.8, -0.3, 0.3, 0.8));
        let sum = observed * before.covariance() * observed.transpose() + noise;
        let gain = before.covariance() * observed.transpose() * sum.try_inverse().unwrap();
        let innovation = Vector2::new(1.3, 1.9) - observed * mean_of(&before);
        let mean = mean_of(&before) + gain * innovation;
        let covariance = before.covariance() - gain * sum * gain.transpose();
        let mut after = before;
        after.correct([1.3, 1.9], lever, &noise);
        assert!((mean_of(&after) - mean).amax() < 1e-12);
        assert!((after.covariance() - covariance).amax() < 1e-12);
    }
}
