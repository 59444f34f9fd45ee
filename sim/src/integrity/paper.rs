//! The experiments of the paper: twelve robots that see bearings alone, ±2°, of who is near; figures 5 and 12 to 14 of Spletzer and Taylor.

use coloc_bounds::{
    AngleInterval, Arena, Gauge, Limits, Measurement, Place, Polytope, Projection, RangeInterval,
    Region, Sandwich, Seen, Shape, Source, Tolerance,
};
use rayon::prelude::*;

use super::Form;
use super::bar::Bars;
use crate::campaign::Finding;
use crate::honest::table::Table;
use crate::random::{Draws, Noise, Purpose};

const ROBOTS: usize = 12;
/// In how many formations.
const FORMATIONS: usize = 40;
const COLUMNS: usize = 4;
const PITCH_M: f64 = 2.0;
const OFF_M: f64 = 0.4;
const SEEN_M: f64 = 3.2;
const BEARING_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Of ranges, where there are any.
const RANGE_SHARE: f64 = 0.05;
/// The paper's first direction is any.
const FIRST: [f64; 2] = [0.955_336_489_125_606, 0.295_520_206_661_339_55];
const SEARCHES: std::ops::RangeInclusive<usize> = 4..=15;
const ARENA: Arena = Arena {
    centre: [0.0; 2],
    half: 1e3,
};

/// Who is where.
fn formation(draws: &mut Draws) -> Vec<[f64; 2]> {
    let at = |robot: usize| [robot % COLUMNS, robot / COLUMNS];
    let places = (0..ROBOTS).map(at);
    #[allow(clippy::cast_precision_loss)] // A dozen.
    let place = |at: [usize; 2]| at.map(|it| PITCH_M * it as f64 + draws.uniform(-OFF_M, OFF_M));
    let mut truth: Vec<_> = places.map(place).collect();
    let first = truth[0];
    for at in &mut truth {
        *at = [at[0] - first[0], at[1] - first[1]];
    }
    truth
}

/// Everybody's bearings of all who are near; with ranges, if they are measured too.
fn seen(truth: &[[f64; 2]], draws: &mut Draws, with_ranges: bool) -> Vec<Measurement> {
    let mut all = Vec::new();
    for (i, j) in (0..ROBOTS).flat_map(|i| (0..ROBOTS).map(move |j| (i, j))) {
        let [x, y] = [truth[j][0] - truth[i][0], truth[j][1] - truth[i][1]];
        let range = x.hypot(y);
        if i == j || range > SEEN_M {
            continue;
        }
        let off = draws.uniform(-BEARING_RAD, BEARING_RAD);
        let bearing = AngleInterval::new(y.atan2(x) + off, BEARING_RAD);
        let said = range * (1.0 + draws.uniform(-RANGE_SHARE, RANGE_SHARE));
        let range = RangeInterval {
            least: said / (1.0 + RANGE_SHARE),
            most: said / (1.0 - RANGE_SHARE),
        };
        all.push(Measurement::Between {
            from: Place::Robot(i),
            to: Place::Robot(j),
            seen: if with_ranges {
                Seen::RangeBearing(bearing, range)
            } else {
                Seen::Bearing(bearing)
            },
        });
    }
    all
}

/// Everybody seen from the first robot; bearings alone have the second robot's x for a scale.
fn polytope(truth: &[[f64; 2]], seen: &[Measurement], with_scale: bool) -> Option<Polytope> {
    let fixed = |robot, axis, value| Gauge { robot, axis, value };
    let mut gauge = vec![fixed(0, 0, 0.0), fixed(0, 1, 0.0)];
    gauge.extend(with_scale.then(|| fixed(1, 0, truth[1][0])));
    let mut polytope = Polytope::new(ROBOTS, &gauge, ARENA, 1e-9).ok()?;
    for (index, measurement) in seen.iter().enumerate() {
        polytope.add(measurement, Source::Measurement(index)).ok()?;
    }
    Some(polytope)
}

/// After so many searches in the largest triangle, or in equally spaced directions.
fn found(
    region: &mut Region<'_>,
    of: Projection,
    searches: usize,
    greedy: bool,
) -> Option<Sandwich> {
    let tolerance = Tolerance::of_programs(&ARENA);
    let mut search = |direction| region.support(of, direction);
    if !greedy {
        return Sandwich::uniform(&mut search, searches, tolerance);
    }
    let limits = Limits {
        ratio: 1.0,
        gap: 0.0,
        searches,
    };
    Sandwich::approximate(&mut search, FIRST, tolerance, limits)
}

/// Sums over robots.
#[derive(Clone, Debug, Default)]
struct Sums {
    robots: f64,
    outside: usize,
    /// Greedy and uniform, for each number of searches: inner of outer area, and outer less inner area \[m²\].
    ratio: [[f64; 12]; 2],
    gap: [[f64; 12]; 2],
    /// By sightings from the first robot, 1 to 4: robots, outer areas \[m²\], and the centre's errors \[m\].
    hops: [[f64; 3]; 4],
}

impl Sums {
    fn plus(mut self, other: &Self) -> Self {
        self.robots += other.robots;
        self.outside += other.outside;
        let of = |it: &mut [[f64; 12]; 2], more: &[[f64; 12]; 2]| {
            for (all, more) in it.iter_mut().flatten().zip(more.iter().flatten()) {
                *all += more;
            }
        };
        of(&mut self.ratio, &other.ratio);
        of(&mut self.gap, &other.gap);
        for (all, more) in self
            .hops
            .iter_mut()
            .flatten()
            .zip(other.hops.iter().flatten())
        {
            *all += more;
        }
        self
    }
}

/// Means over robots by the number of searches, greedy and uniform: inner of outer area, and outer less inner area \[m²\].
pub(super) struct Curves {
    pub(super) ratio: [[f64; 12]; 2],
    pub(super) gap: [[f64; 12]; 2],
}

/// Of bearings alone.
pub(super) fn curves(form: &Form) -> Curves {
    let sums = all(form, false).1;
    let mean = |of: [[f64; 12]; 2]| of.map(|it| it.map(|it| it / sums.robots));
    Curves {
        ratio: mean(sums.ratio),
        gap: mean(sums.gap),
    }
}

/// One formation, as it is drawn.
pub(super) struct Scene {
    pub(super) robots: Vec<Drawn>,
    /// Who sees whom.
    pub(super) seen: Vec<[[f64; 2]; 2]>,
}

/// One robot of it.
pub(super) struct Drawn {
    pub(super) truth: [f64; 2],
    pub(super) outer: Vec<[f64; 2]>,
    pub(super) inner: Vec<[f64; 2]>,
    /// Of the region.
    pub(super) centre: Option<[f64; 2]>,
}

/// The first formation; `None` if its programs fail.
pub(super) fn scene(form: &Form, with_ranges: bool) -> Option<Scene> {
    let mut draws = Noise::new(form.seed, 0).draws(Purpose::Formation, 0, 0, 0);
    let truth = formation(&mut draws);
    let seen = seen(&truth, &mut draws, with_ranges);
    let polytope = polytope(&truth, &seen, !with_ranges)?;
    let mut region = polytope.region().ok()?;
    let mut robots = vec![Drawn {
        truth: truth[0],
        outer: Vec::new(),
        inner: Vec::new(),
        centre: None,
    }];
    for (robot, truth) in truth.iter().enumerate().skip(1) {
        // Where a scale is given, the second robot's x is, and its region a line.
        let found = found(&mut region, Projection::Robot(robot), 32, true);
        let is_polygon = |it: &Sandwich| it.shape() == Shape::Polygon;
        let found = found.filter(is_polygon);
        robots.push(Drawn {
            truth: *truth,
            outer: found.as_ref().map_or(Vec::new(), Sandwich::outer),
            inner: found.as_ref().map_or(Vec::new(), Sandwich::inner),
            centre: found.and_then(|it| it.centroid()),
        });
    }
    let ends = seen.iter().filter_map(|it| match it.ends() {
        (Place::Robot(i), Place::Robot(j)) if i < j => Some([truth[i], truth[j]]),
        _ => None,
    });
    Some(Scene {
        robots,
        seen: ends.collect(),
    })
}

/// By how many sightings each is from the first.
fn hops(seen: &[Measurement]) -> [usize; ROBOTS] {
    let mut hops = [usize::MAX; ROBOTS];
    hops[0] = 0;
    for _ in 0..ROBOTS {
        for it in seen {
            if let (Place::Robot(i), Place::Robot(j)) = it.ends() {
                hops[j] = hops[j].min(hops[i].saturating_add(1));
            }
        }
    }
    hops
}

/// One formation; `None` if its programs fail.
fn one(form: &Form, number: usize, with_ranges: bool) -> Option<Sums> {
    let noise = Noise::new(form.seed, 0);
    let mut draws = noise.draws(Purpose::Formation, number, 0, 0);
    let truth = formation(&mut draws);
    let seen = seen(&truth, &mut draws, with_ranges);
    let polytope = polytope(&truth, &seen, !with_ranges)?;
    let mut region = polytope.region().ok()?;
    let hops = hops(&seen);
    let mut sums = Sums::default();
    let first = if with_ranges { 1 } else { 2 };
    for robot in first..ROBOTS {
        let of = Projection::Robot(robot);
        for (place, searches) in SEARCHES.enumerate() {
            for (how, greedy) in [true, false].into_iter().enumerate() {
                let found = found(&mut region, of, searches, greedy)?;
                if found.shape() == Shape::Polygon {
                    sums.ratio[how][place] += found.ratio();
                    sums.gap[how][place] += found.gap();
                }
            }
        }
        let last = found(&mut region, of, 32, true)?;
        sums.robots += 1.0;
        sums.outside += usize::from(!last.may_hold(truth[robot]));
        let centre = last.centroid()?;
        let error = (centre[0] - truth[robot][0]).hypot(centre[1] - truth[robot][1]);
        if let Some(of_hop) = sums.hops.get_mut(hops[robot].saturating_sub(1)) {
            for (sum, more) in of_hop.iter_mut().zip([1.0, last.outer_area(), error]) {
                *sum += more;
            }
        }
    }
    Some(sums)
}

fn all(form: &Form, with_ranges: bool) -> (usize, Sums) {
    let each: Vec<_> = (0..FORMATIONS)
        .into_par_iter()
        .filter_map(|number| one(form, number, with_ranges))
        .collect();
    let sums = each.iter().fold(Sums::default(), Sums::plus);
    (each.len(), sums)
}

/// What is found.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let mut bars = Bars::default();
    let mut searches = Table::new([
        "searches",
        "inner of outer area: greedy",
        "uniform",
        "outer less inner, m²: greedy",
        "uniform",
    ]);
    let mut regions = Table::new([
        "what is seen",
        "sightings from the first robot",
        "robots",
        "outer area, m² (mean)",
        "the centre is off by, m (mean)",
    ]);
    for (name, with_ranges) in [("bearings ±2°", false), ("bearings ±2°, ranges ±5 %", true)] {
        let (count, sums) = all(form, with_ranges);
        bars.hold(
            count == FORMATIONS && sums.outside == 0,
            &format!(
                "{name}: {} of {} robots in {count} of {FORMATIONS} formations outside of their polygon (0)",
                sums.outside, sums.robots
            ),
        );
        if !with_ranges {
            for (place, number) in SEARCHES.enumerate() {
                let mean = |of: &[[f64; 12]; 2], how: usize| of[how][place] / sums.robots;
                let figures = [
                    (&sums.ratio, 0),
                    (&sums.ratio, 1),
                    (&sums.gap, 0),
                    (&sums.gap, 1),
                ];
                let [a, b, c, d] = figures.map(|(of, how)| format!("{:.3}", mean(of, how)));
                searches.row([number.to_string(), a, b, c, d]);
            }
            let [greedy, uniform] =
                [(0, 5), (1, 11)].map(|(how, at)| sums.ratio[how][at] / sums.robots);
            bars.hold(
                greedy >= 0.9 && uniform < 0.9,
                &format!("{name}: greedy {greedy:.3} after 9 searches (0.9 at least), uniform {uniform:.3} after 15 (below 0.9)"),
            );
        }
        for (hop, [robots, area, error]) in sums.hops.iter().enumerate().filter(|it| it.1[0] > 0.0)
        {
            regions.row([
                name.into(),
                (hop + 1).to_string(),
                robots.to_string(),
                format!("{:.3}", area / robots),
                format!("{:.3}", error / robots),
            ]);
        }
    }
    let mut all = Bars::default();
    all.table(&searches.text());
    all.table(&regions.text());
    all.append(bars);
    let Bars { text, missed } = all;
    Finding {
        title: "The paper's experiments: twelve robots, a frame of their own".into(),
        text,
        missed,
    }
}
