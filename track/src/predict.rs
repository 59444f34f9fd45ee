//! What two robots' own motions make of where one is to the other.
//!
//! With `A = C(ψ_j)ᵀ` exactly `p' = A (p + C(φ) t_i − t_j)`, `φ' = φ + ψ_i − ψ_j`: sums of legs work as well as legs. In the linear
//! state the same map is linear, and the noise is of second moments: turns multiply whatever is uncertain.

use coloc_estimator::angle::wrap;
use nalgebra::{Matrix2, Matrix4, Matrix4x3, Vector4};

use crate::increment::Increment;
use crate::plane::{J, turn};
use crate::sensor::SlowErrors;
use crate::state::{Core, SIZE, State, slow_at};

/// Places of slow errors.
const SLOW: usize = SIZE - 4;

impl State {
    /// Both robots moved, and `seconds` passed in which the slow errors forget.
    pub fn predict(
        &mut self,
        observer: &Increment,
        seen: &Increment,
        slow: impl Iterator<Item = SlowErrors>,
        seconds: f64,
    ) {
        match self.core {
            Core::Heading => self.move_heading(observer, seen),
            Core::Linear => self.move_linear(observer, seen),
        }
        for (k, errors) in slow.enumerate().take(self.slow) {
            let SlowErrors {
                range_sigma,
                range_tau_s,
                bearing_sigma,
                bearing_tau_s,
            } = errors;
            self.forget(slow_at(k), range_sigma, seconds / range_tau_s);
            self.forget(slow_at(k) + 1, bearing_sigma, seconds / bearing_tau_s);
        }
        self.symmetrise();
    }

    fn move_heading(&mut self, observer: &Increment, seen: &Increment) {
        let back = turn(observer.turn()).transpose();
        let by_seen = turn(self.mean[2]);
        let way = by_seen * seen.translation();
        let position = back * (self.position() + way - observer.translation());
        let mut map = Matrix4::identity();
        map.fixed_view_mut::<2, 2>(0, 0).copy_from(&back);
        map.fixed_view_mut::<2, 1>(0, 2)
            .copy_from(&(back * J * way));
        self.mean.fixed_rows_mut::<2>(0).copy_from(&position);
        self.mean[2] = wrap(self.mean[2] + seen.turn() - observer.turn());
        let mut by_observer = Matrix4x3::zeros();
        by_observer.fixed_view_mut::<2, 2>(0, 0).copy_from(&-back);
        by_observer
            .fixed_view_mut::<2, 1>(0, 2)
            .copy_from(&-(J * position));
        by_observer[(2, 2)] = -1.0;
        let mut by_neighbour = Matrix4x3::zeros();
        by_neighbour
            .fixed_view_mut::<2, 2>(0, 0)
            .copy_from(&(back * by_seen));
        by_neighbour[(2, 2)] = 1.0;
        self.carry(&map);
        let mut core = self.covariance.fixed_view_mut::<4, 4>(0, 0);
        core += by_observer * observer.covariance * by_observer.transpose()
            + by_neighbour * seen.covariance * by_neighbour.transpose();
    }

    fn move_linear(&mut self, observer: &Increment, seen: &Increment) {
        let back = turn(observer.turn()).transpose();
        let (before, [x, y]) = (self.direction(), seen.translation().into());
        let through = Matrix2::new(x, -y, y, x);
        let turned = turn(seen.turn() - observer.turn());
        // Of the directions that there may be, before they turn.
        let directions = self.direction_covariance() + before * before.transpose();
        let position = back * (self.position() + through * before - observer.translation());
        let mut map = Matrix4::identity();
        map.fixed_view_mut::<2, 2>(0, 0).copy_from(&back);
        map.fixed_view_mut::<2, 2>(0, 2)
            .copy_from(&(back * through));
        map.fixed_view_mut::<2, 2>(2, 2).copy_from(&turned);
        self.mean.fixed_rows_mut::<2>(0).copy_from(&position);
        self.mean
            .fixed_rows_mut::<2>(2)
            .copy_from(&(turned * before));
        self.carry(&map);
        let translations = observer.translation_covariance()
            + scattered(&seen.translation_covariance(), &directions);
        let noise = self.turn_noise(observer, seen);
        let mut core = self.covariance.fixed_view_mut::<4, 4>(0, 0);
        core += noise;
        let mut position = self.covariance.fixed_view_mut::<2, 2>(0, 0);
        position += back * translations * back.transpose();
    }

    /// The covariance after a linear map of position and direction.
    fn carry(&mut self, map: &Matrix4<f64>) {
        let core = map * self.covariance.fixed_view::<4, 4>(0, 0) * map.transpose();
        let with_slow = map * self.covariance.fixed_view::<4, SLOW>(0, 4);
        let mut covariance = self.covariance.fixed_view_mut::<4, 4>(0, 0);
        covariance.copy_from(&core);
        let mut right = self.covariance.fixed_view_mut::<4, SLOW>(0, 4);
        right.copy_from(&with_slow);
        let mut below = self.covariance.fixed_view_mut::<SLOW, 4>(4, 0);
        below.copy_from(&with_slow.transpose());
    }

    /// What the noise of both turns adds to position and direction, to first order in its variances.
    fn turn_noise(&self, observer: &Increment, seen: &Increment) -> Matrix4<f64> {
        let mean: Vector4<f64> = self.mean.fixed_rows::<4>(0).into_owned();
        let second = self.covariance.fixed_view::<4, 4>(0, 0) + mean * mean.transpose();
        let mut both = Matrix4::zeros();
        both.fixed_view_mut::<2, 2>(0, 0).copy_from(&J);
        both.fixed_view_mut::<2, 2>(2, 2).copy_from(&J);
        let mut noise = observer.turn_variance() * (both * second * both.transpose());
        let own = J * second.fixed_view::<2, 2>(2, 2) * J.transpose();
        let mut directions = noise.fixed_view_mut::<2, 2>(2, 2);
        directions += seen.turn_variance() * own;
        noise
    }

    /// A slow error after `elapsed` of its time constants.
    fn forget(&mut self, place: usize, sigma: f64, elapsed: f64) {
        let kept = libm::exp(-elapsed);
        self.mean[place] *= kept;
        self.covariance.row_mut(place).scale_mut(kept);
        self.covariance.column_mut(place).scale_mut(kept);
        self.covariance[(place, place)] += sigma * sigma * (1.0 - kept * kept);
    }
}

/// W: the covariance of `C(φ) n` of a noise n in the neighbour's frame, for directions of these second moments.
fn scattered(noise: &Matrix2<f64>, directions: &Matrix2<f64>) -> Matrix2<f64> {
    let (a, b, c) = (noise.m11, noise.m12, noise.m22);
    let (cc, cs, ss) = (directions.m11, directions.m12, directions.m22);
    let xy = (a - c) * cs + b * (cc - ss);
    Matrix2::new(
        a * cc - 2.0 * b * cs + c * ss,
        xy,
        xy,
        a * ss + 2.0 * b * cs + c * cc,
    )
}
