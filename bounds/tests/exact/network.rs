//! Networks that the truth satisfies, of all sorts of measurements.

use coloc_bounds::{
    AngleInterval, Arena, Gauge, Measurement, Place, Polytope, RangeInterval, Seen, Source,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Two to eight robots, at most two metres off a grid.
pub(crate) fn network(random: &mut ChaCha8Rng) -> Polytope {
    let robots = random.random_range(2..=8_usize);
    let truth: Vec<[f64; 2]> = (0..robots)
        .map(|i| {
            let [column, row] = [i % 3, i / 3].map(|it| f64::from(u8::try_from(it).unwrap()) * 2.0);
            let mut near = |it: f64| it + random.random_range(-0.4..0.4);
            [near(column), near(row)]
        })
        .collect();
    let origin = truth[0];
    let truth: Vec<_> = truth
        .iter()
        .map(|it| [it[0] - origin[0], it[1] - origin[1]])
        .collect();
    let sort = random.random_range(0..4);
    let half = if random.random_range(0..4) == 0 {
        1e4
    } else {
        1e3
    };
    let mut gauge: Vec<_> = (0..2)
        .map(|axis| Gauge {
            robot: 0,
            axis,
            value: 0.0,
        })
        .collect();
    match sort {
        0 => gauge.push(Gauge {
            robot: 1,
            axis: 0,
            value: truth[1][0],
        }),
        1 => gauge.clear(),
        _ => {}
    }
    let arena = Arena {
        centre: [0.0; 2],
        half,
    };
    let slack_m = if random.random_range(0..2) == 0 {
        0.0
    } else {
        1e-9
    };
    let mut polytope = Polytope::new(robots, &gauge, arena, slack_m).unwrap();
    let mut list = Vec::new();
    if sort == 1 {
        list.push(fix(random, &truth, 0));
    }
    for (i, j) in (0..robots).flat_map(|i| (0..robots).map(move |j| (i, j))) {
        let [x, y] = [truth[j][0] - truth[i][0], truth[j][1] - truth[i][1]];
        if i != j && x.hypot(y) < 3.2 {
            list.push(between(random, sort, (i, j), [x, y]));
        }
    }
    for (index, measurement) in list.iter().enumerate() {
        polytope
            .add(measurement, Source::Measurement(index))
            .unwrap();
    }
    polytope
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
    sort: usize,
    (i, j): (usize, usize),
    [x, y]: [f64; 2],
) -> Measurement {
    let angle_half = [0.005, 0.035, 0.2, 1.0][random.random_range(0..4)];
    let angle = AngleInterval::new(y.atan2(x) + error(random, angle_half), angle_half);
    let range = RangeInterval::multiplicative(x.hypot(y) * (1.0 + error(random, 0.05)), 0.05);
    let seen = match (sort, random.random_range(0..4)) {
        (0, _) => Seen::Bearing(angle),
        (2 | 3, 0) => box_of(random, [x, y]),
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
