//! Robots of known place in an empty hall: found where they are, by what was seen of them, without an allocation.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::f64::consts::{FRAC_PI_2, PI};

use coloc_counting::{Calls, calls_during};
use coloc_scan::beams::ScannerMotion;
use coloc_scan::finder::OwnHeading;
use coloc_scan::{Finder, Look, Prior, Raw, Seen, Settings, View};
use proptest::prelude::*;

const BEAMS: usize = 360;
const STEP: f64 = PI / 180.0;
const WALL_M: f64 = 9.0;
const ROUND: Look = Look::Cylinder { radius_m: 0.25 };
const LONG: Look = Look::Rectangle {
    length_m: 0.8,
    width_m: 0.5,
    centre_m: [0.1, 0.0],
};

/// What a scanner that stands sees of robots in a round hall.
fn scan(robots: &[(Look, [f64; 3])]) -> Vec<f32> {
    let beam = |place: usize| {
        #[allow(clippy::cast_precision_loss)]
        let angle = -PI + place as f64 * STEP;
        let ranges = robots
            .iter()
            .filter_map(|(look, pose)| meet(look, *pose, angle));
        #[allow(clippy::cast_possible_truncation)]
        let range = ranges.fold(WALL_M, f64::min) as f32;
        range
    };
    (0..BEAMS).map(beam).collect()
}

fn meet(look: &Look, [x, y, heading]: [f64; 3], angle: f64) -> Option<f64> {
    let (sin, cos) = angle.sin_cos();
    match look {
        Look::Cylinder { radius_m } => {
            let (along, aside) = (x * cos + y * sin, y * cos - x * sin);
            let inside = radius_m * radius_m - aside * aside;
            (inside > 0.0 && along > 0.0).then(|| along - inside.sqrt())
        }
        Look::Rectangle {
            length_m,
            width_m,
            centre_m,
        } => {
            // In the robot's own frame the beam begins at `from` and goes along `way`.
            let (s, c) = heading.sin_cos();
            let from = [-c * x - s * y - centre_m[0], s * x - c * y - centre_m[1]];
            let way = [c * cos + s * sin, c * sin - s * cos];
            let half = [0.5 * length_m, 0.5 * width_m];
            let spans = [0, 1].map(|it| {
                let ends = [-half[it], half[it]].map(|end| (end - from[it]) / way[it]);
                [ends[0].min(ends[1]), ends[0].max(ends[1])]
            });
            let (enters, leaves) = (spans[0][0].max(spans[1][0]), spans[0][1].min(spans[1][1]));
            (enters > 0.0 && enters < leaves).then_some(enters)
        }
        Look::Marks(_) => None,
    }
}

fn raw(ranges: &[f32]) -> Raw<'_> {
    #[allow(clippy::cast_possible_truncation)]
    Raw {
        angle_min_rad: -PI as f32,
        angle_increment_rad: STEP as f32,
        range_max_m: 30.0,
        ranges,
        ..Raw::default()
    }
}

fn prior(robot: u16, look: usize, pose: [f64; 3]) -> Prior {
    Prior {
        robot,
        look,
        pose,
        covariance: [[0.09, 0.0, 0.0], [0.0, 0.09, 0.0], [0.0, 0.0, 0.03]],
    }
}

fn find(looks: &[Look], ranges: &[f32], team: &[Prior]) -> Vec<Seen> {
    let mut finder = Finder::new(Settings::of(looks.to_vec()));
    let view = View::check(raw(ranges)).unwrap();
    finder.find(&view, ScannerMotion::default(), team).to_vec()
}

#[test]
fn a_cylinder_has_a_place_and_no_heading() {
    let pose = [2.0, 1.0, 0.7];
    let seen = find(
        &[ROUND],
        &scan(&[(ROUND, pose)]),
        &[prior(7, 0, [2.3, 0.8, 0.7])],
    );
    let [seen] = seen[..] else {
        panic!("{seen:?}");
    };
    assert!(
        (seen.pose[0] - 2.0).hypot(seen.pose[1] - 1.0) < 0.005,
        "{seen:?}"
    );
    assert!(seen.robot == 7 && !seen.has_heading && seen.covariance[2].iter().all(|it| *it == 0.0));
    let polar = seen.range_bearing();
    assert!(
        (polar.range_m - 5.0_f64.sqrt()).abs() < 0.005
            && (polar.bearing_rad - 0.5_f64.atan()).abs() < 0.003
    );
    let [[range, across], [_, bearing]] = polar.covariance;
    assert!(range > 0.0 && bearing > 0.0 && across * across < range * bearing);
}

#[test]
fn a_rectangle_says_its_heading_and_the_prior_which_end_is_its_front() {
    for turned in [0.0, PI] {
        let pose = [2.0, -1.0, 0.4 + turned];
        let seen = find(
            &[LONG],
            &scan(&[(LONG, pose)]),
            &[prior(3, 0, [1.8, -0.8, 0.6 + turned])],
        );
        let [seen] = seen[..] else {
            panic!("{seen:?}");
        };
        let off = (seen.pose[2] - pose[2] + PI).rem_euclid(2.0 * PI) - PI;
        assert!(seen.has_heading && off.abs() < 0.03, "{seen:?}");
        assert!(
            (seen.pose[0] - pose[0]).hypot(seen.pose[1] - pose[1]) < 0.02,
            "{seen:?}"
        );
    }
}

#[test]
fn two_that_may_be_each_other_are_counted_and_not_said() {
    let poses = [[3.0, 0.6, 0.0], [3.0, -0.6, 0.0]];
    let ranges = scan(&poses.map(|pose| (ROUND, pose)));
    let mut finder = Finder::new(Settings::of(vec![ROUND]));
    let view = View::check(raw(&ranges)).unwrap();
    let team = [prior(1, 0, [3.0, 0.1, 0.0]), prior(2, 0, [3.0, -0.1, 0.0])];
    assert!(
        finder
            .find(&view, ScannerMotion::default(), &team)
            .is_empty()
    );
    assert_eq!((finder.counts().bodies, finder.counts().ambiguous), (2, 2));
    let apart = [prior(1, 0, [3.0, 0.8, 0.0]), prior(2, 0, [3.0, -0.8, 0.0])];
    let names: Vec<_> = finder
        .find(&view, ScannerMotion::default(), &apart)
        .iter()
        .map(|it| it.robot)
        .collect();
    assert_eq!(names, [1, 2]);
}

#[test]
fn who_stands_across_the_first_and_the_last_beam_is_seen_whole() {
    for (look, beams) in [(ROUND, 14), (LONG, 18)] {
        let pose = [-2.0, 0.02, 0.4];
        let seen = find(&[look], &scan(&[(look, pose)]), &[prior(1, 0, pose)]);
        let [seen] = seen[..] else {
            panic!("{seen:?}");
        };
        let off = (seen.pose[0] - pose[0]).hypot(seen.pose[1] - pose[1]);
        assert!(off < 0.01 && seen.beams >= beams, "{seen:?}");
    }
    // A thin post stands in front of it, right at the seam.
    let mut ranges = scan(&[(LONG, [-2.0, 0.0, 0.4])]);
    ranges[BEAMS - 1] = 0.5;
    ranges[0] = 0.5;
    let seen = find(&[LONG], &ranges, &[prior(1, 0, [-2.0, 0.0, 0.4])]);
    assert!(seen.len() == 1 && seen[0].beams >= 16, "{seen:?}");
}

#[test]
fn a_heading_that_is_off_moves_all_and_the_whole_scan_says_by_how_much() {
    // Two of three stand so that the third is taken for its neighbour, if each is looked at alone.
    let sigma = 0.17;
    let (sin, cos) = 0.3_f64.sin_cos();
    let truth = [[3.0, 0.0, 0.0], [2.9, 0.9, 0.0], [-2.0, 2.0, 0.0]];
    let ranges = scan(&truth.map(|pose| (ROUND, pose)));
    let view = View::check(raw(&ranges)).unwrap();
    let turned = |(robot, [x, y, _]): (u16, &[f64; 3])| {
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        let (near, swing) = (0.01, sigma * sigma);
        Prior {
            robot,
            look: 0,
            pose: [x, y, 0.3],
            covariance: [
                [near + y * y * swing, -x * y * swing, -y * swing],
                [-x * y * swing, near + x * x * swing, x * swing],
                [-y * swing, x * swing, near + swing],
            ],
        }
    };
    let team: Vec<Prior> = (1..).zip(&truth).map(turned).collect();
    let own = OwnHeading {
        variance: sigma * sigma,
        about_m: [0.0; 2],
    };
    let names = |own| {
        let mut finder = Finder::new(Settings::of(vec![ROUND]));
        let seen = finder.find_turned(&view, ScannerMotion::default(), &team, own);
        let at = |it: &Seen| {
            let off = |pose: &[f64; 3]| (it.pose[0] - pose[0]).hypot(it.pose[1] - pose[1]);
            truth.iter().position(|pose| off(pose) < 0.1).unwrap() + 1
        };
        let mut names: Vec<_> = seen
            .iter()
            .map(|it| (usize::from(it.robot), at(it)))
            .collect();
        names.sort_unstable();
        names
    };
    assert_eq!(names(own), [(1, 1), (2, 2), (3, 3)]);
    assert!(names(OwnHeading::default()).len() < 3);
}

#[test]
fn a_wall_is_nobody() {
    assert!(
        find(
            &[ROUND, LONG],
            &scan(&[]),
            &[prior(1, 0, [8.9, 0.0, 0.0]), prior(2, 1, [6.0, 0.0, 0.0])]
        )
        .is_empty()
    );
}

#[test]
fn what_the_scanner_moves_meanwhile_is_taken_out() {
    // It drives a metre a second and turns to the left, a tenth of a second for a turn.
    let motion = ScannerMotion {
        velocity_m_s: [1.0, 0.0],
        turn_rad_s: 0.5,
    };
    let pose = [2.0, 1.5, 0.0];
    let time_s = |place: usize| f64::from(u16::try_from(place).unwrap()) * 0.1 / 360.0;
    let at = |time_s: f64| {
        let (sin, cos) = (0.5 * time_s).sin_cos();
        let (x, y) = (pose[0] - time_s, pose[1]);
        [cos * x + sin * y, cos * y - sin * x, pose[2] - 0.5 * time_s]
    };
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation)]
    let ranges: Vec<f32> = (0..BEAMS)
        .map(|place| {
            let angle = -PI + place as f64 * STEP;
            meet(&ROUND, at(time_s(place)), angle).unwrap_or(WALL_M) as f32
        })
        .collect();
    let mut finder = Finder::new(Settings::of(vec![ROUND]));
    let raw = Raw {
        time_increment_s: 0.1 / 360.0,
        ..raw(&ranges)
    };
    let team = [prior(1, 0, pose)];
    let [seen] = finder.find(&View::check(raw).unwrap(), motion, &team) else {
        panic!("it stands there");
    };
    let truth = at(seen.time_s);
    assert!(
        seen.time_s > 0.05 && (seen.pose[0] - truth[0]).hypot(seen.pose[1] - truth[1]) < 0.005,
        "{seen:?} {truth:?}"
    );
}

#[test]
fn nothing_is_allocated_after_the_start() {
    let robots = [
        (ROUND, [2.0, 1.0, 0.0]),
        (LONG, [-3.0, 1.0, 0.5]),
        (ROUND, [0.0, -2.0, 0.0]),
        (LONG, [1.0, 3.0, FRAC_PI_2]),
    ];
    let ranges = scan(&robots);
    let team: Vec<Prior> = (0..)
        .zip(&robots)
        .map(|(robot, (look, pose))| prior(robot, usize::from(*look == LONG), *pose))
        .collect();
    let mut finder = Finder::new(Settings::of(vec![ROUND, LONG]));
    let view = View::check(raw(&ranges)).unwrap();
    for _ in 0..3 {
        let (seen, calls) =
            calls_during(|| finder.find(&view, ScannerMotion::default(), &team).len());
        assert_eq!((seen, calls), (4, Calls::NONE));
    }
}

/// As it was recorded: of a rectangle that looks to the left, the long side is seen between the last beam of the scan and what stands in
/// front of its other end. The noise of its last beams is no short side.
#[test]
fn of_a_face_both_ends_of_which_are_hidden_nothing_is_said_that_was_not_seen() {
    let seen = [
        1.504, 1.494, 1.484, 1.274, 1.283, 1.343, 1.343, 1.433, 1.890, 1.900, 1.880, 1.900, 1.900,
        1.890, 1.880, 1.930, 1.920, 1.940, 1.930, 1.940, 1.980, 1.960, 1.960,
    ];
    let mut ranges = [f32::NAN; 180];
    ranges[180 - seen.len()..].copy_from_slice(&seen);
    #[allow(clippy::cast_possible_truncation)]
    let view = View::check(Raw {
        angle_min_rad: -FRAC_PI_2 as f32,
        angle_increment_rad: STEP as f32,
        range_max_m: 30.0,
        ranges: &ranges,
        ..Raw::default()
    });
    let look = Look::Rectangle {
        length_m: 0.7,
        width_m: 0.5,
        centre_m: [0.1, 0.0],
    };
    let team = [prior(1, 0, [0.155, 2.182, -0.289])];
    let mut finder = Finder::new(Settings::of(vec![look]));
    let found = finder.find(&view.unwrap(), ScannerMotion::default(), &team);
    assert!(found.is_empty(), "{found:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the ranges are, what is said can be computed with.
    #[test]
    fn no_scan_does_harm(
        ranges in prop::collection::vec(prop_oneof![4 => 0.0_f32..8.0, 1 => any::<f32>()], 2..400),
        step in 0.001_f32..0.02,
        places in prop::collection::vec(prop::array::uniform3(-8.0..8.0), 1..8),
    ) {
        let raw = Raw { angle_increment_rad: step, range_max_m: 10.0, ranges: &ranges, ..Raw::default() };
        let team: Vec<Prior> = (0..).zip(&places).map(|(robot, pose)| prior(robot, usize::from(robot % 2), *pose)).collect();
        if let Ok(view) = View::check(raw) {
            let mut finder = Finder::new(Settings::of(vec![ROUND, LONG]));
            for seen in finder.find(&view, ScannerMotion::default(), &team) {
                prop_assert!(seen.pose.iter().all(|it| it.is_finite()));
                let [[a, b, _], [c, d, _], _] = seen.covariance;
                prop_assert!(a > 0.0 && d > 0.0 && a * d > b * c && b.to_bits() == c.to_bits());
            }
        }
    }

    /// Wherever a robot stands in the open and whatever of it is believed: it is found where it is.
    #[test]
    fn a_robot_in_the_open_is_found(far in 0.8..5.5, bearing in -PI..PI, heading in -PI..PI, is_long in any::<bool>()) {
        let (sin, cos) = f64::sin_cos(bearing);
        let pose = [far * cos, far * sin, heading];
        let look = if is_long { LONG } else { ROUND };
        let seen = find(&[look], &scan(&[(look, pose)]), &[prior(1, 0, [pose[0] + 0.2, pose[1] - 0.2, heading + 0.1])]);
        prop_assert!(seen.len() == 1, "{seen:?}");
        for seen in seen {
            prop_assert!((seen.pose[0] - pose[0]).hypot(seen.pose[1] - pose[1]) < 0.12, "{seen:?} {pose:?}");
        }
    }
}
