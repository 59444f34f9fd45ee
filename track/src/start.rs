//! The first reading: a position, and any heading.

use nalgebra::{Matrix2, Vector2};

use crate::plane::sight;
use crate::sensor::Sensors;
use crate::state::{State, slow_at};
use crate::update::FLOOR;

impl State {
    /// A linear state of range and bearing by sensor `index`, with `white` variances: the heading is uniform on the circle, of which
    /// `e = 0`, `P_ee = ½ I` are the exact moments. The position has the sensor's slow errors in it.
    #[must_use]
    pub fn start(
        range_m: f64,
        bearing_rad: f64,
        white: [f64; 2],
        sensors: &Sensors,
        index: usize,
    ) -> Self {
        let mount = sensors.get(index).map(|it| it.mount).unwrap_or_default();
        let rows = sight(bearing_rad + mount.phi);
        let along = rows.transpose() * Vector2::new(range_m, 0.0);
        let across = (range_m * range_m * white[1]).max(FLOOR);
        let noise = Matrix2::new(white[0], 0.0, 0.0, across);
        let mut state = Self {
            slow: sensors.slow().count(),
            ..Self::default()
        };
        state
            .mean
            .fixed_rows_mut::<2>(0)
            .copy_from(&(Vector2::new(mount.x, mount.y) + along));
        let mut position = rows.transpose() * noise * rows;
        state
            .covariance
            .fixed_view_mut::<2, 2>(2, 2)
            .copy_from(&(0.5 * Matrix2::identity()));
        for (k, slow) in sensors.slow().enumerate() {
            let place = slow_at(k);
            state.covariance[(place, place)] = slow.range_sigma * slow.range_sigma;
            state.covariance[(place + 1, place + 1)] = slow.bearing_sigma * slow.bearing_sigma;
        }
        if let Some(place) = sensors.slow_place(index).map(slow_at) {
            let by_slow = -range_m * rows.transpose();
            let variances = state
                .covariance
                .fixed_view::<2, 2>(place, place)
                .into_owned();
            let with_slow = by_slow * variances;
            position += with_slow * by_slow.transpose();
            state
                .covariance
                .fixed_view_mut::<2, 2>(0, place)
                .copy_from(&with_slow);
            state
                .covariance
                .fixed_view_mut::<2, 2>(place, 0)
                .copy_from(&with_slow.transpose());
        }
        state
            .covariance
            .fixed_view_mut::<2, 2>(0, 0)
            .copy_from(&position);
        state.symmetrise();
        state
    }
}
