//! The pseudo-linear filter, (5.1) to (5.8).

use core::f64::consts::PI;

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};

use crate::increment::Increment;
use crate::plane::{J, sight, turn};
use crate::reading::Reading;
use crate::rules::Rules;
use crate::sensor::Sensors;
use crate::state::{Core, Covariance, SIZE, State};
use crate::update::{FLOOR, Gates, Linearised, Outcome};

/// PLKF as printed: its noise across the line of sight is that at the range that is estimated.
#[derive(Copy, Clone, Debug, Default)]
pub struct Printed;

/// Euler's step of `seconds`, (5.1), with velocities in each robot's own frame and the process noise Q.
pub fn euler(
    state: &mut State,
    observer: &Vector3<f64>,
    seen: &Vector3<f64>,
    noise: &Matrix3<f64>,
    seconds: f64,
) {
    let way = turn(state.mean[2]) * seen.xy();
    let velocity = way - observer.xy() - J * state.position() * observer.z;
    let mut slope = Covariance::zeros();
    slope
        .fixed_view_mut::<2, 2>(0, 0)
        .copy_from(&(-J * observer.z));
    slope.fixed_view_mut::<2, 1>(0, 2).copy_from(&(J * way));
    let map = Covariance::identity() + slope * seconds;
    let mut position = state.mean.fixed_rows_mut::<2>(0);
    position += velocity * seconds;
    state.mean[2] = wrap(state.mean[2] + (seen.z - observer.z) * seconds);
    state.covariance = map * state.covariance * map.transpose();
    let mut pose = state.covariance.fixed_view_mut::<3, 3>(0, 0);
    pose += noise;
    state.symmetrise();
}

/// What both robots' own noise is in the state: `G_j D_j G_jᵀ + G_i D_i G_iᵀ`.
#[must_use]
pub fn process_noise(state: &State, observer: &Matrix3<f64>, seen: &Matrix3<f64>) -> Matrix3<f64> {
    let position = state.position();
    let mut by_observer = -Matrix3::identity();
    by_observer.m13 = position.y;
    by_observer.m23 = -position.x;
    let mut by_seen = Matrix3::identity();
    by_seen
        .fixed_view_mut::<2, 2>(0, 0)
        .copy_from(&turn(state.mean[2]));
    by_observer * observer * by_observer.transpose() + by_seen * seen * by_seen.transpose()
}

/// [`euler`], of increments.
pub(super) fn move_on(state: &mut State, observer: &Increment, seen: &Increment, seconds: f64) {
    if seconds <= 0.0 {
        return;
    }
    let noise = process_noise(state, &observer.covariance, &seen.covariance);
    let [own, other] = [observer, seen].map(|it| it.displacement / seconds);
    euler(state, &own, &other, &noise, seconds);
}

/// A track that knows where the first reading puts it, and of its heading that it is any about zero.
pub(super) fn begun(range_m: f64, bearing_rad: f64, white: [f64; 2], mount: Pose) -> State {
    let rows = sight(bearing_rad + mount.phi);
    let mut state = State {
        core: Core::Heading,
        ..State::default()
    };
    let position = Vector2::new(mount.x, mount.y) + rows.transpose() * Vector2::new(range_m, 0.0);
    state.mean.fixed_rows_mut::<2>(0).copy_from(&position);
    let across = (range_m * range_m * white[1]).max(FLOOR);
    let noise = rows.transpose() * Matrix2::new(white[0], 0.0, 0.0, across) * rows;
    state
        .covariance
        .fixed_view_mut::<2, 2>(0, 0)
        .copy_from(&noise);
    state.covariance[(2, 2)] = PI * PI / 3.0;
    state
}

impl Printed {
    /// (5.3) to (5.8): `P − K H P`, R of the estimate.
    pub fn learn(
        &self,
        state: &mut State,
        range_m: f64,
        bearing_rad: f64,
        white: [f64; 2],
        mount: &Pose,
    ) -> Outcome {
        let rows = sight(bearing_rad + mount.phi);
        let across = (state.position().norm_squared() * white[1]).max(FLOOR);
        let mut slopes = SMatrix::<f64, 2, SIZE>::zeros();
        slopes.fixed_view_mut::<2, 2>(0, 0).copy_from(&rows);
        let measured = Vector2::new(range_m, 0.0) + rows * Vector2::new(mount.x, mount.y);
        let linearised = Linearised {
            slopes,
            innovation: measured - slopes * state.mean,
            noise: Matrix2::new(white[0], 0.0, 0.0, across),
        };
        learn(state, &linearised)
    }
}

/// Kalman's update with `P − K H P`.
pub(super) fn learn(state: &mut State, linearised: &Linearised<2>) -> Outcome {
    let Linearised {
        slopes,
        innovation,
        noise,
    } = linearised;
    let spread = slopes * state.covariance * slopes.transpose() + noise;
    let Some(inverse) = spread.try_inverse() else {
        return Outcome {
            accepted: false,
            d2: f64::INFINITY,
        };
    };
    let gain = state.covariance * slopes.transpose() * inverse;
    state.mean += gain * innovation;
    state.mean[2] = wrap(state.mean[2]);
    state.covariance -= gain * slopes * state.covariance;
    state.symmetrise();
    Outcome {
        accepted: true,
        d2: innovation.dot(&(inverse * innovation)),
    }
}

impl Rules for Printed {
    fn start(
        &self,
        range_m: f64,
        bearing_rad: f64,
        white: [f64; 2],
        sensors: &Sensors,
        index: usize,
    ) -> State {
        let mount = sensors.get(index).map(|it| it.mount).unwrap_or_default();
        begun(range_m, bearing_rad, white, mount)
    }

    fn predict(
        &self,
        state: &mut State,
        observer: &Increment,
        seen: &Increment,
        _: &Sensors,
        seconds: f64,
    ) {
        move_on(state, observer, seen, seconds);
    }

    fn update(
        &self,
        state: &mut State,
        reading: &Reading,
        sensors: &Sensors,
        index: usize,
        _: &Gates,
    ) -> Outcome {
        let mount = sensors.get(index).map(|it| it.mount).unwrap_or_default();
        match *reading {
            Reading::RangeBearing {
                range_m,
                bearing_rad,
                white,
            } => self.learn(state, range_m, bearing_rad, white, &mount),
            // The thesis has no filter for one number alone.
            Reading::Range { .. } | Reading::Bearing { .. } => Outcome {
                accepted: false,
                d2: f64::INFINITY,
            },
        }
    }
}
