//! Algorithm 2 held against Monte-Carlo: how well does the covariance that a robot sends describe what it knows?

use coloc_estimator::{Belief, Covariance3, Pose, Propagation, to_global};
use coloc_sim::Scenario;
use coloc_sim::random::{Noise, Purpose};

use super::figures::Colors;
use crate::pictures::{Ellipse, EllipsePanel};

const DRAWS: usize = 3000;
/// One of so many is drawn: more would hide one another.
const DRAWN: usize = 6;
/// The observer, and what it sees 8 m away.
const OBSERVER: Pose = Pose {
    x: 0.0,
    y: 0.0,
    phi: 0.5,
};
const SEEN: Pose = Pose {
    x: 7.5,
    y: 2.8,
    phi: 0.8,
};
const POSITION_SIGMA_M: f64 = 0.1;

/// An observer as sure of its heading as in the paper's setting, one that was alone for a while, and one that is lost.
pub(super) fn panels(colors: Colors) -> Vec<EllipsePanel> {
    [2.0, 10.0, 25.0]
        .map(|degrees| panel(degrees, colors))
        .into()
}

fn panel(heading_sigma_deg: f64, [drawn, linearised, cubature]: Colors) -> EllipsePanel {
    let heading_sigma = heading_sigma_deg.to_radians();
    let observer = [POSITION_SIGMA_M, POSITION_SIGMA_M, heading_sigma];
    let sensor = Scenario::paper().sightings.sigma;
    let points = draws(observer, sensor);
    let (mean, covariance) = moments(&points);
    let belief = Belief::independent(OBSERVER, squares(observer));
    let seen = to_global(&belief, &SEEN, &squares(sensor), Propagation::default());
    let total = seen.total().matrix();
    let (linear_mean, linear) = linear(observer, sensor);
    let ellipse = |label, color, width_px, mean, covariance| Ellipse {
        label,
        color,
        width_px,
        mean,
        covariance,
    };
    EllipsePanel {
        title: format!("observer's heading known to {heading_sigma_deg}° (1σ)"),
        ellipses: vec![
            ellipse("Monte-Carlo", drawn, 4, mean, covariance),
            ellipse("linearised", linearised, 2, linear_mean, linear),
            ellipse(
                "coloc, as sent",
                cubature,
                2,
                [seen.pose.x, seen.pose.y],
                [total.m11, total.m12, total.m22],
            ),
        ],
        points: points.into_iter().step_by(DRAWN).collect(),
        points_label: "Monte-Carlo draws",
        traces: Vec::new(),
    }
}

fn squares(sigma: [f64; 3]) -> Covariance3 {
    // Squares are never negative.
    Covariance3::diagonal(sigma.map(|sigma| sigma * sigma)).unwrap_or_default()
}

/// Where the robot seen may be, observer and sensor erring at random.
fn draws(observer: [f64; 3], sensor: [f64; 3]) -> Vec<(f64, f64)> {
    let noise = Noise::new(1, 0);
    let draw = |step| {
        let normals = noise
            .draws(Purpose::RelativePose, step, 0, 1)
            .normals::<6>();
        let pose = [OBSERVER.x, OBSERVER.y, OBSERVER.phi];
        let [x, y, phi]: [f64; 3] = std::array::from_fn(|i| pose[i] + observer[i] * normals[i]);
        let [dx, dy] = [
            SEEN.x + sensor[0] * normals[3],
            SEEN.y + sensor[1] * normals[4],
        ];
        let (sin, cos) = phi.sin_cos();
        (x + cos * dx - sin * dy, y + sin * dx + cos * dy)
    };
    (0..DRAWS).map(draw).collect()
}

#[allow(clippy::cast_precision_loss)] // Some thousand.
fn moments(points: &[(f64, f64)]) -> ([f64; 2], [f64; 3]) {
    let n = points.len() as f64;
    let mean = |value: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let covariance = [
        mean(&|p| (p.0 - x) * (p.0 - x)),
        mean(&|p| (p.0 - x) * (p.1 - y)),
        mean(&|p| (p.1 - y) * (p.1 - y)),
    ];
    ([x, y], covariance)
}

/// What an extended Kalman filter would send: `P + J σ_φ² Jᵀ + Γ R Γᵀ`, J = Γ'(φ) δ.
fn linear(observer: [f64; 3], sensor: [f64; 3]) -> ([f64; 2], [f64; 3]) {
    let (sin, cos) = OBSERVER.phi.sin_cos();
    let mean = [
        OBSERVER.x + cos * SEEN.x - sin * SEEN.y,
        OBSERVER.y + sin * SEEN.x + cos * SEEN.y,
    ];
    let columns = [
        [observer[0], 0.0],
        [0.0, observer[1]],
        [
            -observer[2] * (mean[1] - OBSERVER.y),
            observer[2] * (mean[0] - OBSERVER.x),
        ],
        [cos * sensor[0], sin * sensor[0]],
        [-sin * sensor[1], cos * sensor[1]],
    ];
    let sum = |i: usize, j: usize| {
        columns
            .iter()
            .map(|column| column[i] * column[j])
            .sum::<f64>()
    };
    (mean, [sum(0, 0), sum(0, 1), sum(1, 1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREY: Colors = [plotters::style::RGBColor(0, 0, 0); 3];

    #[test]
    fn what_is_sent_describes_the_draws() {
        for panel in panels(GREY) {
            let [drawn, linear, cubature] = &panel.ellipses[..] else {
                panic!("three ellipses");
            };
            let miss = |other: &Ellipse| {
                let [dx, dy] = [0, 1].map(|i| other.mean[i] - drawn.mean[i]);
                dx.hypot(dy)
            };
            assert!(miss(cubature) <= miss(linear) + 0.05, "{}", panel.title);
            for i in [0, 2] {
                let ratio = cubature.covariance[i] / drawn.covariance[i];
                assert!((0.8..1.35).contains(&ratio), "{}: {ratio}", panel.title);
            }
        }
    }
}
