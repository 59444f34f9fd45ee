//! Lie derivatives of what is seen, along what moves.

use nalgebra::{Matrix3, Matrix4x3, RowVector3};

use super::polynomial::Polynomial;
use super::{Observability, rank};

/// What is seen of `[x, y, φ]`.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Output {
    /// Range and bearing as the pseudo-linear position, the bearing a parameter.
    RangeBearing,
    /// The bearing alone, pseudo-linear.
    Bearing,
    /// The bearing alone, as the angle.
    BearingNonlinear,
    /// The range alone.
    Range,
}

/// What moves.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// The observer drives.
    ObserverDrives,
    /// The observer turns.
    ObserverTurns,
    /// The neighbour drives.
    SeenDrives,
    /// The neighbour turns.
    SeenTurns,
}

/// What is seen at `at` by derivatives up to `order`, two at most; `bearing_rad` is the parameter of the pseudo-linear outputs.
#[must_use]
pub fn lie(
    output: Output,
    at: [f64; 3],
    bearing_rad: f64,
    inputs: &[Input],
    order: usize,
) -> Observability {
    let state = [0, 1, 2].map(|index| Polynomial::variable(index, at[index]));
    let motions = Motions { state, inputs };
    let [along, across] = position(&state, bearing_rad);
    let mut seen = Gradients::default();
    match output {
        Output::RangeBearing => {
            motions.stack(&along, order, &mut seen);
            motions.stack(&across, order, &mut seen);
        }
        Output::Bearing => motions.stack(&across, order, &mut seen),
        Output::Range => {
            let [x, y, _] = state;
            motions.stack(&(x * x + y * y).power(0.5), order, &mut seen);
        }
        Output::BearingNonlinear => motions.stack_azimuth(order, &mut seen),
    }
    Observability {
        gram: seen.gram,
        rank: rank(&seen.triangle.singular_values()),
    }
}

/// All rows of O: `OᵀO`, and R of `O = QR`, in which what is hardly seen keeps the digits that its square loses.
#[derive(Default)]
struct Gradients {
    gram: Matrix3<f64>,
    triangle: Matrix3<f64>,
}

impl Gradients {
    fn push(&mut self, gradient: RowVector3<f64>) {
        self.gram += gradient.transpose() * gradient;
        let mut rows = Matrix4x3::zeros();
        rows.fixed_rows_mut::<3>(0).copy_from(&self.triangle);
        rows.fixed_rows_mut::<1>(3).copy_from(&gradient);
        self.triangle = rows.qr().r();
    }
}

/// Along the line of sight, and across it.
fn position(state: &[Polynomial; 3], bearing_rad: f64) -> [Polynomial; 2] {
    let (sin, cos) = libm::sincos(bearing_rad);
    let [x, y, _] = state;
    [
        x.scaled(cos) + y.scaled(sin),
        x.scaled(-sin) + y.scaled(cos),
    ]
}

/// Where it moves, and by what.
struct Motions<'a> {
    state: [Polynomial; 3],
    inputs: &'a [Input],
}

impl Motions<'_> {
    /// The gradient of an output and those of its derivatives along all motions.
    fn stack(&self, output: &Polynomial, order: usize, seen: &mut Gradients) {
        let slope = [0, 1, 2].map(|index| output.derivative(index));
        self.stack_slope(&slope, order, seen);
    }

    /// The azimuth itself is no polynomial, its gradient `(−y, x)/r²` is one.
    fn stack_azimuth(&self, order: usize, seen: &mut Gradients) {
        let [x, y, _] = self.state;
        let inverse = (x * x + y * y).power(-1.0);
        let none = Polynomial::constant(0.0);
        self.stack_slope(
            &[(y * inverse).scaled(-1.0), x * inverse, none],
            order,
            seen,
        );
    }

    fn stack_slope(&self, slope: &[Polynomial; 3], order: usize, seen: &mut Gradients) {
        seen.push(slope.map(|it| it.value()).into());
        if order == 0 {
            return;
        }
        for input in self.inputs {
            let along = product(slope, &self.motion(*input));
            self.stack(&along, order - 1, seen);
        }
    }

    /// How `[x, y, φ]` moves with one input of one.
    fn motion(&self, input: Input) -> [Polynomial; 3] {
        let [x, y, phi] = self.state;
        let constant = Polynomial::constant;
        match input {
            Input::ObserverDrives => [constant(-1.0), constant(0.0), constant(0.0)],
            Input::ObserverTurns => [y, x.scaled(-1.0), constant(-1.0)],
            Input::SeenDrives => [phi.cosine(), phi.sine(), constant(0.0)],
            Input::SeenTurns => [constant(0.0), constant(0.0), constant(1.0)],
        }
    }
}

/// `∇h · f`
fn product([a, b, c]: &[Polynomial; 3], [x, y, z]: &[Polynomial; 3]) -> Polynomial {
    *a * *x + *b * *y + *c * *z
}
