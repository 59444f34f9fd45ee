//! A belief in which fixes are linear whatever the heading is.
//!
//! `X = (p, u, b)`: position, direction `u = (cos φ, sin φ)`, and the slow error of the one source that feeds it. Given the
//! wheels, a fix `z = p + b + noise` is linear in X, and the second moments of the wheels' noise are known exactly, so that one
//! Kalman filter on six numbers keeps an exact covariance at any heading: an unknown one is `u ~ (0, ½ I)`.
//!
//! ```text
//! U = C_uu + ū ūᵀ    T = [[t_x, −t_y], [t_y, t_x]]    T_d: likewise of d    D = [[D_tt, d], [dᵀ, q]]
//! p⁺ = p + T u       u⁺ = e^(−q/2) R(Δ) u             b⁺ = a b              C⁺ = F C Fᵀ + N
//! N_pp = (U₁₁ D_tt + U₁₂ (J D_tt + D_tt Jᵀ) + U₂₂ J D_tt Jᵀ)/tr U
//! N_uu = R(Δ) [½ tr U (1 − e^(−2q)) I + (e^(−2q) − e^(−q)) U] R(Δ)ᵀ
//! N_pu = e^(−q/2) T_d U (J R(Δ))ᵀ                     N_bb = σ_s² (1 − a²) I
//! ```

use nalgebra::{Matrix2, Matrix2x6, Matrix6, Vector2, Vector6};

use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::honest::{Circle, Swept};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::Symmetric3;

/// Where p, u and b begin in X.
const P: usize = 0;
const U: usize = 2;
const B: usize = 4;

/// A heading of which nothing is known: σ of the uniform distribution on the circle, π/√3 \[rad\].
pub(crate) const UNKNOWN_HEADING: f64 = 1.813_799_364_234_217_8;

/// What the length of u may miss of one because the wheels' scale is not exact.
const SCALE: f64 = 0.05;

/// A direction whose length is known as well as this tells whether it is one.
const TELLING: f64 = 0.25;

/// A heading known as well as this is a heading \[rad\].
const RESOLVED: f64 = 0.25;

/// J: a quarter of a turn to the left.
const LEFT: Matrix2<f64> = Matrix2::new(0.0, -1.0, 1.0, 0.0);

/// A mean and a covariance of `(p, u, b)`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Lifted {
    mean: Vector6<f64>,
    covariance: Matrix6<f64>,
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
    along: Vector2<f64>,
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
    pub(crate) fn placed(position: [f64; 2], covariance: &Matrix2<f64>) -> Self {
        let mut lifted = Self {
            mean: Vector6::zeros(),
            covariance: Matrix6::zeros(),
        };
        lifted.set_mean(P, Vector2::from(position));
        lifted.set(P, P, covariance);
        lifted.set(U, U, &(0.5 * Matrix2::identity()));
        lifted
    }

    /// At a fix with white noise `white` and a slow error of variance `slow`, looking anywhere.
    pub(crate) fn at_fix(position: [f64; 2], white: &Matrix2<f64>, slow: f64) -> Self {
        let error = slow * Matrix2::identity();
        let mut lifted = Self::placed(position, &(white + error));
        lifted.set(B, B, &error);
        lifted.set_both(P, B, &-error);
        lifted
    }

    /// Exact moments of a belief.
    pub(crate) fn of(belief: &Belief) -> Self {
        let total = belief.total().symmetric();
        let circle = Circle::of(total.pp, 0.0);
        let (sin, cos) = libm::sincos(belief.pose.phi);
        let frame = Matrix2::new(cos, -sin, sin, cos);
        let squares = Matrix2::new(circle.along, 0.0, 0.0, circle.sine);
        let position = Matrix2::new(total.xx, total.xy, total.xy, total.yy);
        let mut lifted = Self::placed([belief.pose.x, belief.pose.y], &position);
        lifted.set_mean(U, circle.mean * frame.column(0));
        lifted.set(U, U, &(frame * squares * frame.transpose()));
        let [[ax, ay, _], [bx, by, _]] = [belief.bend.along, belief.bend.across];
        let (linear_x, linear_y) = (circle.mean * total.xp, circle.mean * total.yp);
        let crossed = Matrix2::new(ax, bx + linear_x, ay, by + linear_y) * frame.transpose();
        lifted.set_both(P, U, &crossed);
        lifted
    }

    /// The same for another source, of whose slow error only the variance is known \[m²\].
    pub(crate) fn for_source(&self, slow: f64) -> Self {
        let mut other = *self;
        other.set_mean(B, Vector2::zeros());
        other.set(B, B, &(slow * Matrix2::identity()));
        other.set_both(P, B, &Matrix2::zeros());
        other.set_both(U, B, &Matrix2::zeros());
        other
    }

    /// A motion passes, `swept` as seen from the heading zero.
    pub(crate) fn step(&mut self, swept: &Swept, wandering: Wandering) {
        let noise = &swept.noise;
        let (sin, cos) = libm::sincos(swept.turn);
        let kept = libm::exp(-0.5 * noise.pp);
        let way = as_complex(swept.way.x, swept.way.y);
        let turn = as_complex(cos, sin);
        let u = self.mean_of(U);
        let second = self.get(U, U) + u * u.transpose();
        self.carry(&way, &(kept * turn), wandering.kept);
        let with_turn = as_complex(noise.xp, noise.yp);
        self.add(P, P, &translated(noise, &second));
        self.add(U, U, &turned(noise.pp, &second, &turn));
        self.add_both(
            P,
            U,
            &(kept * with_turn * second * (LEFT * turn).transpose()),
        );
        self.add(B, B, &(wandering.added * Matrix2::identity()));
    }

    /// `X⁺ = F X`, `C⁺ = F C Fᵀ` with `F = [[I, T, 0], [0, G, 0], [0, 0, a I]]`.
    fn carry(&mut self, way: &Matrix2<f64>, turn: &Matrix2<f64>, kept: f64) {
        let (p, u, b) = (self.mean_of(P), self.mean_of(U), self.mean_of(B));
        self.set_mean(P, p + way * u);
        self.set_mean(U, turn * u);
        self.set_mean(B, kept * b);
        let (pp, pu, pb) = (self.get(P, P), self.get(P, U), self.get(P, B));
        let (uu, ub, bb) = (self.get(U, U), self.get(U, B), self.get(B, B));
        let swung = way * uu;
        let one_way = pu * way.transpose();
        let moved = pp + one_way + one_way.transpose() + swung * way.transpose();
        self.set(P, P, &moved);
        self.set_both(P, U, &((pu + swung) * turn.transpose()));
        self.set_both(P, B, &(kept * (pb + way * ub)));
        self.set(U, U, &(turn * uu * turn.transpose()));
        self.set_both(U, B, &(kept * (turn * ub)));
        self.set(B, B, &(kept * kept * bb));
    }

    /// d² of an own fix with white noise `white`.
    pub(crate) fn distance(&self, position: [f64; 2], white: &Matrix2<f64>) -> f64 {
        let innovation = self.innovation(position);
        quadratic(&(self.seen_by_source() + white), innovation)
    }

    /// After an own fix with white noise `white`, in Joseph's form.
    pub(crate) fn correct(&mut self, position: [f64; 2], white: &Matrix2<f64>) {
        let innovation = self.innovation(position);
        let Some(inverse) = (self.seen_by_source() + white).try_inverse() else {
            return;
        };
        let observed = self.observed();
        let gain = observed.transpose() * inverse;
        let mut left = Matrix6::identity();
        let mut cut = left.fixed_columns_mut::<2>(P);
        cut -= gain;
        let mut cut = left.fixed_columns_mut::<2>(B);
        cut -= gain;
        self.mean += gain * innovation;
        let joseph = left * self.covariance * left.transpose() + gain * white * gain.transpose();
        self.covariance = 0.5 * (joseph + joseph.transpose());
    }

    /// `H C`, `H = [I, 0, I]`.
    fn observed(&self) -> Matrix2x6<f64> {
        self.covariance.fixed_rows::<2>(P) + self.covariance.fixed_rows::<2>(B)
    }

    /// `H C Hᵀ`
    fn seen_by_source(&self) -> Matrix2<f64> {
        let once = self.observed();
        once.fixed_columns::<2>(P) + once.fixed_columns::<2>(B)
    }

    fn innovation(&self, position: [f64; 2]) -> Vector2<f64> {
        Vector2::from(position) - self.mean_of(P) - self.mean_of(B)
    }

    /// p
    pub(crate) fn position(&self) -> [f64; 2] {
        self.mean_of(P).into()
    }

    /// How far it is from a pose \[m\].
    pub(crate) fn distance_from(&self, pose: &Pose) -> f64 {
        let [x, y] = self.position();
        libm::hypot(x - pose.x, y - pose.y)
    }

    /// `C_pp`
    pub(crate) fn position_covariance(&self) -> Matrix2<f64> {
        self.get(P, P)
    }

    /// u
    pub(crate) fn direction(&self) -> Direction {
        let u = self.mean_of(U);
        let length = libm::hypot(u.x, u.y);
        let along = if length > 0.0 {
            u / length
        } else {
            Vector2::x()
        };
        let left = LEFT * along;
        let squares = self.get(U, U);
        Direction {
            along,
            length,
            radial: along.dot(&(squares * along)).max(0.0),
            across: left.dot(&(squares * left)).max(0.0),
        }
    }

    /// The mean pose.
    pub(crate) fn pose(&self) -> Pose {
        let [x, y] = self.position();
        Pose::new(x, y, self.direction().heading())
    }

    /// Of the pose, `L C Lᵀ` with `L = [p; across(u)/min(r, 1)]`.
    pub(crate) fn pose_covariance(&self) -> Symmetric3 {
        let direction = self.direction();
        let crossed = self.get(P, U) * (LEFT * direction.along) / direction.scale();
        Symmetric3 {
            xp: crossed.x,
            yp: crossed.y,
            ..self.unturned_covariance(direction.sigma())
        }
    }

    /// Of a pose whose heading has nothing in common with the position.
    fn unturned_covariance(&self, sigma: f64) -> Symmetric3 {
        let pp = self.get(P, P);
        Symmetric3 {
            xx: pp.m11,
            yy: pp.m22,
            xy: pp.m21,
            pp: sigma * sigma,
            ..Symmetric3::ZERO
        }
    }

    /// What is to be believed of it: a heading that is none may be any. Nothing of it is independent.
    pub(crate) fn as_belief(&self) -> Belief {
        let covariance = if self.direction().is_resolved() {
            self.pose_covariance()
        } else {
            self.unturned_covariance(UNKNOWN_HEADING)
        };
        let parts = Parts::dependent(Covariance3::trusted(&covariance));
        Belief::gaussian(self.pose(), parts)
    }

    /// Whether all of it are numbers.
    pub(crate) fn is_finite(&self) -> bool {
        (self.mean.sum() + self.covariance.sum()).is_finite()
    }

    /// tr of `C_pp`, and of a heading that is as far away as `lever` \[m²\].
    pub(crate) fn size(&self, lever: f64) -> f64 {
        let sigma = self.direction().sigma();
        self.get(P, P).trace() + lever * lever * sigma * sigma
    }

    fn mean_of(&self, at: usize) -> Vector2<f64> {
        self.mean.fixed_rows::<2>(at).into_owned()
    }

    fn set_mean(&mut self, at: usize, value: Vector2<f64>) {
        self.mean.fixed_rows_mut::<2>(at).copy_from(&value);
    }

    fn get(&self, row: usize, column: usize) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(row, column).into_owned()
    }

    fn set(&mut self, row: usize, column: usize, block: &Matrix2<f64>) {
        let mut place = self.covariance.fixed_view_mut::<2, 2>(row, column);
        place.copy_from(block);
    }

    fn set_both(&mut self, row: usize, column: usize, block: &Matrix2<f64>) {
        self.set(row, column, block);
        self.set(column, row, &block.transpose());
    }

    fn add(&mut self, row: usize, column: usize, block: &Matrix2<f64>) {
        let mut place = self.covariance.fixed_view_mut::<2, 2>(row, column);
        place += block;
    }

    fn add_both(&mut self, row: usize, column: usize, block: &Matrix2<f64>) {
        self.add(row, column, block);
        self.add(column, row, &block.transpose());
    }
}

impl Direction {
    /// \[rad\]
    pub(crate) fn heading(&self) -> f64 {
        libm::atan2(self.along.y, self.along.x)
    }

    /// σ of the heading \[rad\]. A u that is too long is so by selection, not because it is known better.
    pub(crate) fn sigma(&self) -> f64 {
        let sigma = libm::sqrt(self.across) / self.scale();
        if sigma < UNKNOWN_HEADING {
            sigma
        } else {
            UNKNOWN_HEADING
        }
    }

    /// No direction at all is one of next to no length.
    fn scale(&self) -> f64 {
        self.length.clamp(f64::MIN_POSITIVE, 1.0)
    }

    /// Whether it is a heading that a belief may begin with.
    pub(crate) fn is_resolved(&self) -> bool {
        self.sigma() <= RESOLVED && self.is_off_by_less(3.0)
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

/// `[[x, −y], [y, x]]`: what a complex number does to others.
fn as_complex(x: f64, y: f64) -> Matrix2<f64> {
    Matrix2::new(x, -y, y, x)
}

/// `N_pp`
fn translated(noise: &Symmetric3, second: &Matrix2<f64>) -> Matrix2<f64> {
    let trace = second.trace();
    if trace <= 0.0 {
        return Matrix2::zeros();
    }
    let Symmetric3 { xx, yy, xy, .. } = *noise;
    let ahead = Matrix2::new(xx, xy, xy, yy);
    let mixed = Matrix2::new(-2.0 * xy, xx - yy, xx - yy, 2.0 * xy);
    let aside = Matrix2::new(yy, -xy, -xy, xx);
    (second.m11 * ahead + second.m12 * mixed + second.m22 * aside) / trace
}

/// `N_uu`
fn turned(q: f64, second: &Matrix2<f64>, turn: &Matrix2<f64>) -> Matrix2<f64> {
    let round = -0.5 * second.trace() * libm::expm1(-2.0 * q);
    let flat = libm::exp(-q) * libm::expm1(-q);
    let noise = round * Matrix2::identity() + flat * second;
    turn * noise * turn.transpose()
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
                lifted.step(&motion.swept(0.0, 0.05), Wandering::NONE);
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
            lifted.step(&motion(k).swept(0.0, 0.1), Wandering::NONE);
            let u = lifted.mean_of(U);
            let second = lifted.get(U, U) + u * u.transpose();
            assert_close(second.trace(), 1.0, "E|u|²");
        }
    }

    fn least_eigenvalue(lifted: &Lifted) -> f64 {
        lifted.covariance.symmetric_eigenvalues().min() / lifted.covariance.trace()
    }

    #[test]
    fn who_drives_and_has_fixes_finds_its_heading() {
        let noise = Matrix2::identity() * 0.01;
        let mut lifted = Lifted::at_fix([0.0, 0.0], &noise, 0.0);
        assert!(!lifted.direction().is_resolved());
        let heading = 2.0;
        let motion = Motion::Nonholonomic {
            velocity: [1.0, 0.0],
            noise: crate::covariance::Covariance2::diagonal([1e-3, 1e-3]).unwrap(),
        };
        for k in 1..=50 {
            lifted.step(&motion.swept(0.0, 0.2), Wandering::NONE);
            let way = 0.2 * f64::from(k);
            let fix = [way * libm::cos(heading), way * libm::sin(heading)];
            assert!(lifted.distance(fix, &noise) < 1.0);
            lifted.correct(fix, &noise);
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
        let mut lifted = Lifted::at_fix([0.0, 0.0], &noise, 0.0);
        for k in 0..50 {
            lifted.step(&motion(k).swept(0.0, 0.2), Wandering::NONE);
            lifted.correct([0.0, 0.0], &noise);
        }
        assert!(lifted.direction().contradicts_wheels());
    }

    /// All of it is forgotten in time and no more than all comes back.
    #[test]
    fn a_slow_error_wanders_within_its_variance() {
        let mut lifted = Lifted::at_fix([0.0, 0.0], &Matrix2::identity(), 4.0);
        let still = Motion::standstill([0.0; 3]);
        for _ in 0..1000 {
            let wandering = Wandering::over(1.0, 4.0, 60.0);
            lifted.step(&still.swept(0.0, 1.0), wandering);
        }
        let error = lifted.get(B, B);
        assert!((error.m11 - 4.0).abs() < 1e-9 && (error.m22 - 4.0).abs() < 1e-9);
        assert!(lifted.get(P, B).norm() < 1e-6);
        assert_eq!(Wandering::over(1.0, 0.0, 60.0), Wandering::NONE);
    }
}
