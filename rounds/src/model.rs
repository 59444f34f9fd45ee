//! Models of motion and of sightings, with their Jacobians \[B1\].
//!
//! ```text
//! motion:  p⁺ = p + dt R(φ) v, φ⁺ = wrap(φ + dt ω); Φ, G at the heading before; Q_d = G Q Gᵀ
//! pose:    y = Γ(φ_a)ᵀ (x_b − x_a)          bearing: wrap(atan2(Δy, Δx) − φ_a)
//! linear:  z = x_a − x_b                    range:   √(Δx² + Δy²)
//! ```

use coloc_estimator::angle::wrap;
use coloc_estimator::{Motion, Pose};
use nalgebra::{Matrix3, Vector3};

/// What a measurement is of.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// The pose of b in the body frame of a \[m, m, rad\].
    Pose,
    /// `x_a − x_b` in common axes, the paper's form \[m, m, rad\].
    Linear,
    /// The direction of b from a \[rad\].
    Bearing,
    /// The distance of a and b \[m\].
    Range,
    /// Both, the range first \[m, rad\].
    RangeBearing,
    /// Where a is \[m, m\].
    Position,
    /// Where a is and which way it looks \[m, m, rad\].
    AbsolutePose,
}

impl Kind {
    /// How many numbers it has.
    #[must_use]
    pub fn dimension(self) -> usize {
        match self {
            Self::Bearing | Self::Range => 1,
            Self::RangeBearing | Self::Position => 2,
            Self::Pose | Self::Linear | Self::AbsolutePose => 3,
        }
    }

    /// Whether there is a second robot in it.
    #[must_use]
    pub fn is_of_two(self) -> bool {
        !matches!(self, Self::Position | Self::AbsolutePose)
    }

    /// Which of its numbers are angles.
    #[must_use]
    pub fn angles(self) -> [bool; 3] {
        match self {
            Self::Pose | Self::Linear | Self::AbsolutePose => [false, false, true],
            Self::Bearing => [true, false, false],
            Self::RangeBearing => [false, true, false],
            Self::Range | Self::Position => [false; 3],
        }
    }
}

/// What a measurement should be. Rows beyond the dimension are zero.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Prediction {
    /// h
    pub value: Vector3<f64>,
    /// `H_a`
    pub first: Matrix3<f64>,
    /// `H_b`, zero where there is no second robot.
    pub second: Matrix3<f64>,
    kind: Kind,
}

impl Prediction {
    /// `y − h`, angles wrapped; zero beyond the dimension.
    #[must_use]
    pub fn residual(&self, y: [f64; 3]) -> Vector3<f64> {
        let angles = self.kind.angles();
        Vector3::from_fn(|row, _| {
            if row >= self.kind.dimension() {
                return 0.0;
            }
            let difference = y[row] - self.value[row];
            if angles[row] {
                wrap(difference)
            } else {
                difference
            }
        })
    }
}

/// What `kind` should be of robots at `a` and `b`; `b` is not looked at where there is none.
///
/// Robots at one place have no bearing: its Jacobian is not finite there, and no update takes it.
#[must_use]
pub fn predict(kind: Kind, a: &Pose, b: &Pose) -> Prediction {
    let (zero, one) = (Matrix3::zeros(), Matrix3::identity());
    let (value, first, second) = match kind {
        Kind::Pose => relative_pose(a, b),
        Kind::Linear => {
            let turn = wrap(a.phi - b.phi);
            (Vector3::new(a.x - b.x, a.y - b.y, turn), one, -one)
        }
        Kind::Bearing => {
            let (value, first, second) = bearing(a, b);
            let row = |of: Vector3<f64>| Matrix3::from_rows(&[of.transpose(), ZERO, ZERO]);
            (Vector3::new(value, 0.0, 0.0), row(first), row(second))
        }
        Kind::Range => {
            let (value, first) = range(a, b);
            let row = Matrix3::from_rows(&[first.transpose(), ZERO, ZERO]);
            (Vector3::new(value, 0.0, 0.0), row, -row)
        }
        Kind::RangeBearing => {
            let (far, away) = range(a, b);
            let (turn, first, second) = bearing(a, b);
            let rows = |near: Vector3<f64>, turned: Vector3<f64>| {
                Matrix3::from_rows(&[near.transpose(), turned.transpose(), ZERO])
            };
            let value = Vector3::new(far, turn, 0.0);
            (value, rows(away, first), rows(-away, second))
        }
        Kind::Position => {
            let first = Matrix3::from_diagonal(&[1.0, 1.0, 0.0].into());
            (Vector3::new(a.x, a.y, 0.0), first, zero)
        }
        Kind::AbsolutePose => (a.to_vector(), one, zero),
    };
    Prediction {
        value,
        first,
        second,
        kind,
    }
}

const ZERO: nalgebra::RowVector3<f64> = nalgebra::RowVector3::new(0.0, 0.0, 0.0);

/// `H_a = −[c s −h_y; −s c h_x; 0 0 1]`, `H_b = [c s 0; −s c 0; 0 0 1]`.
fn relative_pose(a: &Pose, b: &Pose) -> (Vector3<f64>, Matrix3<f64>, Matrix3<f64>) {
    let (s, c) = libm::sincos(a.phi);
    let [dx, dy] = [b.x - a.x, b.y - a.y];
    let h = Vector3::new(c * dx + s * dy, c * dy - s * dx, wrap(b.phi - a.phi));
    let first = -Matrix3::new(c, s, -h.y, -s, c, h.x, 0.0, 0.0, 1.0);
    let second = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
    (h, first, second)
}

fn range(a: &Pose, b: &Pose) -> (f64, Vector3<f64>) {
    let [dx, dy] = [b.x - a.x, b.y - a.y];
    let range = libm::hypot(dx, dy);
    (range, Vector3::new(-dx / range, -dy / range, 0.0))
}

fn bearing(a: &Pose, b: &Pose) -> (f64, Vector3<f64>, Vector3<f64>) {
    let [dx, dy] = [b.x - a.x, b.y - a.y];
    let square = dx * dx + dy * dy;
    let first = Vector3::new(dy / square, -dx / square, -1.0);
    let second = Vector3::new(-dy / square, dx / square, 0.0);
    (wrap(libm::atan2(dy, dx) - a.phi), first, second)
}

/// A relative pose `y` of noise R, seen from heading `phi`, in the paper's form: `z = −Γ y`, `Γ R Γᵀ`. The heading's own error is lost.
#[must_use]
pub fn to_common_axes(
    phi: f64,
    y: &Vector3<f64>,
    noise: &Matrix3<f64>,
) -> (Vector3<f64>, Matrix3<f64>) {
    let turn = turned(phi);
    (-(turn * y), turn * noise * turn.transpose())
}

/// `Γ(φ)`.
fn turned(phi: f64) -> Matrix3<f64> {
    let (s, c) = libm::sincos(phi);
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// A step of the extended Kalman filter's motion.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Step {
    /// Where it leads.
    pub pose: Pose,
    /// Φ
    pub jacobian: Matrix3<f64>,
    /// `Q_d`
    pub noise: Matrix3<f64>,
}

/// `dt_s` seconds of `motion` from `pose`.
#[must_use]
pub fn drive(pose: &Pose, motion: &Motion, dt_s: f64) -> Step {
    let [vx, vy, omega] = motion.velocity();
    let (s, c) = libm::sincos(pose.phi);
    let [dx, dy] = [dt_s * (vx * c - vy * s), dt_s * (vx * s + vy * c)];
    let turn = turned(pose.phi);
    Step {
        pose: Pose::new(pose.x + dx, pose.y + dy, pose.phi + dt_s * omega),
        jacobian: Matrix3::new(1.0, 0.0, -dy, 0.0, 1.0, dx, 0.0, 0.0, 1.0),
        noise: turn * motion.covariance().matrix() * turn.transpose() * (dt_s * dt_s),
    }
}
