//! A wheel whose radius is off by a per cent, beside honest ones.

use coloc_daemon::config::Preset;
use coloc_estimator::{Propagation, propagate};
use coloc_sim::method::Kind;

use super::cloud::{DT_S, Drive, position_covariance};
use crate::pictures::{Ellipse, EllipsePanel, Trace, method_color};

const ROBOTS: usize = 100;
const SPEED_MPS: f64 = 1.0;
const OFF: f64 = 0.01;
const TRACK_M: f64 = 0.3;
const LABEL: &str = "100 honest robots";

/// One wheel, and both.
pub(super) fn panels() -> Vec<EllipsePanel> {
    vec![one_wheel(), both_wheels()]
}

/// Straight on for 15 m, and where the wheels say that it is.
fn one_wheel() -> EllipsePanel {
    let marks = [5.0, 10.0, 15.0];
    let ellipses = marks.map(|way_m| ellipse(&straight(way_m)));
    let longest = straight(marks[2]);
    EllipsePanel {
        title: "the right wheel's radius is set 1 % too large, 15 m straight on".into(),
        points: longest.ends(ROBOTS),
        points_label: LABEL,
        ellipses: ellipses.into(),
        traces: vec![trace(circle(marks[2]))],
    }
}

/// Where it gets to after 100 m, and where it believes to be.
fn both_wheels() -> EllipsePanel {
    let way_m = 100.0;
    let drive = straight(way_m);
    let wrong = (way_m * (1.0 + OFF), 0.0);
    EllipsePanel {
        title: "both radii are set 1 % too large, the end of 100 m".into(),
        points: drive.ends(ROBOTS),
        points_label: LABEL,
        ellipses: vec![ellipse(&drive)],
        traces: vec![trace(vec![(way_m, 0.0), wrong])],
    }
}

/// Two wheels on a hard floor, the heading known at the start.
fn straight(way_m: f64) -> Drive {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Some thousand.
    let ticks = (way_m / (SPEED_MPS * DT_S)).round() as u32;
    Drive {
        motion: Preset::Differential
            .motion()
            .noise()
            .nonholonomic([SPEED_MPS, 0.0]),
        ticks,
        heading: 0.0,
    }
}

fn ellipse(drive: &Drive) -> Ellipse {
    let step = |belief: &_, motion: &_, dt_s| propagate(belief, motion, dt_s, Propagation::Honest);
    let belief = drive.believed(step);
    Ellipse {
        label: "coloc's ellipse",
        color: method_color(Kind::Coloc),
        width_px: 2,
        mean: [belief.pose.x, belief.pose.y],
        covariance: position_covariance(&belief),
    }
}

fn trace(points: Vec<(f64, f64)>) -> Trace {
    Trace {
        label: "the way that these wheels say",
        end_label: Some("where they say that it ended"),
        color: method_color(Kind::SplitCi),
        points,
    }
}

/// A right wheel that says too much turns the robot to the left, for the wheels.
fn circle(way_m: f64) -> Vec<(f64, f64)> {
    let turn_per_m = OFF / TRACK_M;
    let at = |step: i32| {
        let said_m = way_m * (1.0 + OFF / 2.0) * f64::from(step) / 120.0;
        let angle = turn_per_m * said_m;
        (angle.sin() / turn_per_m, (1.0 - angle.cos()) / turn_per_m)
    };
    (0..=120).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_that_are_off_leave_the_ellipse_and_honest_robots_stay() {
        for panel in panels() {
            let ellipse = panel.ellipses.last().unwrap();
            let [xx, xy, yy] = ellipse.covariance;
            let d2 = |(x, y): (f64, f64)| {
                let [dx, dy] = [x - ellipse.mean[0], y - ellipse.mean[1]];
                (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
            };
            let wrong = d2(*panel.traces[0].points.last().unwrap());
            assert!(wrong > 12.0, "{}: {wrong}", panel.title);
            let out = panel.points.iter().filter(|at| d2(**at) > 5.991).count();
            assert!(out <= 14, "{}: {out}", panel.title);
        }
    }
}
