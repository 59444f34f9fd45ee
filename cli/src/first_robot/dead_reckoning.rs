//! Dead reckoning: the cloud of robots, and who knows of its bend.

use coloc_estimator::Belief;
use coloc_sim::honest::{Filter, Sort};
use coloc_sim::method::Kind;
use plotters::style::RGBColor;

use super::cloud::{DT_S, Drive, position_covariance};
use crate::pictures::{Ellipse, EllipsePanel, Trace, method_color};

const ROBOTS: usize = 300;
const TICKS: u32 = 4500;
/// The bend is drawn so far to either side \[σ of the heading\].
const REACH: f64 = 2.5;
const STEPS: i32 = 40;

/// Wheels as people own them with a heading that is hardly known, and the paper's.
pub(super) fn panels() -> Vec<EllipsePanel> {
    vec![
        panel(
            "2 % of a metre, 3° in a minute; heading known to 17°",
            Sort::Sane,
            0.3,
        ),
        panel(
            "32 % of a metre, 37° in a minute; heading known",
            Sort::Paper,
            0.0,
        ),
    ]
}

fn panel(title: &str, sort: Sort, heading: f64) -> EllipsePanel {
    let drive = Drive {
        motion: sort.motion(0.0, DT_S),
        ticks: TICKS,
        heading,
    };
    let believed =
        |filter: Filter| drive.believed(|belief, motion, dt_s| filter.step(belief, motion, dt_s));
    let (own, extended) = (believed(Filter::Carried), believed(Filter::Extended));
    EllipsePanel {
        title: title.into(),
        points: drive.ends(ROBOTS),
        points_label: "300 robots",
        ellipses: vec![
            ellipse("EKF", method_color(Kind::SplitCi), &extended),
            ellipse("coloc", method_color(Kind::Coloc), &own),
        ],
        traces: vec![Trace {
            label: "coloc: the bend that it carries",
            end_label: None,
            color: method_color(Kind::Ccl),
            points: bend(&own),
        }],
    }
}

fn ellipse(label: &'static str, color: RGBColor, belief: &Belief) -> Ellipse {
    Ellipse {
        label,
        color,
        width_px: 2,
        mean: [belief.pose.x, belief.pose.y],
        covariance: position_covariance(belief),
    }
}

/// Where a robot is that has driven along x, by what the belief holds, if its heading is this one:
/// `E[p | φ] = p̄ + a δ + l_a (cos δ − e) + l_b sin δ`.
fn bend(belief: &Belief) -> Vec<(f64, f64)> {
    let p = belief.total().matrix();
    let s = p.m33;
    let e = (-s / 2.0).exp();
    let omega_a = 0.5 * (-s).exp_m1().powi(2);
    let omega_b = -0.5 * (-2.0 * s).exp_m1() - s * (-s).exp();
    let [ax, ay, _, bx, by, _] = belief.bend.to_array();
    let [along, across] = [[ax, ay].map(|k| k / omega_a), [bx, by].map(|k| k / omega_b)];
    let at = |step: i32| {
        let delta = REACH * s.sqrt() * f64::from(step) / f64::from(STEPS);
        let of = |mean: f64, with_heading: f64, la: f64, lb: f64| {
            let linear = with_heading / s - e * lb;
            mean + linear * delta + la * (delta.cos() - e) + lb * delta.sin()
        };
        (
            of(belief.pose.x, p.m13, along[0], across[0]),
            of(belief.pose.y, p.m23, along[1], across[1]),
        )
    };
    (-STEPS..=STEPS).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// d² of `at`, of the ellipse.
    fn d2(ellipse: &Ellipse, (x, y): (f64, f64)) -> f64 {
        let [xx, xy, yy] = ellipse.covariance;
        let [dx, dy] = [x - ellipse.mean[0], y - ellipse.mean[1]];
        (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
    }

    #[test]
    fn of_300_robots_coloc_loses_some_and_an_ekf_most_and_the_bend_goes_through_them() {
        for panel in panels() {
            let [extended, own] = &panel.ellipses[..] else {
                panic!("two ellipses");
            };
            let outside = |ellipse| {
                let beyond = panel.points.iter().filter(|at| d2(ellipse, **at) > 5.991);
                beyond.count()
            };
            let (lost, own) = (outside(extended), outside(own));
            assert!(own <= 30 && lost >= 120, "{}: {own}, {lost}", panel.title);
            let near = |&&(x, y): &&(f64, f64)| {
                let apart = |at: &(f64, f64)| (at.0 - x).hypot(at.1 - y);
                panel.traces[0].points.iter().any(|at| apart(at) < 25.0)
            };
            let near = panel.points.iter().filter(near).count();
            assert!(near > 270, "{}: {near}", panel.title);
        }
    }
}
