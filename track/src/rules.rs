//! What a manager asks of a filter.

use crate::increment::Increment;
use crate::reading::Reading;
use crate::sensor::Sensors;
use crate::state::{Core, State};
use crate::update::{Distance, Gates, Outcome, View};

/// How a track starts, moves and learns.
pub trait Rules {
    /// Of the first range and bearing.
    fn start(
        &self,
        range_m: f64,
        bearing_rad: f64,
        white: [f64; 2],
        sensors: &Sensors,
        index: usize,
    ) -> State;

    /// Both robots moved for `seconds`.
    fn predict(
        &self,
        state: &mut State,
        observer: &Increment,
        seen: &Increment,
        sensors: &Sensors,
        seconds: f64,
    );

    /// A reading of sensor `index`.
    fn update(
        &self,
        state: &mut State,
        reading: &Reading,
        sensors: &Sensors,
        index: usize,
        gates: &Gates,
    ) -> Outcome;
}

/// The linear start with slow errors as states.
#[derive(Copy, Clone, Debug, Default)]
pub struct Linear;

impl Rules for Linear {
    fn start(
        &self,
        range_m: f64,
        bearing_rad: f64,
        white: [f64; 2],
        sensors: &Sensors,
        index: usize,
    ) -> State {
        State::start(range_m, bearing_rad, white, sensors, index)
    }

    fn predict(
        &self,
        state: &mut State,
        observer: &Increment,
        seen: &Increment,
        sensors: &Sensors,
        seconds: f64,
    ) {
        state.predict(observer, seen, sensors.slow(), seconds);
    }

    fn update(
        &self,
        state: &mut State,
        reading: &Reading,
        sensors: &Sensors,
        index: usize,
        gates: &Gates,
    ) -> Outcome {
        state.update(reading, sensors, index, gates)
    }
}

/// How far range and bearing are from a state, if the gate accepts.
pub(crate) fn distance(
    state: &State,
    (range_m, bearing_rad, white): (f64, f64, [f64; 2]),
    sensors: &Sensors,
    index: usize,
    gate: f64,
) -> Option<Distance> {
    let view = View::of(sensors, index);
    let distance = state.distance(&state.expected(&view.position(range_m, bearing_rad, white)));
    (distance.d2 <= gate).then_some(distance)
}

/// The state with a heading, if it is known to `sigma_rad` now.
pub(crate) fn convert_if_ready(state: &mut State, sigma_rad: f64) {
    if state.core == Core::Linear && state.heading_of().is_ready(sigma_rad) {
        state.convert();
    }
}
