//! Networks that the truth satisfies, of all sorts of measurements.

#![allow(dead_code)] // Not every test uses all of it.

use coloc_bounds::{
    AngleInterval, Arena, Gauge, Measurement, Place, Polytope, RangeInterval, Seen, Source,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A polytope, and where the robots are.
pub(crate) struct Network {
    pub(crate) polytope: Polytope,
    pub(crate) truth: Vec<[f64; 2]>,
    pub(crate) measurements: Vec<Measurement>,
    pub(crate) sort: Sort,
}

/// What is measured.
#[derive(Copy, Clone, PartialEq, Eq)]
pub(crate) enum Sort {
    /// Bearings, and the scale is given.
    Bearings,
    /// A fix, and nothing is given.
    Fixed,
    /// From the first robot.
    Relative,
}

pub(crate) fn any_sort(random: &mut ChaCha8Rng) -> Sort {
    [Sort::Bearings, Sort::Fixed, Sort::Relative, Sort::Relative][random.random_range(0..4)]
}

/// `robots` on a grid of two metres, three in a row, nowhere more than 0.4 m off; whoever is nearer than 3.2 m is seen.
pub(crate) fn network(random: &mut ChaCha8Rng, robots: usize, sort: Sort) -> Network {
    let truth = places(random, robots);
    let mut measurements = Vec::new();
    if sort == Sort::Fixed {
        measurements.push(fix(random, &truth, 0));
    }
    for (i, j) in (0..robots).flat_map(|i| (0..robots).map(move |j| (i, j))) {
        let [x, y] = [truth[j][0] - truth[i][0], truth[j][1] - truth[i][1]];
        if i != j && x.hypot(y) < 3.2 {
            measurements.push(between(random, sort, (i, j), [x, y]));
        }
    }
    let half = if random.random_range(0..4) == 0 {
        1e4
    } else {
        1e3
    };
    let slack_m = if random.random_range(0..2) == 0 {
        0.0
    } else {
        1e-9
    };
    let arena = Arena {
        centre: [0.0; 2],
        half,
    };
    let empty = Polytope::new(robots, &gauge(sort, &truth), arena, slack_m).unwrap();
    Network {
        polytope: with(&empty, &measurements),
        truth,
        measurements,
        sort,
    }
}

/// The same frame with these measurements.
pub(crate) fn with(empty: &Polytope, measurements: &[Measurement]) -> Polytope {
    let mut polytope = empty.clone();
    for (index, measurement) in measurements.iter().enumerate() {
        polytope
            .add(measurement, Source::Measurement(index))
            .unwrap();
    }
    polytope
}

/// The first robot is at zero.
fn places(random: &mut ChaCha8Rng, robots: usize) -> Vec<[f64; 2]> {
    let grid = (0..robots).map(|i| {
        let [column, row] = [i % 3, i / 3].map(|it| f64::from(u8::try_from(it).unwrap()) * 2.0);
        let mut near = |it: f64| it + random.random_range(-0.4..0.4);
        [near(column), near(row)]
    });
    let grid: Vec<_> = grid.collect();
    let origin = grid[0];
    grid.iter()
        .map(|it| [it[0] - origin[0], it[1] - origin[1]])
        .collect()
}

pub(crate) fn gauge(sort: Sort, truth: &[[f64; 2]]) -> Vec<Gauge> {
    let origin = [0, 1].map(|axis| Gauge {
        robot: 0,
        axis,
        value: 0.0,
    });
    let scale = Gauge {
        robot: 1,
        axis: 0,
        value: truth[1][0],
    };
    match sort {
        Sort::Bearings => vec![origin[0], origin[1], scale],
        Sort::Fixed => Vec::new(),
        Sort::Relative => origin.to_vec(),
    }
}

/// The same measurement, off by `bounds` times its bound.
pub(crate) fn spoilt(measurement: &Measurement, bounds: f64) -> Measurement {
    let mut spoilt = *measurement;
    match &mut spoilt {
        Measurement::Between {
            seen: Seen::Bearing(angle) | Seen::RangeBearing(angle, _),
            ..
        } => {
            angle.centre += bounds * angle.half;
        }
        Measurement::Between {
            seen: Seen::Box { centre, half, .. },
            ..
        }
        | Measurement::Fix { centre, half, .. } => centre[0] += bounds * half[0],
        Measurement::Between {
            seen: Seen::RangeMax { .. },
            ..
        } => unreachable!("none is made"),
    }
    spoilt
}

/// An error within `bound`.
fn error(random: &mut ChaCha8Rng, bound: f64) -> f64 {
    random.random_range(-0.999..0.999) * bound
}

fn fix(random: &mut ChaCha8Rng, truth: &[[f64; 2]], robot: usize) -> Measurement {
    let half = [0.3, random.random_range(0.01..0.5)];
    let centre = [0, 1].map(|axis| truth[robot][axis] + error(random, half[axis]));
    Measurement::Fix {
        robot,
        centre,
        half,
    }
}

fn between(
    random: &mut ChaCha8Rng,
    sort: Sort,
    (i, j): (usize, usize),
    [x, y]: [f64; 2],
) -> Measurement {
    let angle_half = [0.005, 0.035, 0.2, 1.0][random.random_range(0..4)];
    let angle = AngleInterval::new(y.atan2(x) + error(random, angle_half), angle_half);
    let range = RangeInterval::multiplicative(x.hypot(y) * (1.0 + error(random, 0.05)), 0.05);
    let seen = match (sort, random.random_range(0..4)) {
        (Sort::Bearings, _) => Seen::Bearing(angle),
        (Sort::Relative, 0) => box_of(random, [x, y]),
        _ => Seen::RangeBearing(angle, range),
    };
    Measurement::Between {
        from: Place::Robot(i),
        to: Place::Robot(j),
        seen,
    }
}

fn box_of(random: &mut ChaCha8Rng, [x, y]: [f64; 2]) -> Seen {
    let heading = random.random_range(-3.0..3.0_f64);
    let (sin, cos) = heading.sin_cos();
    let half = [0.15, 0.3];
    let body = [cos * x + sin * y, cos * y - sin * x];
    Seen::Box {
        centre: [0, 1].map(|axis| body[axis] + error(random, half[axis])),
        half,
        heading: AngleInterval::new(heading + error(random, 0.1), 0.1),
        directions: 8,
    }
}
