//! A slot in which somebody lies.

use coloc_bounds::slot::{Closed, Suspect, Verdict, close};
use coloc_bounds::team::{Pair, Supports};
use coloc_bounds::{AngleInterval, Arena, Measurement, Place, RangeInterval, Refused, Seen, Team};

const DIRECTIONS: usize = 16;
const ARENA: Arena = Arena {
    centre: [0.0; 2],
    half: 1e3,
};

/// Three robots in a triangle.
const TRUTH: [[f64; 2]; 3] = [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]];

fn around(at: [f64; 2], radius: f64) -> Supports {
    let values = (0..16).map(|k| {
        let psi = core::f64::consts::TAU * f64::from(k) / 16.0;
        psi.cos() * at[0] + psi.sin() * at[1] + radius
    });
    Supports::new(values.collect())
}

fn team() -> Team {
    let mut team = Team::new(3, DIRECTIONS);
    team.regions = TRUTH.iter().map(|&at| around(at, 0.4)).collect();
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let between = [TRUTH[i][0] - TRUTH[j][0], TRUTH[i][1] - TRUTH[j][1]];
        let region = around(between, 0.4);
        team.pairs.push(Pair { i, j, region });
    }
    team
}

fn fix(robot: usize, off: f64) -> Measurement {
    let [x, y] = TRUTH[robot];
    let centre = [x + off, y];
    Measurement::Fix {
        robot,
        centre,
        half: [0.2, 0.2],
    }
}

fn sighting(from: usize, to: usize, off: f64) -> Measurement {
    let [x, y] = [
        TRUTH[to][0] - TRUTH[from][0] + off,
        TRUTH[to][1] - TRUTH[from][1],
    ];
    let bearing = AngleInterval::new(y.atan2(x), 0.05);
    let seen = Seen::RangeBearing(bearing, RangeInterval::additive(x.hypot(y), 0.2));
    Measurement::Between {
        from: Place::Robot(from),
        to: Place::Robot(to),
        seen,
    }
}

fn closed(team: &mut Team, measurements: &[Measurement]) -> Closed {
    close(team, measurements, ARENA, 1e-9).unwrap()
}

fn suspects(measurements: &[Measurement]) -> Vec<Suspect> {
    let mut team = team();
    match closed(&mut team, measurements).verdict {
        Verdict::Violated {
            relaxation,
            suspects,
        } => {
            assert!(relaxation > 0.0);
            suspects
        }
        other => panic!("{other:?}"),
    }
}

fn holds(region: &Supports, at: [f64; 2]) -> bool {
    region
        .values()
        .iter()
        .zip(around(at, 0.0).values())
        .all(|(a, b)| *b <= a + 1e-9)
}

#[test]
fn honest_measurements_narrow_everything() {
    let mut team = team();
    let before = team.clone();
    let all = [
        fix(0, 0.1),
        fix(1, -0.1),
        sighting(0, 1, 0.05),
        sighting(1, 2, 0.0),
    ];
    let Closed {
        verdict, refused, ..
    } = closed(&mut team, &all);
    assert_eq!((verdict, refused), (Verdict::Kept, vec![]));
    for (robot, at) in TRUTH.iter().enumerate() {
        assert!(holds(&team.regions[robot], *at));
        assert!(team.regions[robot].values()[0] < before.regions[robot].values()[0]);
    }
}

#[test]
fn a_fix_that_lies_is_named_alone_and_left_out() {
    let others = [
        sighting(0, 1, 0.0),
        sighting(1, 0, 0.0),
        sighting(2, 0, 0.0),
        fix(1, 0.0),
    ];
    let mut all = others.to_vec();
    all.push(fix(0, 3.0));
    assert_eq!(suspects(&all), [Suspect::Fix(0)]);
    let (mut with, mut without) = (team(), team());
    closed(&mut with, &all);
    closed(&mut without, &others);
    for (a, b) in with.regions.iter().zip(&without.regions) {
        for (a, b) in a.values().iter().zip(b.values()) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }
}

#[test]
fn one_sighting_that_lies_is_named_not_all_of_its_robot() {
    let all = [
        sighting(0, 1, 1.5),
        sighting(0, 2, 0.0),
        fix(0, 0.0),
        fix(1, 0.0),
    ];
    assert_eq!(suspects(&all), [Suspect::Sighting(0, 1)]);
}

#[test]
fn a_robot_all_of_whose_sightings_lie_is_named_once() {
    let all = [
        sighting(0, 1, 1.5),
        sighting(0, 2, 1.5),
        sighting(1, 2, 0.0),
        fix(1, 0.0),
        fix(2, 0.0),
        fix(0, 0.0),
    ];
    assert_eq!(suspects(&all), [Suspect::Sightings(0)]);
}

#[test]
fn a_robot_that_was_carried_is_known_from_others_again() {
    let all = [
        fix(0, 3.0),
        Measurement::Between {
            from: Place::Robot(0),
            to: Place::Robot(2),
            seen: Seen::Bearing(AngleInterval::new(3.0_f64.atan2(-3.0), 0.05)),
        },
    ];
    let mut team = team();
    let Verdict::Violated { suspects, .. } = closed(&mut team, &all).verdict else {
        panic!("it fits");
    };
    assert_eq!(suspects, [Suspect::Motion(0)]);
    assert!(holds(&team.regions[0], [3.0, 0.0]), "{:?}", team.regions[0]);
    assert!(!holds(&team.regions[0], [0.0, 0.0]));
}

#[test]
fn two_who_lie_are_not_named_and_the_prediction_stays() {
    let before = team();
    let all = [fix(0, 3.0), fix(1, -3.0), sighting(0, 1, 0.0)];
    assert_eq!(suspects(&all), []);
    let mut after = team();
    closed(&mut after, &all);
    assert_eq!(after, before);
}

#[test]
fn what_means_nothing_is_refused_and_changes_nothing() {
    let bad = Measurement::Fix {
        robot: 0,
        centre: [f64::NAN, 0.0],
        half: [0.1, 0.1],
    };
    let good = [fix(0, 0.1), sighting(0, 1, 0.0)];
    let (mut with, mut without) = (team(), team());
    let found = closed(&mut with, &[good[0], bad, good[1], fix_of_nobody()]);
    closed(&mut without, &good);
    assert_eq!(found.verdict, Verdict::Kept);
    assert_eq!(
        found.refused,
        [(1, Refused::NotFinite), (3, Refused::UnknownRobot)]
    );
    assert_eq!(with.regions, without.regions);
}

fn fix_of_nobody() -> Measurement {
    Measurement::Fix {
        robot: 7,
        centre: [0.0; 2],
        half: [0.1, 0.1],
    }
}
