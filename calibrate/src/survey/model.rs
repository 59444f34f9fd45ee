//! What is measured, as equations of a path and of landmarks: how far off each is, and what it says of both.

use coloc_estimator::angle::wrap;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};

use super::normal::{Block, NODE, Node, PLACE, Place, PlaceBlock, System};
use super::path::{Increment, rotation};
use super::{Fix, Sighting, Slow};

/// Where the robot was and how its sensors erred at a node: x, y, heading; of range (a part of it) and bearing; of a fix.
pub(super) type State = Node;

/// Not known at all, of a landmark \[m\].
const ANYWHERE_M: f64 = 1e3;

/// No slow error is smaller, so that none has to be treated apart.
const LEAST_SLOW: f64 = 1e-6;

/// Slow errors: standard deviations and times, of range and bearing and of a fix's two coordinates.
#[derive(Copy, Clone, Debug)]
pub(super) struct Slowness([(f64, f64); 4]);

impl Slowness {
    pub(super) fn of(sighting: [Slow; 2], fix: Slow) -> Self {
        let both = |it: Slow| (it.sigma.max(LEAST_SLOW), it.time_s);
        Self([sighting[0], sighting[1], fix, fix].map(both))
    }

    /// At the first node: as they are at any time.
    pub(super) fn begin(&self, system: &mut System, state: &State) {
        for (at, (sigma, _)) in (3..NODE).zip(self.0) {
            let weight = 1.0 / (sigma * sigma);
            system.diagonal[0][(at, at)] += weight;
            system.right[0][at] -= weight * state[at];
        }
    }

    /// From a node to the next one.
    pub(super) fn over(&self, system: &mut System, at: usize, states: [&State; 2], dt_s: f64) {
        for (number, (sigma, time_s)) in (3..NODE).zip(self.0) {
            let kept = (-dt_s / time_s).exp();
            let weight = 1.0 / (sigma * sigma * (1.0 - kept * kept).max(1e-12));
            let off = states[1][number] - kept * states[0][number];
            system.diagonal[at][(number, number)] += weight * kept * kept;
            system.next[at][(number, number)] -= weight * kept;
            system.diagonal[at + 1][(number, number)] += weight;
            system.right[at][number] += weight * kept * off;
            system.right[at + 1][number] -= weight * off;
        }
    }
}

/// The wheels' word of the way from a node to the next one.
pub(super) fn drive(system: &mut System, at: usize, states: [&State; 2], said: &Increment) {
    let [from, to] = states;
    let back = rotation(-from[2]);
    let way = back * Vector2::new(to[0] - from[0], to[1] - from[1]);
    let off = Vector3::new(
        way.x - said.way.x,
        way.y - said.way.y,
        wrap(to[2] - from[2] - said.turn),
    );
    let (mut of_from, mut of_to) = (Matrix3::zeros(), Matrix3::zeros());
    of_from.fixed_view_mut::<2, 2>(0, 0).copy_from(&-back);
    of_to.fixed_view_mut::<2, 2>(0, 0).copy_from(&back);
    (of_from[(0, 2)], of_from[(1, 2)]) = (way.y, -way.x);
    (of_from[(2, 2)], of_to[(2, 2)]) = (-1.0, 1.0);
    let weight = said.covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
    let add = |it: &mut Block, block: Matrix3<f64>| {
        let mut view = it.fixed_view_mut::<3, 3>(0, 0);
        view += block;
    };
    add(
        &mut system.diagonal[at],
        of_from.transpose() * weight * of_from,
    );
    add(&mut system.next[at], of_from.transpose() * weight * of_to);
    add(
        &mut system.diagonal[at + 1],
        of_to.transpose() * weight * of_to,
    );
    let mut right = |it: usize, of: &Matrix3<f64>| {
        let mut view = system.right[it].fixed_rows_mut::<3>(0);
        view -= of.transpose() * weight * off;
    };
    right(at, &of_from);
    right(at + 1, &of_to);
}

/// Two numbers that were measured: how far off they are of what is expected, and how that changes.
pub(super) struct Equation {
    off: Vector2<f64>,
    of_node: SMatrix<f64, 2, NODE>,
    of_landmark: Option<(usize, Slope)>,
    /// Of what the sensor errs by for the whole drive.
    of_sensor: Slope,
    /// Of what is new in it.
    covariance: Matrix2<f64>,
    /// Of what it counts for, given others of the same errors.
    weight: Matrix2<f64>,
}

/// Of two numbers by two.
pub(super) type Slope = SMatrix<f64, 2, PLACE>;

impl Equation {
    /// d²: χ² with two degrees of freedom, were the rest known.
    pub(super) fn distance(&self) -> f64 {
        let back = self.covariance.try_inverse();
        back.map_or(0.0, |it| self.off.dot(&(it * self.off)))
    }

    /// What it says of its landmark, and how what the sensor errs by changes that.
    pub(super) fn of_place(&self, factor: f64) -> Option<[PlaceBlock; 2]> {
        let (_, of) = self.of_landmark?;
        let weighed = of.transpose() * (self.weight * factor);
        Some([weighed * of, weighed * self.of_sensor])
    }

    pub(super) fn add(&self, system: &mut System, node: usize, factor: f64) {
        let weight = self.weight * factor;
        let weighed = self.of_node.transpose() * weight;
        system.diagonal[node] += weighed * self.of_node;
        system.right[node] -= weighed * self.off;
        if let Some((landmark, of)) = self.of_landmark {
            system.sights[node].push((landmark, weighed * of));
            system.landmarks[landmark] += of.transpose() * weight * of;
            system.landmarks_right[landmark] -= of.transpose() * weight * self.off;
            let (sensor, own) = (system.ties.len(), self.of_sensor);
            system.sights[node].push((sensor, weighed * own));
            system.landmarks[sensor] += own.transpose() * weight * own;
            system.landmarks_right[sensor] -= own.transpose() * weight * self.off;
            system.ties[landmark] += of.transpose() * weight * own;
        }
    }
}

/// Variances of what a sighting's range and bearing err by \[m², rad²\].
#[derive(Copy, Clone, Debug)]
pub(super) struct Spread {
    /// Of it alone.
    one: [f64; 2],
    /// As many times the errors that it shares with others as there are sightings that share them: so much together they count for what
    /// their mean is worth.
    shared: [f64; 2],
}

impl Spread {
    /// Of a sighting among `repeats` of its landmark that share its errors.
    pub(super) fn of(sighting: &Sighting, errors: &Errors, repeats: [f64; 2]) -> Self {
        let scale = [sighting.range_m * sighting.range_m, 1.0];
        let of = |kind: usize, count: f64| {
            let [own, stays] = [errors.own[kind], errors.stays[kind]].map(|it| it * it);
            sighting.white[kind] + scale[kind] * count * (own + stays)
        };
        Self {
            one: [0, 1].map(|kind| of(kind, 1.0)),
            shared: [0, 1].map(|kind| of(kind, repeats[kind])),
        }
    }
}

/// Standard deviations of what sightings of one landmark err by, as a part of the range and of the bearing \[rad\].
#[derive(Copy, Clone, Debug)]
pub(super) struct Errors {
    /// For a while.
    pub(super) own: [f64; 2],
    /// For the whole drive.
    pub(super) stays: [f64; 2],
}

pub(super) fn of_fix(fix: &Fix, state: &State) -> Equation {
    let arm = rotation(state[2]) * Vector2::from(fix.lever);
    let expected = Vector2::new(state[0] + state[5], state[1] + state[6]) + arm;
    let mut of_node = SMatrix::<f64, 2, NODE>::zeros();
    for axis in 0..2 {
        of_node[(axis, axis)] = 1.0;
        of_node[(axis, 5 + axis)] = 1.0;
    }
    (of_node[(0, 2)], of_node[(1, 2)]) = (-arm.y, arm.x);
    Equation {
        off: expected - Vector2::from(fix.position),
        of_node,
        of_landmark: None,
        of_sensor: Slope::zeros(),
        covariance: fix.covariance,
        weight: fix.covariance.try_inverse().unwrap_or_else(Matrix2::zeros),
    }
}

/// Of the landmark with that index, by a sensor that errs so for the whole drive.
pub(super) fn of_sighting(
    sighting: &Sighting,
    (landmark, place): (usize, &Place),
    sensor: &Place,
    state: &State,
    spread: &Spread,
) -> Equation {
    let back = rotation(-state[2]);
    let body = back * Vector2::new(place[0] - state[0], place[1] - state[1]);
    let sight = body - Vector2::from(sighting.mount);
    let range = sight.norm().max(0.01);
    let (along, across) = (
        sight / range,
        Vector2::new(-sight.y, sight.x) / (range * range),
    );
    let scale = 1.0 + state[3] + sensor[0];
    let off = Vector2::new(
        scale * range - sighting.range_m,
        wrap(sight.y.atan2(sight.x) + state[4] + sensor[1] - sighting.bearing_rad),
    );
    let polar = Matrix2::from_rows(&[scale * along.transpose(), across.transpose()]);
    let of_position = polar * back;
    let turned = polar * Vector2::new(body.y, -body.x);
    let mut of_node = SMatrix::<f64, 2, NODE>::zeros();
    of_node
        .fixed_view_mut::<2, 2>(0, 0)
        .copy_from(&-of_position);
    of_node.fixed_view_mut::<2, 1>(0, 2).copy_from(&turned);
    (of_node[(0, 3)], of_node[(1, 4)]) = (range, 1.0);
    Equation {
        off,
        of_node,
        of_landmark: Some((landmark, of_position)),
        of_sensor: Slope::new(range, 0.0, 0.0, 1.0),
        covariance: Matrix2::from_diagonal(&spread.one.into()),
        weight: Matrix2::from_diagonal(&spread.shared.map(f64::recip).into()),
    }
}

/// Where nothing says anything: a landmark is somewhere in the world, and so is the path. The sensor errs for the whole drive by no more
/// than by what it errs for a while.
pub(super) fn anywhere(system: &mut System, sensor: &Place, slow: [Slow; 2]) {
    let weak = 1.0 / (ANYWHERE_M * ANYWHERE_M);
    let last = system.ties.len();
    for landmark in &mut system.landmarks[..last] {
        *landmark += PlaceBlock::from_diagonal_element(weak);
    }
    let known = Place::from(slow.map(|it| it.sigma.max(LEAST_SLOW).powi(-2)));
    system.landmarks[last] += PlaceBlock::from_diagonal(&known);
    system.landmarks_right[last] -= known.component_mul(sensor);
    for at in 0..3 {
        system.diagonal[0][(at, at)] += weak;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> State {
        State::from_column_slice(&[1.0, -2.0, 0.7, 0.03, -0.02, 0.1, 0.2])
    }

    /// By differences.
    fn check(equation: &dyn Fn(&State, &Place, &Place) -> Equation) {
        const STEP: f64 = 1e-6;
        let (place, sensor) = (Place::new(3.0, 1.5), Place::new(0.02, -0.01));
        let exact = equation(&state(), &place, &sensor);
        let slope = |plus: Equation, minus: Equation| (plus.off - minus.off) / (2.0 * STEP);
        for number in 0..NODE {
            let moved = |by: f64| {
                let mut state = state();
                state[number] += by;
                equation(&state, &place, &sensor)
            };
            let found = slope(moved(STEP), moved(-STEP));
            let expected = exact.of_node.column(number);
            assert!(
                (found - expected).norm() < 1e-8,
                "{number}: {found} {expected}"
            );
        }
        let Some((_, of_landmark)) = exact.of_landmark else {
            return;
        };
        for axis in 0..PLACE {
            let mut by = Place::zeros();
            by[axis] = STEP;
            let found = slope(
                equation(&state(), &(place + by), &sensor),
                equation(&state(), &(place - by), &sensor),
            );
            let of_sensor = slope(
                equation(&state(), &place, &(sensor + by)),
                equation(&state(), &place, &(sensor - by)),
            );
            assert!(
                (found - of_landmark.column(axis)).norm() < 1e-8,
                "{axis}: {found}"
            );
            assert!((of_sensor - exact.of_sensor.column(axis)).norm() < 1e-8);
        }
    }

    #[test]
    fn slopes_are_those_of_the_equations() {
        let sighting = Sighting {
            stamp_s: 0.0,
            landmark: 6,
            range_m: 3.0,
            bearing_rad: 0.4,
            mount: [0.1, -0.05],
            white: [0.01, 0.02],
        };
        let errors = Errors {
            own: [0.04, 0.01],
            stays: [0.02, 0.0],
        };
        let spread = Spread::of(&sighting, &errors, [3.0, 2.0]);
        check(&|state, place, sensor| of_sighting(&sighting, (0, place), sensor, state, &spread));
        let fix = Fix {
            stamp_s: 0.0,
            position: [1.0, 2.0],
            covariance: Matrix2::new(0.02, 0.001, 0.001, 0.01),
            lever: [0.3, 0.1],
        };
        check(&|state, _, _| of_fix(&fix, state));
    }
}
