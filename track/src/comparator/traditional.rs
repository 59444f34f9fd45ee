//! The extended Kalman filter of range and bearing.

use coloc_estimator::angle::wrap;
use nalgebra::{Matrix2, SMatrix, Vector2};

use super::printed::{begun, learn, move_on};
use crate::increment::Increment;
use crate::plane::{azimuth, azimuth_slope};
use crate::reading::Reading;
use crate::rules::Rules;
use crate::sensor::Sensors;
use crate::state::{SIZE, State};
use crate::update::{Gates, Linearised, Outcome};

/// The same start and the same prediction as [`super::Printed`], with range and bearing linearised at the estimate.
#[derive(Copy, Clone, Debug, Default)]
pub struct Traditional;

impl Traditional {
    /// Of a sensor in the middle.
    pub fn learn(
        &self,
        state: &mut State,
        range_m: f64,
        bearing_rad: f64,
        white: [f64; 2],
    ) -> Outcome {
        let position = state.position();
        let range = position.norm();
        let mut slopes = SMatrix::<f64, 2, SIZE>::zeros();
        slopes
            .fixed_view_mut::<1, 2>(0, 0)
            .copy_from(&(position / range).transpose());
        slopes
            .fixed_view_mut::<1, 2>(1, 0)
            .copy_from(&azimuth_slope(position).transpose());
        let innovation = Vector2::new(range_m - range, wrap(bearing_rad - azimuth(position)));
        let linearised = Linearised {
            slopes,
            innovation,
            noise: Matrix2::new(white[0], 0.0, 0.0, white[1]),
        };
        learn(state, &linearised)
    }
}

impl Rules for Traditional {
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
        _: &Sensors,
        _: usize,
        _: &Gates,
    ) -> Outcome {
        match *reading {
            Reading::RangeBearing {
                range_m,
                bearing_rad,
                white,
            } => self.learn(state, range_m, bearing_rad, white),
            Reading::Range { .. } | Reading::Bearing { .. } => Outcome {
                accepted: false,
                d2: f64::INFINITY,
            },
        }
    }
}
