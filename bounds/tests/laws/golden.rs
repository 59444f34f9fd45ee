//! Small networks whose polygons are known.

use coloc_bounds::{
    AngleInterval, Arena, Gauge, Limits, Measurement, Place, Polytope, Projection, RangeInterval,
    Sandwich, Seen, Source, Tolerance,
};

const ARENA: Arena = Arena {
    centre: [0.0; 2],
    half: 1e3,
};

const EXACT: Limits = Limits {
    ratio: 1.0,
    gap: 0.0,
    searches: 100,
};

fn degrees(angle: f64, half: f64) -> AngleInterval {
    AngleInterval::new(angle.to_radians(), half.to_radians())
}

fn between(from: Place, to: Place, seen: Seen) -> Measurement {
    Measurement::Between { from, to, seen }
}

fn polytope(robots: usize, gauge: &[Gauge], measurements: &[Measurement]) -> Polytope {
    let mut polytope = Polytope::new(robots, gauge, ARENA, 0.0).unwrap();
    for (index, it) in measurements.iter().enumerate() {
        polytope.add(it, Source::Measurement(index)).unwrap();
    }
    polytope
}

fn first_at_zero() -> [Gauge; 2] {
    [0, 1].map(|axis| Gauge {
        robot: 0,
        axis,
        value: 0.0,
    })
}

/// The first robot sees the second at 0°, the second the third at 90°.
fn chain() -> Polytope {
    let range = RangeInterval {
        least: 4.0,
        most: 5.0,
    };
    let seen = |angle| Seen::RangeBearing(degrees(angle, 5.0), range);
    let [a, b, c] = [0, 1, 2].map(Place::Robot);
    let measurements = [between(a, b, seen(0.0)), between(b, c, seen(90.0))];
    polytope(3, &first_at_zero(), &measurements)
}

fn searched(polytope: &Polytope, robot: usize, first: [f64; 2], limits: Limits) -> Sandwich {
    let mut region = polytope.region().unwrap();
    let mut search = |direction| region.support(Projection::Robot(robot), direction);
    Sandwich::approximate(&mut search, first, Tolerance::of_programs(&ARENA), limits).unwrap()
}

#[test]
fn one_range_and_bearing_is_a_trapezoid() {
    let range = RangeInterval {
        least: 4.0,
        most: 5.0,
    };
    let seen = Seen::RangeBearing(degrees(30.0, 5.0), range);
    let one = between(Place::Robot(0), Place::Robot(1), seen);
    let found = searched(&polytope(2, &first_at_zero(), &[one]), 1, [0.6, 0.8], EXACT);
    assert!((found.outer_area() - 0.798_031_167).abs() < 1e-8);
    for vertex in [
        [3.625_231, 1.690_473],
        [4.548_849, 2.121_163],
        [4.111_405, 2.878_837],
        [3.276_608, 2.294_306],
    ] {
        let near = |it: &[f64; 2]| (it[0] - vertex[0]).hypot(it[1] - vertex[1]) < 1e-6;
        assert!(found.inner().iter().any(near), "{vertex:?}");
    }
}

#[test]
fn two_bearings_from_anchors() {
    let anchor = |x, angle| {
        between(
            Place::At([x, 0.0]),
            Place::Robot(0),
            Seen::Bearing(degrees(angle, 5.0)),
        )
    };
    let polytope = polytope(1, &[], &[anchor(0.0, 45.0), anchor(4.0, 135.0)]);
    let mut region = polytope.region().unwrap();
    let mut search = |direction| region.support(Projection::Robot(0), direction);
    let tolerance = Tolerance::of_programs(&ARENA);
    let mut found = Sandwich::start(&mut search, [1.0, 0.0], tolerance).unwrap();
    assert!((found.inner_area() - 0.244_951).abs() < 1e-6);
    assert!((found.outer_area() - 0.489_902).abs() < 1e-6);
    for ratio in [0.585_965, 0.707_626, 0.828_783, 1.0] {
        assert!(found.refine(&mut search));
        assert!(
            (found.ratio() - ratio).abs() < 1e-6,
            "{} {ratio}",
            found.ratio()
        );
    }
    let centre = found.centroid().unwrap();
    assert!((centre[0] - 2.0).abs() < 1e-7);
}

#[test]
fn a_chain_is_a_sum_of_trapezoids() {
    let polytope = chain();
    let skew = [0.3_f64.cos(), 0.3_f64.sin()];
    for (robot, first, area, searches) in [
        (2, skew, 3.384_274_005, 16),
        (1, skew, 0.798_031_167, 8),
        (2, [1.0, 0.0], 3.384_274_005, 14),
        (1, [1.0, 0.0], 0.798_031_167, 6),
    ] {
        let found = searched(&polytope, robot, first, EXACT);
        assert!(
            (found.outer_area() - area).abs() < 1e-8,
            "{}",
            found.outer_area()
        );
        assert_eq!(found.searches(), searches, "robot {robot} from {first:?}");
    }
}

#[test]
fn a_loose_robot_and_a_missing_scale_are_unbounded() {
    let range = RangeInterval {
        least: 4.0,
        most: 5.0,
    };
    let seen = Seen::RangeBearing(degrees(0.0, 5.0), range);
    let one = between(Place::Robot(0), Place::Robot(1), seen);
    let loose = polytope(3, &first_at_zero(), &[one]);
    let shape = searched(&loose, 2, [1.0, 0.0], EXACT).shape();
    assert_eq!(shape, coloc_bounds::Shape::Unbounded);
    let bearing = |i, j, angle| {
        between(
            Place::Robot(i),
            Place::Robot(j),
            Seen::Bearing(degrees(angle, 2.0)),
        )
    };
    let triangle = [
        bearing(0, 1, 0.0),
        bearing(0, 2, 60.0),
        bearing(1, 2, 120.0),
    ];
    let scale = Gauge {
        robot: 1,
        axis: 0,
        value: 2.0,
    };
    let [x, y] = first_at_zero();
    let without = searched(&polytope(3, &[x, y], &triangle), 2, [1.0, 0.0], EXACT);
    assert_eq!(without.shape(), coloc_bounds::Shape::Unbounded);
    let with = searched(
        &polytope(3, &[x, y, scale], &triangle),
        2,
        [1.0, 0.0],
        EXACT,
    );
    assert_eq!(with.shape(), coloc_bounds::Shape::Polygon);
}

#[test]
fn frames_that_mean_nothing_are_refused() {
    use coloc_bounds::BadFrame::{BadArena, BadGauge, GaugeNotConnected, NoScale};
    let gauge = |robot, axis, value| Gauge { robot, axis, value };
    let new = |gauge: &[Gauge], arena| Polytope::new(2, gauge, arena, 0.0).map(|_| ());
    assert_eq!(new(&[gauge(2, 0, 0.0)], ARENA), Err(BadGauge));
    assert_eq!(new(&[gauge(0, 2, 0.0)], ARENA), Err(BadGauge));
    assert_eq!(new(&[gauge(0, 0, f64::NAN)], ARENA), Err(BadGauge));
    assert_eq!(
        new(&[gauge(0, 0, 1.0), gauge(0, 0, 1.0)], ARENA),
        Err(BadGauge)
    );
    assert_eq!(new(&[gauge(1, 0, 0.0)], ARENA), Err(NoScale));
    let flat = Arena { half: 0.0, ..ARENA };
    assert_eq!(new(&[], flat), Err(BadArena));
    let alone = polytope(2, &first_at_zero(), &[]);
    assert_eq!(alone.check_connected(), Err(GaugeNotConnected));
}
